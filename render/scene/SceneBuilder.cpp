#include "SceneBuilder.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "simflex/base/Utf8.h"
#include "simflex/body/SurfaceFile.h"

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

std::vector<std::string> splitLines(const std::string& text) {
    std::vector<std::string> lines(1);
    for (const char c : text) {
        if (c == '\n')
            lines.emplace_back();
        else if (c != '\r')
            lines.back() += c == '\t' ? ' ' : c;
    }
    return lines;
}

bool isFinite(const Transform& X) {
    return X.p().isFinite() && X.R().isFinite();
}

// Rotates the y axis to a direction.
Rotation alignY(const Vec3& direction) {
    const UnitVec3 y(direction);
    return Rotation(y, SimTK::YAxis, y.perp(), SimTK::XAxis);
}

}  // namespace

const Vec3& getAxisColor(int axis) {
    static const Vec3 colors[] = {Vec3(0.82, 0.24, 0.22), Vec3(0.30, 0.62, 0.25),
                                  Vec3(0.20, 0.40, 0.80)};
    return colors[axis];
}

void SurfaceItem::appendBounds(std::vector<Vec3>& points_G) const {
    for (int corner = 0; corner < 8; ++corner) {
        Vec3 p;
        for (int k = 0; k < 3; ++k)
            p[k] = scale[k] * ((corner >> k) & 1 ? geometry->upper[k] : geometry->lower[k]);
        points_G.push_back(X_GM * p);
    }
}

void Scene::appendSolidBounds(std::vector<Vec3>& points_G) const {
    for (const SurfaceItem& item : surfaces) item.appendBounds(points_G);
    for (const PointItem& item : points) points_G.push_back(item.location);
}

void Scene::appendBounds(std::vector<Vec3>& points_G) const {
    appendSolidBounds(points_G);
    for (const LineItem& item : lines) {
        points_G.push_back(item.start);
        points_G.push_back(item.end);
    }
    for (const TextItem& item : texts) {
        // Approximate width; a text that faces the camera is treated as if it stood in its frame.
        const double width =
            0.85 * item.widthFactor * item.height * double(countCharacters(item.text));
        const double base = -item.line * TextItem::lineSpacing * item.height;
        for (const Vec3& corner :
             {Vec3(0, base, 0), Vec3(width, base, 0), Vec3(0, base + item.height, 0)})
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
    try {
        return shape = createFromPolygons(readSurface(path));
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
                           PixelRadius radiusInPixels, double unit)
    : scene(sceneToFill),
      shapes(shapeCache),
      bodyPose(std::move(poseOfBody)),
      pixelRadius(std::move(radiusInPixels)),
      pixelUnit(unit) {}

void SceneBuilder::add(const DecorativeGeometry& geometry) {
    const std::size_t numSurfaces = scene.surfaces.size(), numLines = scene.lines.size(),
                      numPoints = scene.points.size(), numTexts = scene.texts.size();
    geometry.implementGeometry(*this);

    bool areFinite = true;
    for (std::size_t i = numSurfaces; i < scene.surfaces.size(); ++i)
        areFinite &= isFinite(scene.surfaces[i].X_GM) && scene.surfaces[i].scale.isFinite();
    for (std::size_t i = numLines; i < scene.lines.size(); ++i)
        areFinite &= scene.lines[i].start.isFinite() && scene.lines[i].end.isFinite();
    for (std::size_t i = numPoints; i < scene.points.size(); ++i)
        areFinite &= scene.points[i].location.isFinite();
    for (std::size_t i = numTexts; i < scene.texts.size(); ++i)
        areFinite &= isFinite(scene.texts[i].X_GT) && std::isfinite(scene.texts[i].height) &&
                     std::isfinite(scene.texts[i].widthFactor);
    if (!areFinite) {
        ++numNotFinite[geometry.getBodyId()];
        scene.surfaces.resize(numSurfaces);
        scene.lines.resize(numLines);
        scene.points.resize(numPoints);
        scene.texts.resize(numTexts);
        return;
    }

    // Flat objects get a small thickness, since normals transform with the inverse scale.
    std::size_t kept = numSurfaces;
    for (std::size_t i = numSurfaces; i < scene.surfaces.size(); ++i) {
        Vec3& scale = scene.surfaces[i].scale;
        scale = scale.abs();
        const double largest = SimTK::max(scale);
        for (int k = 0; k < 3; ++k) scale[k] = std::max(scale[k], 1e-6 * largest);
        if (largest > 0) {
            if (kept != i) scene.surfaces[kept] = scene.surfaces[i];
            ++kept;
        }
    }
    scene.surfaces.resize(kept);
}

void SceneBuilder::addNotices() {
    for (const auto& [body, count] : numNotFinite)
        scene.screenTexts.push_back(
            "not drawn: " + std::to_string(count) +
            (count == 1 ? " decoration of mobilized body " : " decorations of mobilized body ") +
            std::to_string(body) + " whose place or size is not finite");
    numNotFinite.clear();
}

Transform SceneBuilder::calcPose(const DecorativeGeometry& geometry) const {
    return bodyPose(geometry.getBodyId()) * geometry.getTransform();
}

// Chooses the number of slices that keeps a round outline within a fifth of a pixel of a circle,
// the finest visible; fewer for wireframes.
int SceneBuilder::chooseSlices(const DecorativeGeometry& geometry, const Vec3& center_G,
                               double radius) const {
    const double resolution = geometry.getResolution() > 0 ? geometry.getResolution() : 1;
    // Denser lines or points would fill the shape.
    if (geometry.getRepresentation() == DecorativeGeometry::DrawWireframe ||
        geometry.getRepresentation() == DecorativeGeometry::DrawPoints)
        return std::max(8, 2 * int(std::lround(10 * std::min(resolution, 20.0))));
    const double wanted =
        std::min(resolution, 1.0) * SimTK::Pi * std::sqrt(2.5 * pixelRadius(center_G, radius));
    for (const int slices : {8, 12, 16, 24, 32, 48, 64, 96, 128})
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
    if (!isFinite(item.X_GM)) {
        scene.surfaces.push_back(item);  // to be counted
        return;
    }
    const bool hasColor = frame.getColor()[0] >= 0;
    const double thickness = frame.getLineThickness() > 0 ? frame.getLineThickness() : 1;
    for (int axis = 0; axis < 3; ++axis) {
        Vec3 end(0);
        end[axis] = frame.getAxisLength() * item.scale[axis];
        if (!hasColor) item.color = getAxisColor(axis);
        // Slender, so that the frame does not hide its object.
        const double size = std::abs(end[axis]);
        if (size == 0) continue;
        const double pixels = pixelRadius(item.X_GM.p(), size) / (thickness * pixelUnit);
        const double tipRadius = thickness * size * std::min(0.03, 4.5 / pixels);
        const double tipLength = std::min(3.4 * tipRadius, 0.5 * size);
        const Vec3 neck = item.X_GM * ((1 - tipLength / size) * end);
        scene.lines.push_back({item.X_GM.p(), neck, item.color, item.opacity, 1.6 * thickness});
        SurfaceItem tip = item;
        tip.geometry = shapes.getCone(chooseSlices(frame, neck, tipRadius));
        tip.X_GM = Transform(alignY(item.X_GM.R() * end), neck);
        tip.scale = Vec3(tipRadius, tipLength, tipRadius);
        scene.surfaces.push_back(tip);
    }
}

void SceneBuilder::implementTextGeometry(const SimTK::DecorativeText& text) {
    if (isHidden(text) || text.getText().empty()) return;
    const std::vector<std::string> lines = splitLines(text.getText());
    if (text.getIsScreenText()) {
        scene.screenTexts.insert(scene.screenTexts.end(), lines.begin(), lines.end());
        return;
    }
    TextItem item;
    item.X_GT = calcPose(text);
    const Vec3 scale = getScale(text);
    item.height = scale[1];
    item.widthFactor = scale[0] / scale[1];
    item.color = getColor(text, defaultLineColor);
    item.opacity = getOpacity(text);
    item.facesCamera = text.getFaceCamera() != 0;
    for (const std::string& line : lines) {
        item.text = line;
        if (!line.empty()) scene.texts.push_back(item);
        ++item.line;
    }
}

void SceneBuilder::implementMeshGeometry(const SimTK::DecorativeMesh& mesh) {
    if (isHidden(mesh) || mesh.getMesh().isEmptyHandle()) return;
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
    if (!(radius > 0 && torus.getTubeRadius() > 0)) return;
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
    const double ownLength = (arrow.getEndPoint() - arrow.getStartPoint()).norm();
    if (length == 0 || ownLength == 0) return;
    const double tip = length * std::min(arrow.getTipLength() / ownLength, 0.6);
    addArrow(item, start, end, tip, 0.12 * tip, 0.32 * tip, chooseSlices(arrow, end, 0.32 * tip));
}

void SceneBuilder::implementConeGeometry(const SimTK::DecorativeCone& cone) {
    if (isHidden(cone)) return;
    SurfaceItem item = makeItem(cone);
    // Scaled along the axes of the decoration's frame; an oblique cone remains a right one.
    const auto scaled = [&](const Vec3& v) { return Vec3(v.elementwiseMultiply(item.scale)); };
    const Rotation R = alignY(cone.getDirection());
    const Vec3 axis = scaled(cone.getHeight() * Vec3(R.y()));
    const double r = cone.getBaseRadius();
    const Vec3 size(r * scaled(Vec3(R.x())).norm(), axis.norm(), r * scaled(Vec3(R.z())).norm());
    if (axis.isFinite() && axis.norm() == 0) return;
    item.X_GM =
        item.X_GM * Transform(Rotation(UnitVec3(axis), SimTK::YAxis, Vec3(R.x()), SimTK::XAxis),
                              scaled(cone.getOrigin()));
    item.scale = size;
    item.geometry = shapes.getCone(chooseSlices(cone, item.X_GM.p(), item.scale[0]));
    scene.surfaces.push_back(item);
}

void SceneBuilder::addArrow(const SurfaceItem& style, const Vec3& start_G, const Vec3& end_G,
                            double tipLength, double shaftRadius, double tipRadius, int slices) {
    const Vec3 span = end_G - start_G;
    const double length = span.norm();
    if (length == 0) return;
    if (!span.isFinite()) {
        SurfaceItem item = style;
        item.X_GM.updP() = end_G + start_G;
        scene.surfaces.push_back(item);  // to be counted
        return;
    }
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
