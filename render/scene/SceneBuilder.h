#pragma once
/** @file
Converts Simbody's decorative geometry into scene items. Internal to the renderer. **/

#include <functional>
#include <map>
#include <string>
#include <utility>

#include "Scene.h"
#include "SimTKcommon.h"

namespace simflex {

/** Shapes shared by frames: created on demand, dropped when a frame no longer uses them. **/
class ShapeCache {
public:
    SurfaceGeometryPtr getBrick();
    SurfaceGeometryPtr getSphere(int slices);
    SurfaceGeometryPtr getCylinder(int slices);
    SurfaceGeometryPtr getCircle(int slices);
    SurfaceGeometryPtr getCone(int slices);
    SurfaceGeometryPtr getTorus(double tubeRadius, int slices);
    SurfaceGeometryPtr getPolygons(const SimTK::PolygonalMesh& mesh);

    /** @throws std::runtime_error naming the file and the error. **/
    SurfaceGeometryPtr getMeshFile(const std::string& path);

    /** Call after a frame: drops polygonal meshes that the frame did not use. **/
    void dropUnused();

private:
    struct PolygonEntry {
        SimTK::PolygonalMesh mesh;  // keeps the key's address from being reused
        SurfaceGeometryPtr geometry;
        bool isUsed = true;
    };

    SurfaceGeometryPtr brick;
    std::map<std::pair<int, int>, SurfaceGeometryPtr> rounds;  // shape kind, slices
    std::map<std::pair<double, int>, SurfaceGeometryPtr> tori;
    std::map<const void*, PolygonEntry> polygons;
    std::map<std::string, SurfaceGeometryPtr> files;
};

/** Returns red, green and blue for the axes x, y and z. **/
const SimTK::Vec3& getAxisColor(int axis);

class SceneBuilder : public SimTK::DecorativeGeometryImplementation {
public:
    /** Pose of a mobilized body in Ground, by its index. **/
    using BodyPose = std::function<SimTK::Transform(int bodyId)>;

    /** Apparent radius in pixels of a sphere with this centre and radius in Ground. **/
    using PixelRadius = std::function<double(const SimTK::Vec3& center_G, double radius)>;

    /** `pixelUnit` is the number of pixels per 1/720 of the picture's height. **/
    SceneBuilder(Scene& scene, ShapeCache& shapes, BodyPose bodyPose, PixelRadius pixelRadius,
                 double pixelUnit = 1);

    /** Appends a decoration. One with a non-finite position or size is omitted and counted, one
    without size is omitted. **/
    void add(const SimTK::DecorativeGeometry& geometry);

    /** Reports omitted decorations and their bodies in the scene's screen texts. **/
    void addNotices();

    void implementPointGeometry(const SimTK::DecorativePoint&) override;
    void implementLineGeometry(const SimTK::DecorativeLine&) override;
    void implementBrickGeometry(const SimTK::DecorativeBrick&) override;
    void implementCylinderGeometry(const SimTK::DecorativeCylinder&) override;
    void implementCircleGeometry(const SimTK::DecorativeCircle&) override;
    void implementSphereGeometry(const SimTK::DecorativeSphere&) override;
    void implementEllipsoidGeometry(const SimTK::DecorativeEllipsoid&) override;
    void implementFrameGeometry(const SimTK::DecorativeFrame&) override;
    void implementTextGeometry(const SimTK::DecorativeText&) override;
    void implementMeshGeometry(const SimTK::DecorativeMesh&) override;
    void implementMeshFileGeometry(const SimTK::DecorativeMeshFile&) override;
    void implementTorusGeometry(const SimTK::DecorativeTorus&) override;
    void implementArrowGeometry(const SimTK::DecorativeArrow&) override;
    void implementConeGeometry(const SimTK::DecorativeCone&) override;

private:
    SimTK::Transform calcPose(const SimTK::DecorativeGeometry& geometry) const;
    int chooseSlices(const SimTK::DecorativeGeometry& geometry, const SimTK::Vec3& center_G,
                     double radius) const;
    SurfaceItem makeItem(const SimTK::DecorativeGeometry& geometry) const;
    void addArrow(const SurfaceItem& style, const SimTK::Vec3& start_G, const SimTK::Vec3& end_G,
                  double tipLength, double shaftRadius, double tipRadius, int slices);

    Scene& scene;
    ShapeCache& shapes;
    BodyPose bodyPose;
    PixelRadius pixelRadius;
    double pixelUnit;
    std::map<int, int> numNotFinite;  // decorations by mobilized body
};

}  // namespace simflex
