#include "SceneBuilder.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <stdexcept>

namespace simflex {

using SimTK::DecorativeGeometry;
using SimTK::Rotation;
using SimTK::Transform;
using SimTK::UnitVec3;
using SimTK::Vec3;

namespace {

const Vec3 defaultSurfaceColor(0.62, 0.67, 0.73);
const Vec3 defaultLineColor(0.25, 0.28, 0.33);

enum RoundShape { Sphere, Cylinder, Circle, Cone };

Vec3 getScale(const DecorativeGeometry& geometry) {
    Vec3 scale = geometry.getScaleFactors();
    for (int k = 0; k < 3; ++k)
        if (!(scale[k] > 0)) scale[k] = 1;
    return scale;
}

Vec3 getColor(const DecorativeGeometry& geometry, const Vec3& otherwise) {
    const Vec3& color = geometry.getColor();
    return color[0] < 0 ? otherwise : color;
}

double getOpacity(const DecorativeGeometry& geometry) {
    const double opacity = geometry.getOpacity();
    return opacity < 0 ? 1 : std::min(1.0, opacity);
}

bool isHidden(const DecorativeGeometry& geometry) {
    return geometry.getRepresentation() == DecorativeGeometry::Hide;
}

// Turns the y axis to a direction.
Rotation alignY(const Vec3& direction) {
    const UnitVec3 y(direction);
    return Rotation(y, SimTK::YAxis, y.perp(), SimTK::XAxis);
}

}  // namespace

void SurfaceItem::appendBounds(std::vector<Vec3>& points_G) const {
    for (int corner = 0; corner < 8; ++corner) {
        Vec3 p;
        for (int k = 0; k < 3; ++k)
            p[k] = scale[k] * ((corner >> k) & 1 ? geometry->upper[k] : geometry->lower[k]);
        points_G.push_back(X_GM * p);
    }
}

void Scene::appendBounds(std::vector<Vec3>& points_G) const {
    for (const SurfaceItem& item : surfaces) item.appendBounds(points_G);
    for (const LineItem& item : lines) {
        points_G.push_back(item.start);
        points_G.push_back(item.end);
    }
    for (const PointItem& item : points) points_G.push_back(item.location);
    for (const TextItem& item : texts) {
        // About as wide as it will be; a text that faces the camera is taken to stand as in its
        // frame.
        const double width = 0.85 * item.height * double(item.text.size());
        for (const Vec3& corner : {Vec3(0), Vec3(width, 0, 0), Vec3(0, item.height, 0)})
            points_G.push_back(item.X_GT * corner);
    }
}

SurfaceGeometryPtr ShapeCache::getBrick() {
    if (!brick) brick = createBrick();
    return brick;
}

SurfaceGeometryPtr ShapeCache::getSphere(int slices) {
    SurfaceGeometryPtr& shape = rounds[{Sphere, slices}];
    return shape ? shape : shape = createSphere(slices);
}

SurfaceGeometryPtr ShapeCache::getCylinder(int slices) {
    SurfaceGeometryPtr& shape = rounds[{Cylinder, slices}];
    return shape ? shape : shape = createCylinder(slices);
}

SurfaceGeometryPtr ShapeCache::getCircle(int slices) {
    SurfaceGeometryPtr& shape = rounds[{Circle, slices}];
    return shape ? shape : shape = createCircle(slices);
}

SurfaceGeometryPtr ShapeCache::getCone(int slices) {
    SurfaceGeometryPtr& shape = rounds[{Cone, slices}];
    return shape ? shape : shape = createCone(slices);
}

SurfaceGeometryPtr ShapeCache::getTorus(double tubeRadius, int slices) {
    SurfaceGeometryPtr& shape = tori[{tubeRadius, slices}];
    return shape ? shape : shape = createTorus(tubeRadius, slices);
}

SurfaceGeometryPtr ShapeCache::getPolygons(const SimTK::PolygonalMesh& mesh) {
    const auto found = polygons.find(&mesh.getImpl());
    if (found != polygons.end()) {
        found->second.isUsed = true;
        return found->second.geometry;
    }
    return polygons.emplace(&mesh.getImpl(), PolygonEntry{mesh, createFromPolygons(mesh), true})
        .first->second.geometry;
}

SurfaceGeometryPtr ShapeCache::getMeshFile(const std::string& path) {
    SurfaceGeometryPtr& shape = files[path];
    if (shape) return shape;
    if (!std::ifstream(path)) throw std::runtime_error("cannot read the mesh file '" + path + "'");
    try {
        SimTK::PolygonalMesh mesh;
        mesh.loadFile(path);
        return shape = createFromPolygons(mesh);
    } catch (const std::exception& e) {
        throw std::runtime_error("cannot draw the mesh file '" + path + "': " + e.what());
    }
}

void ShapeCache::dropUnused() {
    for (auto entry = polygons.begin(); entry != polygons.end();) {
        const bool isUsed = entry->second.isUsed;
        entry->second.isUsed = false;
        entry = isUsed ? std::next(entry) : polygons.erase(entry);
    }
    constexpr std::size_t manyTori = 64;
    if (tori.size() > manyTori) tori.clear();
}

SceneBuilder::SceneBuilder(Scene& sceneToFill, ShapeCache& shapeCache, BodyPose poseOfBody,
                           PixelRadius radiusInPixels)
    : scene(sceneToFill),
      shapes(shapeCache),
      bodyPose(std::move(poseOfBody)),
      pixelRadius(std::move(radiusInPixels)) {}

Transform SceneBuilder::calcPose(const DecorativeGeometry& geometry) const {
    const Transform X_GD = bodyPose(geometry.getBodyId()) * geometry.getTransform();
    if (!X_GD.p().isFinite() || !X_GD.R().isFinite())
        throw std::runtime_error("a decoration of mobilized body " +
                                 std::to_string(geometry.getBodyId()) +
                                 " has a pose that is not finite: " + X_GD.p().toString());
    return X_GD;
}

// As many slices as keep a round outline within a tenth of a pixel of a circle.
int SceneBuilder::chooseSlices(const DecorativeGeometry& geometry, const Vec3& center_G,
                               double radius) const {
    const double resolution = geometry.getResolution() > 0 ? geometry.getResolution() : 1;
    const double wanted = resolution * SimTK::Pi * std::sqrt(5 * pixelRadius(center_G, radius));
    for (const int slices : {16, 24, 32, 48, 64, 96, 128})
        if (wanted <= slices) return slices;
    return 192;
}

SurfaceItem SceneBuilder::makeItem(const DecorativeGeometry& geometry) const {
    SurfaceItem item;
    item.X_GM = calcPose(geometry);
    item.scale = getScale(geometry);
    item.color = getColor(geometry, defaultSurfaceColor);
    item.opacity = getOpacity(geometry);
    if (geometry.getRepresentation() != DecorativeGeometry::DrawDefault)
        item.representation = geometry.getRepresentation();
    return item;
}

void SceneBuilder::implementPointGeometry(const SimTK::DecorativePoint& point) {
    if (isHidden(point)) return;
    const double thickness = point.getLineThickness();
    scene.points.push_back({calcPose(point) * point.getPoint().elementwiseMultiply(getScale(point)),
                            getColor(point, defaultLineColor), getOpacity(point),
                            thickness > 0 ? thickness : 6});
}

void SceneBuilder::implementLineGeometry(const SimTK::DecorativeLine& line) {
    if (isHidden(line)) return;
    const Transform X_GD = calcPose(line);
    const Vec3 scale = getScale(line);
    const double thickness = line.getLineThickness();
    scene.lines.push_back({X_GD * line.getPoint1().elementwiseMultiply(scale),
                           X_GD * line.getPoint2().elementwiseMultiply(scale),
                           getColor(line, defaultLineColor), getOpacity(line),
                           thickness > 0 ? thickness : 1.5});
}

void SceneBuilder::implementBrickGeometry(const SimTK::DecorativeBrick& brick) {
    if (isHidden(brick)) return;
    SurfaceItem item = makeItem(brick);
    item.geometry = shapes.getBrick();
    item.scale = item.scale.elementwiseMultiply(brick.getHalfLengths());
    scene.surfaces.push_back(item);
}

void SceneBuilder::implementCylinderGeometry(const SimTK::DecorativeCylinder& cylinder) {
    if (isHidden(cylinder)) return;
    SurfaceItem item = makeItem(cylinder);
    const double r = cylinder.getRadius();
    item.scale = item.scale.elementwiseMultiply(Vec3(r, cylinder.getHalfHeight(), r));
    item.geometry = shapes.getCylinder(
        chooseSlices(cylinder, item.X_GM.p(), std::max(item.scale[0], item.scale[2])));
    scene.surfaces.push_back(item);
}

void SceneBuilder::implementCircleGeometry(const SimTK::DecorativeCircle& circle) {
    if (isHidden(circle)) return;
    SurfaceItem item = makeItem(circle);
    const double r = circle.getRadius();
    item.scale = item.scale.elementwiseMultiply(Vec3(r, r, 1));
    item.geometry = shapes.getCircle(
        chooseSlices(circle, item.X_GM.p(), std::max(item.scale[0], item.scale[1])));
    scene.surfaces.push_back(item);
}

void SceneBuilder::implementSphereGeometry(const SimTK::DecorativeSphere& sphere) {
    if (isHidden(sphere)) return;
    SurfaceItem item = makeItem(sphere);
    item.scale *= sphere.getRadius();
    item.geometry = shapes.getSphere(chooseSlices(sphere, item.X_GM.p(), SimTK::max(item.scale)));
    scene.surfaces.push_back(item);
}

void SceneBuilder::implementEllipsoidGeometry(const SimTK::DecorativeEllipsoid& ellipsoid) {
    if (isHidden(ellipsoid)) return;
    SurfaceItem item = makeItem(ellipsoid);
    item.scale = item.scale.elementwiseMultiply(ellipsoid.getRadii());
    item.geometry =
        shapes.getSphere(chooseSlices(ellipsoid, item.X_GM.p(), SimTK::max(item.scale)));
    scene.surfaces.push_back(item);
}

void SceneBuilder::implementFrameGeometry(const SimTK::DecorativeFrame& frame) {
    if (isHidden(frame)) return;
    SurfaceItem item = makeItem(frame);
    const bool hasColor = frame.getColor()[0] >= 0;
    const Vec3 axisColors[] = {Vec3(0.82, 0.24, 0.22), Vec3(0.30, 0.62, 0.25),
                               Vec3(0.20, 0.40, 0.80)};
    const double length = frame.getAxisLength();
    const int slices = chooseSlices(frame, item.X_GM.p(), 0.07 * length * item.scale[0]);
    for (int axis = 0; axis < 3; ++axis) {
        Vec3 end(0);
        end[axis] = length * item.scale[axis];
        if (!hasColor) item.color = axisColors[axis];
        const double size = end[axis];
        addArrow(item, item.X_GM.p(), item.X_GM * end, 0.24 * size, 0.022 * size, 0.07 * size,
                 slices);
    }
}

void SceneBuilder::implementTextGeometry(const SimTK::DecorativeText& text) {
    if (isHidden(text) || text.getText().empty()) return;
    if (text.getIsScreenText()) {
        scene.screenTexts.push_back(text.getText());
        return;
    }
    TextItem item;
    item.text = text.getText();
    item.X_GT = calcPose(text);
    item.height = getScale(text)[1];
    item.color = getColor(text, defaultLineColor);
    item.opacity = getOpacity(text);
    item.facesCamera = text.getFaceCamera() != 0;
    scene.texts.push_back(item);
}

void SceneBuilder::implementMeshGeometry(const SimTK::DecorativeMesh& mesh) {
    if (isHidden(mesh)) return;
    SurfaceItem item = makeItem(mesh);
    item.geometry = shapes.getPolygons(mesh.getMesh());
    scene.surfaces.push_back(item);
}

void SceneBuilder::implementMeshFileGeometry(const SimTK::DecorativeMeshFile& file) {
    if (isHidden(file)) return;
    SurfaceItem item = makeItem(file);
    item.geometry = shapes.getMeshFile(file.getMeshFile());
    scene.surfaces.push_back(item);
}

void SceneBuilder::implementTorusGeometry(const SimTK::DecorativeTorus& torus) {
    if (isHidden(torus)) return;
    SurfaceItem item = makeItem(torus);
    const double radius = torus.getTorusRadius();
    item.scale *= radius;
    item.geometry = shapes.getTorus(
        torus.getTubeRadius() / radius,
        chooseSlices(torus, item.X_GM.p(), SimTK::max(item.scale) + torus.getTubeRadius()));
    scene.surfaces.push_back(item);
}

void SceneBuilder::implementArrowGeometry(const SimTK::DecorativeArrow& arrow) {
    if (isHidden(arrow)) return;
    const SurfaceItem item = makeItem(arrow);
    const Vec3 start = item.X_GM * arrow.getStartPoint().elementwiseMultiply(item.scale);
    const Vec3 end = item.X_GM * arrow.getEndPoint().elementwiseMultiply(item.scale);
    const double length = (end - start).norm();
    if (!(length > 0)) return;
    const double tip = std::min(arrow.getTipLength() * SimTK::max(item.scale), 0.6 * length);
    addArrow(item, start, end, tip, 0.12 * tip, 0.32 * tip, chooseSlices(arrow, end, 0.32 * tip));
}

void SceneBuilder::implementConeGeometry(const SimTK::DecorativeCone& cone) {
    if (isHidden(cone)) return;
    SurfaceItem item = makeItem(cone);
    const Vec3 base = cone.getOrigin().elementwiseMultiply(item.scale);
    item.X_GM = item.X_GM * Transform(alignY(cone.getDirection()), base);
    item.scale =
        SimTK::max(item.scale) * Vec3(cone.getBaseRadius(), cone.getHeight(), cone.getBaseRadius());
    item.geometry = shapes.getCone(chooseSlices(cone, item.X_GM.p(), item.scale[0]));
    scene.surfaces.push_back(item);
}

void SceneBuilder::addArrow(const SurfaceItem& style, const Vec3& start_G, const Vec3& end_G,
                            double tipLength, double shaftRadius, double tipRadius, int slices) {
    const Vec3 span = end_G - start_G;
    const double length = span.norm();
    if (!(length > 0)) return;
    const Rotation R = alignY(span);
    const double shaftLength = length - tipLength;

    SurfaceItem shaft = style;
    shaft.geometry = shapes.getCylinder(slices);
    shaft.X_GM = Transform(R, start_G + 0.5 * shaftLength / length * span);
    shaft.scale = Vec3(shaftRadius, 0.5 * shaftLength, shaftRadius);
    scene.surfaces.push_back(shaft);

    SurfaceItem tip = style;
    tip.geometry = shapes.getCone(slices);
    tip.X_GM = Transform(R, start_G + shaftLength / length * span);
    tip.scale = Vec3(tipRadius, tipLength, tipRadius);
    scene.surfaces.push_back(tip);
}

}  // namespace simflex
