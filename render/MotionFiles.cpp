/** @file
Files of whole motions written by OffscreenVisualizer. **/

#include <algorithm>
#include <cmath>
#include <set>

#include "OffscreenVisualizerImpl.h"
#include "simflex/base/Base64.h"
#include "simflex/base/DisplayUnit.h"
#include "simflex/render/motion/GltfFile.h"
#include "simflex/render/motion/MovingScene.h"
#include "simflex/render/motion/ShapeSeries.h"

namespace simflex {

using SimTK::State;
using SimTK::Transform;
using SimTK::Vec3;

namespace {

constexpr double shapeTolerance = 2e-5;  // relative to the part's size
constexpr double linkRadius = 0.006;     // relative to the scene's
const Vec3 linkColor(0.35, 0.38, 0.43);
constexpr double colorTolerance = 1e-3;  // relative to the largest displacement

double calcLinear(double value) {
    return value <= 0.04045 ? value / 12.92 : std::pow((value + 0.055) / 1.055, 2.4);
}

/** Returns Φ and the six fields of a ReferenceMotion at the skin's nodes. **/
std::vector<float> collectFields(const SkinModes& skin) {
    const std::size_t rows = skin.restPositions.size();
    std::vector<float> fields = skin.Phi;
    fields.resize(fields.size() + 6 * rows, 0.0f);
    float* field = &fields[skin.Phi.size()];
    for (int axis = 0; axis < 3; ++axis, field += rows)
        for (std::size_t i = std::size_t(axis); i < rows; i += 3) field[i] = 1;
    for (int axis = 0; axis < 3; ++axis, field += rows)
        for (std::size_t i = 0; i < rows; i += 3) {
            Vec3 turn(0);
            turn[axis] = 1;
            const float* s = &skin.restPositions[i];
            const Vec3 u = turn % Vec3(s[0], s[1], s[2]);
            for (int k = 0; k < 3; ++k) field[i + std::size_t(k)] = float(u[k]);
        }
    return fields;
}

/** Returns the coefficients of collectFields() for the displacement of the part. **/
std::vector<double> calcCoefficients(const PartSnapshot& part, double factor) {
    std::vector<double> c;
    for (int i = 0; i < part.xi.size(); ++i) c.push_back(factor * part.xi[i]);
    for (const Vec3& motion : {part.reference.shift, part.reference.turn})
        for (int k = 0; k < 3; ++k) c.push_back(-(factor - 1) * motion[k]);
    return c;
}

/** Maps three values per node to the vertices. **/
std::vector<float> spread3(const SkinModes& skin, std::vector<float> ofPoints) {
    const std::size_t numNodes = std::size_t(skin.numNodes());
    ofPoints.resize(3 * std::size_t(skin.numPoints()));
    skin.between.interpolate3(ofPoints.data(), ofPoints.data() + 3 * numNodes);
    std::vector<float> ofVertices;
    ofVertices.reserve(3 * skin.vertexPoint.size());
    for (const int point : skin.vertexPoint)
        for (int k = 0; k < 3; ++k) ofVertices.push_back(ofPoints[std::size_t(3 * point + k)]);
    return ofVertices;
}

void readVertices(const SurfaceGeometry& geometry, std::vector<float>& positions,
                  std::vector<float>& normals) {
    constexpr std::size_t stride = SurfaceGeometry::floatsPerVertex;
    for (std::size_t i = 0; i < geometry.vertices.size(); i += stride) {
        const float* vertex = &geometry.vertices[i];
        positions.insert(positions.end(), vertex, vertex + 3);
        const Vec3 n(vertex[3], vertex[4], vertex[5]);
        const Vec3 unit = n.norm() > 0 ? n / n.norm() : Vec3(0, 0, 1);
        for (int k = 0; k < 3; ++k) normals.push_back(float(unit[k]));
    }
}

Json toJson(const Vec3& v) {
    return Json(std::vector<double>{v[0], v[1], v[2]});
}

/** Returns x, y, z, w; of the two equivalent quaternions the one closer to `before`. **/
SimTK::Vec4 calcQuaternion(const SimTK::Rotation& R, const SimTK::Vec4& before) {
    const SimTK::Quaternion q = R.convertRotationToQuaternion();
    const SimTK::Vec4 found(q[1], q[2], q[3], q[0]);
    return SimTK::dot(found, before) < 0 ? SimTK::Vec4(-found) : found;
}

Json toJson(const SimTK::Rotation& R) {
    const SimTK::Vec4 q = calcQuaternion(R, SimTK::Vec4(0, 0, 0, 1));
    return Json(std::vector<double>{q[0], q[1], q[2], q[3]});
}

bool isSame(const std::vector<Transform>& poses) {
    return std::all_of(poses.begin(), poses.end(), [&](const Transform& pose) {
        return pose.p() == poses.front().p() && pose.R() == poses.front().R();
    });
}

/** Writes a MovingScene as glTF. **/
class GltfMotion {
public:
    GltfMotion(const MovingScene& scene, const AnimationOptions& options)
        : m_scene(scene), m_options(options) {}

    void write(const std::string& path) {
        std::vector<float> times;
        for (const double t : m_scene.time)
            times.push_back(float((t - m_scene.time.front()) * m_options.slowMotion));
        for (std::size_t i = 1; i < times.size(); ++i)  // must be strictly increasing
            if (!(times[i] > times[i - 1])) times[i] = std::nextafter(times[i - 1], INFINITY);
        m_times = m_file.addFloats(times, "SCALAR", GltfFile::Target::None, true);
        std::vector<int> children;
        for (const MovingScene::Body& body : m_scene.bodies)
            children.push_back(body.isFlexible() ? addFlexible(body) : addRigid(body));
        for (const MovingScene::Link& link : m_scene.links) children.push_back(addLink(link));
        for (const MovingScene::View& view : m_scene.views) children.push_back(addCamera(view));

        // glTF requires y up.
        Json root = Json::object();
        root.add("name", "simflex").add("children", children);
        const SimTK::UnitVec3& up = m_scene.up;
        if (up[1] < 1) {
            const Vec3 axis = Vec3(up) % Vec3(0, 1, 0);
            const double angle = std::acos(std::clamp(double(up[1]), -1.0, 1.0));
            root.add("rotation",
                     toJson(SimTK::Rotation(
                         angle, axis.norm() > 1e-9 ? SimTK::UnitVec3(axis) : SimTK::XAxis)));
        }
        Json nodes = Json::object();
        nodes.add("nodes", std::vector<int>{m_file.add("nodes", std::move(root))});
        if (!m_channels.isEmpty()) {
            Json animation = Json::object();
            animation.add("name", "motion")
                .add("channels", std::move(m_channels))
                .add("samplers", std::move(m_samplers));
            m_file.add("animations", std::move(animation));
        }
        Json extras = Json::object(), asset = Json::object();
        extras.add("deformation_factor", m_scene.factor)
            .add("slow_motion", m_options.slowMotion)
            .add("largest_error_in_metres", m_error);
        asset.add("extras", std::move(extras));
        m_file.write(path, std::move(asset), nodes);
    }

private:
    int addMaterial(const Vec3& color, double opacity) {
        Json shade = Json::object(), material = Json::object();
        shade
            .add("baseColorFactor", std::vector<double>{calcLinear(color[0]), calcLinear(color[1]),
                                                        calcLinear(color[2]), opacity})
            .add("metallicFactor", 0.1)
            .add("roughnessFactor", 0.6);
        material.add("pbrMetallicRoughness", std::move(shade)).add("doubleSided", true);
        if (opacity < 1) material.add("alphaMode", "BLEND");
        return m_file.add("materials", std::move(material));
    }

    int addMesh(Json attributes, const std::vector<std::uint32_t>& triangles, int material,
                const std::vector<int>& targets, Json extras) {
        Json primitive = Json::object(), primitives = Json::list(), mesh = Json::object();
        primitive.add("attributes", std::move(attributes)).add("material", material);
        if (triangles.empty())
            primitive.add("mode", 0);  // points
        else
            primitive.add("indices", m_file.addIndices(triangles));
        if (!targets.empty()) {
            Json list = Json::list();
            for (const int target : targets) {
                Json item = Json::object();
                item.add("POSITION", target);
                list.add(std::move(item));
            }
            primitive.add("targets", std::move(list));
        }
        primitives.add(std::move(primitive));
        mesh.add("primitives", std::move(primitives));
        if (!targets.empty()) mesh.add("weights", std::vector<double>(targets.size(), 0.0));
        if (!extras.isEmpty()) mesh.add("extras", std::move(extras));
        return m_file.add("meshes", std::move(mesh));
    }

    int addRigid(const MovingScene::Body& body) {
        std::vector<int> children;
        for (const SurfaceItem& item : body.items) {
            std::vector<float> positions, normals;
            readVertices(*item.geometry, positions, normals);
            if (positions.empty()) continue;
            Json attributes = Json::object();
            attributes
                .add("POSITION",
                     m_file.addFloats(positions, "VEC3", GltfFile::Target::Vertices, true))
                .add("NORMAL", m_file.addFloats(normals, "VEC3", GltfFile::Target::Vertices));
            Json node = Json::object();
            node.add("mesh", addMesh(std::move(attributes), item.geometry->triangles,
                                     addMaterial(item.color, item.opacity), {}, Json::object()))
                .add("translation", toJson(item.X_GM.p()))
                .add("rotation", toJson(item.X_GM.R()))
                .add("scale", toJson(item.scale));
            children.push_back(m_file.add("nodes", std::move(node)));
        }
        Json node = Json::object();
        node.add("name", body.name);
        if (!children.empty()) node.add("children", children);
        return addMoved(std::move(node), body.poses);
    }

    int addFlexible(const MovingScene::Body& body) {
        const SkinModes& skin = *body.motion.front().skin;
        std::vector<std::vector<double>> coefficients;
        for (const PartSnapshot& part : body.motion)
            coefficients.push_back(calcCoefficients(part, m_scene.factor));
        const SurfaceGeometry& rest = *skin.undeformed;
        const ShapeSeries series =
            findShapes(collectFields(skin), skin.restPositions.size(), coefficients,
                       shapeTolerance * (rest.upper - rest.lower).norm());
        m_error = std::max(m_error, series.error);

        std::vector<float> positions, normals, numbers;
        readVertices(rest, positions, normals);
        for (const int point : skin.vertexPoint)
            numbers.push_back(
                point < skin.numNodes()
                    ? float(
                          skin.part->mesh.nodeNumbers[std::size_t(skin.nodes[std::size_t(point)])])
                    : -1.0f);
        Json attributes = Json::object();
        attributes
            .add("POSITION", m_file.addFloats(positions, "VEC3", GltfFile::Target::Vertices, true))
            .add("NORMAL", m_file.addFloats(normals, "VEC3", GltfFile::Target::Vertices))
            .add("_NODE", m_file.addFloats(numbers, "SCALAR", GltfFile::Target::Vertices));
        Json extras = Json::object();
        const BodyLook& look = body.motion.front().look;
        Vec3 color = look.hasColor() ? look.color : Vec3(0.66, 0.70, 0.75);
        if (body.motion.front().field) {
            attributes.add("COLOR_0", addContour(body, extras));
            color = Vec3(1);
        }
        std::vector<int> targets;
        for (const std::vector<float>& shape : series.shapes)
            targets.push_back(
                m_file.addFloats(spread3(skin, shape), "VEC3", GltfFile::Target::Vertices, true));
        Json node = Json::object();
        node.add("name", body.name)
            .add("mesh", addMesh(std::move(attributes), rest.triangles,
                                 addMaterial(color, look.opacity), targets, std::move(extras)));
        std::vector<float> weights;
        for (const std::vector<float>& w : series.weights)
            weights.insert(weights.end(), w.begin(), w.end());
        const int number = addMoved(std::move(node), body.poses);
        if (!targets.empty()) addChannel(number, "weights", weights, "SCALAR");
        return number;
    }

    /** Adds the colours of each node's largest magnitude over time. **/
    int addContour(const MovingScene::Body& body, Json& extras) {
        const SkinModes& skin = *body.motion.front().skin;
        DeformedSurface surface(body.motion.front().skin);
        ContourField::Workspace workspace;
        std::vector<float> largest(std::size_t(skin.numNodes()), 0.0f);
        for (const PartSnapshot& part : body.motion) {
            part.field->calcValues(part,
                                   part.field->isOfDisplacements()
                                       ? surface.calcDisplacements(part.xi, part.reference)
                                       : surface.calcDisplacements(part.xi),
                                   workspace);
            for (std::size_t i = 0; i < largest.size(); ++i)
                if (!(std::abs(workspace.values[i]) <= std::abs(largest[i])))
                    largest[i] = workspace.values[i];
        }
        std::vector<float> ofPoints = largest;
        ofPoints.resize(std::size_t(skin.numPoints()));
        skin.between.interpolate(largest.data(), ofPoints.data() + largest.size());
        const SimTK::Vec2& range = m_scene.range;
        const ColorMap map = m_scene.style.contour.getColorMap();
        std::vector<float> colors;
        for (const int point : skin.vertexPoint) {
            const double value = ofPoints[std::size_t(point)];
            const Vec3 color = std::isnan(value)
                                   ? Vec3(0.6)
                                   : calcColor(map, (value - range[0]) / (range[1] - range[0]));
            for (int k = 0; k < 3; ++k) colors.push_back(float(calcLinear(color[k])));
            colors.push_back(1);
        }
        extras
            .add("contour", std::string(getTraits(m_scene.style.contour.contour).name) +
                                ", largest of the motion")
            .add("range", std::vector<double>{range[0], range[1]});
        return m_file.addColors(colors);
    }

    int addLink(const MovingScene::Link& link) {
        if (m_rod < 0) {
            std::vector<float> positions, normals;
            readVertices(*m_scene.rod, positions, normals);
            Json attributes = Json::object();
            attributes
                .add("POSITION",
                     m_file.addFloats(positions, "VEC3", GltfFile::Target::Vertices, true))
                .add("NORMAL", m_file.addFloats(normals, "VEC3", GltfFile::Target::Vertices));
            m_rod = addMesh(std::move(attributes), m_scene.rod->triangles,
                            addMaterial(linkColor, 1), {}, Json::object());
        }
        std::vector<Transform> poses;
        std::vector<float> scales;
        const double radius = linkRadius * m_scene.radius;
        for (const auto& [a, b] : link) {
            const Vec3 half = 0.5 * (b - a);
            const SimTK::UnitVec3 y = half.norm() > 0 ? SimTK::UnitVec3(half) : SimTK::YAxis;
            poses.emplace_back(SimTK::Rotation(y, SimTK::YAxis, y.perp(), SimTK::XAxis),
                               0.5 * (a + b));
            for (const double scale : {radius, std::max(half.norm(), 1e-6 * radius), radius})
                scales.push_back(float(scale));
        }
        Json node = Json::object();
        node.add("name", "connector")
            .add("mesh", m_rod)
            .add("scale", std::vector<double>{scales[0], scales[1], scales[2]});
        const int number = addMoved(std::move(node), poses);
        addChannel(number, "scale", scales, "VEC3");
        return number;
    }

    int addCamera(const MovingScene::View& view) {
        const Camera& first = view.cameras.front();
        Json lens = Json::object(), camera = Json::object(), node = Json::object();
        if (first.isOrthographic)
            lens.add("xmag", 0.5 * first.viewHeight * view.aspect)
                .add("ymag", 0.5 * first.viewHeight);
        else
            lens.add("yfov", first.fieldOfView).add("aspectRatio", view.aspect);
        lens.add("znear", std::max(first.nearPlane, 1e-4 * m_scene.radius))
            .add("zfar", first.farPlane + 20 * m_scene.radius);
        const char* const type = first.isOrthographic ? "orthographic" : "perspective";
        camera.add("type", type).add(type, std::move(lens));
        node.add("name", view.name).add("camera", m_file.add("cameras", std::move(camera)));
        std::vector<Transform> poses;
        for (const Camera& moved : view.cameras) poses.push_back(moved.X_GC);
        return addMoved(std::move(node), poses);
    }

    int addMoved(Json node, const std::vector<Transform>& poses) {
        node.add("translation", toJson(poses.front().p()))
            .add("rotation", toJson(poses.front().R()));
        const int number = m_file.add("nodes", std::move(node));
        if (isSame(poses)) return number;
        std::vector<float> places, turns;
        SimTK::Vec4 q(0, 0, 0, 1);
        for (const Transform& pose : poses) {
            q = calcQuaternion(pose.R(), q);
            for (int k = 0; k < 3; ++k) places.push_back(float(pose.p()[k]));
            for (int k = 0; k < 4; ++k) turns.push_back(float(q[k]));
        }
        addChannel(number, "translation", places, "VEC3");
        addChannel(number, "rotation", turns, "VEC4");
        return number;
    }

    void addChannel(int node, const char* path, const std::vector<float>& values,
                    const char* type) {
        if (m_scene.time.size() < 2) return;
        Json sampler = Json::object(), target = Json::object(), channel = Json::object();
        sampler.add("input", m_times)
            .add("interpolation", "LINEAR")
            .add("output", m_file.addFloats(values, type, GltfFile::Target::None));
        m_samplers.add(std::move(sampler));
        target.add("node", node).add("path", path);
        channel.add("sampler", m_numSamplers++).add("target", std::move(target));
        m_channels.add(std::move(channel));
    }

    const MovingScene& m_scene;
    AnimationOptions m_options;
    GltfFile m_file;
    Json m_channels = Json::list(), m_samplers = Json::list();
    int m_times = 0, m_numSamplers = 0, m_rod = -1;
    double m_error = 0;
};

}  // namespace

namespace {

void checkMotion(int numStates, const std::string& file) {
    if (numStates == 0)
        throw std::invalid_argument("'" + file + "': there are no States to be written");
}

constexpr std::size_t mostValues = 24u
                                   << 20;  // limit for contours stored for all vertices and times

template <class T>
std::string encode(const std::vector<T>& values) {
    return encodeBase64(values.data(), values.size() * sizeof(T));
}

/** Encodes values in 16 bits, with their common factor. **/
Json describeShort(const std::vector<float>& values) {
    float largest = 0;
    for (const float value : values) largest = std::max(largest, std::abs(value));
    std::vector<std::int16_t> numbers;
    for (const float value : values)
        numbers.push_back(std::int16_t(largest > 0 ? std::lround(32767 * value / largest) : 0));
    Json shape = Json::object();
    shape.add("scale", double(largest) / 32767).add("values", encode(numbers));
    return shape;
}

/** Encodes seven numbers per time: position, quaternion (x, y, z, w). **/
std::string describePoses(const std::vector<Transform>& poses) {
    std::vector<float> numbers;
    SimTK::Vec4 q(0, 0, 0, 1);
    for (std::size_t i = 0; i < (isSame(poses) ? 1 : poses.size()); ++i) {
        q = calcQuaternion(poses[i].R(), q);
        for (int k = 0; k < 3; ++k) numbers.push_back(float(poses[i].p()[k]));
        for (int k = 0; k < 4; ++k) numbers.push_back(float(q[k]));
    }
    return encode(numbers);
}

/** Converts a MovingScene for the page of a report. **/
class PageMotion {
public:
    explicit PageMotion(const std::vector<MovingScene>& scenes)
        : m_scenes(scenes), m_first(scenes.front()) {}

    Json describe() {
        Json bodies = Json::list(), views = Json::list(), scene = Json::object();
        std::vector<double> factors;
        for (const MovingScene& one : m_scenes) factors.push_back(one.factor);
        for (std::size_t b = 0; b < m_first.bodies.size(); ++b) bodies.add(describeBody(b));
        Json links = Json::object();
        if (!m_first.links.empty()) links = describeLinks();
        for (const MovingScene::View& view : m_first.views) views.add(describe(view));
        scene.add("time", m_first.time)
            .add("factors", factors)
            .add("up", toJson(Vec3(m_first.up)))
            .add("center", toJson(m_first.center_G))
            .add("radius", m_first.radius)
            .add("ground", m_first.groundHeight)
            .add("geometries", std::move(m_geometries))
            .add("bodies", std::move(bodies))
            .add("views", std::move(views))
            .add("links", std::move(links))
            .add("contours", describeContours())
            .add("shown", getShownContour())
            .add("error", m_error);
        return scene;
    }

private:
    int addGeometry(const SurfaceGeometry& geometry) {
        std::vector<float> positions, normals;
        readVertices(geometry, positions, normals);
        Json item = Json::object();
        item.add("positions", encode(positions))
            .add("normals", encode(normals))
            .add("triangles", encode(geometry.triangles))
            .add("edges", encode(geometry.featureEdges));
        m_geometries.add(std::move(item));
        return m_numGeometries++;
    }

    Json describeBody(std::size_t number) {
        const MovingScene::Body& body = m_first.bodies[number];
        std::vector<std::string> poses;
        for (const MovingScene& scene : m_scenes)
            poses.push_back(describePoses(scene.bodies[number].poses));
        Json described = Json::object();
        described.add("name", body.name).add("poses", poses);
        if (body.isFlexible()) {
            addShapes(body, described);
            return described;
        }
        Json items = Json::list();
        for (const SurfaceItem& item : body.items) {
            auto [known, isNew] = m_known.emplace(item.geometry.get(), 0);
            if (isNew) known->second = addGeometry(*item.geometry);
            Json one = Json::object();
            one.add("geometry", known->second)
                .add("place", toJson(item.X_GM.p()))
                .add("turn", toJson(item.X_GM.R()))
                .add("scale", toJson(item.scale))
                .add("color", toJson(item.color))
                .add("opacity", item.opacity);
            items.add(std::move(one));
        }
        described.add("items", std::move(items));
        return described;
    }

    void addShapes(const MovingScene::Body& body, Json& described) {
        const SkinModes& skin = *body.motion.front().skin;
        const SurfaceGeometry& rest = *skin.undeformed;
        std::vector<std::vector<double>> xi;
        std::vector<float> references;
        for (const PartSnapshot& part : body.motion) {
            xi.push_back(calcCoefficients(part, 1));
            for (const Vec3& motion : {part.reference.shift, part.reference.turn})
                for (int k = 0; k < 3; ++k) references.push_back(float(motion[k]));
        }
        double largestFactor = 1;
        for (const MovingScene& scene : m_scenes)
            largestFactor = std::max(largestFactor, scene.factor);
        // Accurate enough for both colours and positions.
        const double largest = addDisplacements(body);
        const ShapeSeries series =
            findShapes(collectFields(skin), skin.restPositions.size(), xi,
                       std::min(shapeTolerance * (rest.upper - rest.lower).norm() / largestFactor,
                                colorTolerance * largest));
        m_error = std::max(m_error, series.error);
        Json shapes = Json::list();
        for (const std::vector<float>& shape : series.shapes)
            shapes.add(describeShort(spread3(skin, shape)));
        std::vector<float> weights;
        for (const std::vector<float>& w : series.weights)
            weights.insert(weights.end(), w.begin(), w.end());
        const BodyLook& look = body.motion.front().look;
        described.add("geometry", addGeometry(rest))
            .add("shapes", std::move(shapes))
            .add("weights", encode(weights))
            .add("references", encode(references))
            .add("color", toJson(look.hasColor() ? look.color : Vec3(0.66, 0.70, 0.75)))
            .add("opacity", look.opacity)
            .add("contoured", look.hasContour);
        addValues(body, described);
    }

    /** Includes displacements in the ranges of contours. @return the largest **/
    double addDisplacements(const MovingScene::Body& body) {
        double largest = 0;
        DeformedSurface surface(body.motion.front().skin);
        for (const PartSnapshot& part : body.motion) {
            const std::vector<float>& u = surface.calcDisplacements(part.xi, part.reference);
            for (std::size_t i = 0; i + 2 < u.size(); i += 3) {
                const Vec3 v(u[i], u[i + 1], u[i + 2]);
                largest = std::max(largest, double(v.norm()));
                for (int k = 0; k < 3; ++k)
                    m_largestOf[k] = std::max(m_largestOf[k], std::abs(v[k]));
            }
        }
        if (body.motion.front().look.hasContour) m_largest = std::max(m_largest, largest);
        return largest;
    }

    /** Adds a contour other than displacements, which cannot be computed from the shapes: 8 bits
    per value and time. **/
    void addValues(const MovingScene::Body& body, Json& described) {
        const auto& field = body.motion.front().field;
        const SkinModes& skin = *body.motion.front().skin;
        if (!field || field->isOfDisplacements()) return;
        m_numValues += body.motion.size() * skin.vertexPoint.size();
        if (m_numValues > mostValues) return;
        DeformedSurface surface(body.motion.front().skin);
        ContourField::Workspace workspace;
        std::vector<std::uint8_t> values;
        const SimTK::Vec2& range = m_first.range;
        for (const PartSnapshot& part : body.motion) {
            field->calcValues(part, surface.calcDisplacements(part.xi), workspace);
            std::vector<float> ofPoints = workspace.values;
            ofPoints.resize(std::size_t(skin.numPoints()));
            skin.between.interpolate(workspace.values.data(), ofPoints.data() + skin.numNodes());
            for (const int point : skin.vertexPoint) {
                const double value =
                    (double(ofPoints[std::size_t(point)]) - range[0]) / (range[1] - range[0]);
                // 255: no value.
                values.push_back(std::isnan(value) ? 255
                                                   : std::uint8_t(std::lround(
                                                         254 * std::clamp(value, 0.0, 1.0))));
            }
        }
        described.add("values", encode(values));
    }

    /** Encodes six numbers per time: both ends. **/
    Json describeLinks() {
        Json all = Json::list();
        for (std::size_t k = 0; k < m_first.links.size(); ++k) {
            std::vector<std::string> ofFactors;
            for (const MovingScene& scene : m_scenes) {
                std::vector<float> numbers;
                for (const auto& ends : scene.links[k])
                    for (const Vec3& end : ends)
                        for (int i = 0; i < 3; ++i) numbers.push_back(float(end[i]));
                ofFactors.push_back(encode(numbers));
            }
            all.add(Json(ofFactors));
        }
        Json links = Json::object();
        links.add("geometry", addGeometry(*m_first.rod))
            .add("radius", linkRadius * m_first.radius)
            .add("color", toJson(linkColor))
            .add("ends", std::move(all));
        return links;
    }

    static Json describe(const MovingScene::View& view) {
        std::vector<Transform> poses;
        for (const Camera& camera : view.cameras) poses.push_back(camera.X_GC);
        const Camera& camera = view.cameras.front();
        Json described = Json::object();
        described.add("name", view.name)
            .add("aspect", view.aspect)
            .add("fieldOfView", camera.isOrthographic ? 0 : camera.fieldOfView)
            .add("height", camera.viewHeight)
            .add("poses", describePoses(poses));
        return described;
    }

    const char* getShownContour() const {
        switch (m_first.style.contour.contour) {
            case Contour::None:
                return "none";
            case Contour::Displacement:
                return "norm";
            case Contour::DisplacementX:
                return "x";
            case Contour::DisplacementY:
                return "y";
            case Contour::DisplacementZ:
                return "z";
            default:
                return "values";
        }
    }

    /** Describes the selectable contours: range, unit and colours from 0 to 1. **/
    Json describeContours() const {
        Json contours = Json::list();
        const ContourSettings& settings = m_first.style.contour;
        const auto add = [&](const char* kind, Contour contour, const SimTK::Vec2& range) {
            const ContourTraits& traits = getTraits(contour);
            ContourSettings own = settings;
            own.contour = contour;
            const DisplayUnit unit =
                chooseScaledUnit(traits.unit, std::max(std::abs(range[0]), std::abs(range[1])));
            std::vector<double> colors;
            for (int i = 0; i <= 64; ++i)
                for (int k = 0; k < 3; ++k)
                    colors.push_back(std::round(255 * calcColor(own.getColorMap(), i / 64.0)[k]));
            Json item = Json::object();
            item.add("kind", kind)
                .add("name", traits.name)
                .add("range", std::vector<double>{range[0], range[1]})
                .add("unit", unit.name)
                .add("size", unit.size)
                .add("colors", colors);
            contours.add(std::move(item));
        };
        const auto addDisplacement = [&](const char* kind, Contour contour, double largest) {
            if (!(largest > 0)) return;
            Extremes values;
            values.include({getTraits(contour).isSigned ? -largest : 0, largest});
            ContourSettings own;
            own.contour = contour;
            add(kind, contour,
                settings.contour == contour ? m_first.range
                                            : calcContourRange(own, values, values));
        };
        addDisplacement("norm", Contour::Displacement, m_largest);
        addDisplacement("x", Contour::DisplacementX, m_largestOf[0]);
        addDisplacement("y", Contour::DisplacementY, m_largestOf[1]);
        addDisplacement("z", Contour::DisplacementZ, m_largestOf[2]);
        if (m_numValues > 0 && m_numValues <= mostValues)
            add("values", settings.contour, m_first.range);
        return contours;
    }

    const std::vector<MovingScene>& m_scenes;
    const MovingScene& m_first;
    Json m_geometries = Json::list();
    int m_numGeometries = 0;
    std::map<const SurfaceGeometry*, int> m_known;
    std::size_t m_numValues = 0;
    double m_largest = 0, m_error = 0;
    Vec3 m_largestOf{0};
};

}  // namespace

std::string OffscreenVisualizer::describeMotion(const MotionRecorder& motion,
                                                const std::vector<SimTK::Real>& factors) const {
    checkMotion(motion.getNumStates(), "describeMotion");
    std::vector<MovingScene> scenes;
    for (const SimTK::Real factor : factors) {
        impl->partStyle.deformationFactor = factor;
        impl->isFactorAutomatic = false;
        scenes.push_back(impl->captureScene(Impl::toMotion(motion)));
    }
    return PageMotion(scenes).describe().write(0);
}

MovingScene OffscreenVisualizer::Impl::captureScene(const Motion& motion) {
    MovingScene scene;
    scene.factor = getDeformationFactor();
    scene.style = partStyle;
    scene.up = SimTK::UnitVec3(up);
    for (const Part& part : parts) {
        if (!part.look.isVisible) continue;
        scene.bodies.emplace_back();
        scene.bodies.back().name = part.mesh.name;
    }
    const std::size_t numFlexible = scene.bodies.size();
    std::vector<int> mobods;  // the other bodies
    Extremes values;
    for (int i = 0; i < motion.numStates; ++i) {
        const FrameSnapshot shot = captureOf(motion, i);
        const State& state = motion.getState(i);
        if (i == 0) {
            mobods = captureShapes(state, scene);
            for (std::size_t v = 0; v < views.size(); ++v) {
                const std::string& caption = views[v].getCaption();
                scene.views.push_back(
                    {caption.empty() ? "camera " + std::to_string(v + 1) : caption,
                     double(shot.views[v].width) / shot.views[v].height,
                     {}});
            }
        }
        scene.time.push_back(state.getTime());
        values.include(painter.deform(shot));
        std::size_t body = 0;
        for (const PartSnapshot& part : shot.parts) {
            if (!part.look.isVisible) continue;
            scene.bodies[body].poses.push_back(part.X_GD);
            scene.bodies[body++].motion.push_back(part);
        }
        std::size_t link = 0;
        for (const DrawnConnector& connector : marks.forces.connectors) {
            if (!marks.forces.showConnectors) break;
            if (connector.kind != ConnectorKind::Spring &&
                connector.kind != ConnectorKind::Damper &&
                connector.kind != ConnectorKind::SpringDamper)
                continue;
            if (i == 0) scene.links.emplace_back();
            scene.links[link++].push_back(
                {drawn.calcPose(connector.F).p(), drawn.calcPose(connector.M).p()});
        }
        for (std::size_t k = 0; k < mobods.size(); ++k)
            scene.bodies[numFlexible + k].poses.push_back(calcBodyPose(mobods[k]));
        for (std::size_t v = 0; v < views.size(); ++v)
            scene.views[v].cameras.push_back(shot.views[v].camera);
    }
    scene.rod = shapes.getCylinder(12);
    scene.range = calcContourRange(partStyle.contour, values, values);
    scene.center_G = extent.center_G;
    scene.radius = extent.radius;
    scene.groundHeight = isGroundHeightFixed ? groundHeight : extent.lowest - 0.01 * extent.radius;
    return scene;
}

std::vector<int> OffscreenVisualizer::Impl::captureShapes(const State& state, MovingScene& scene) {
    Decorations geometry;
    for (SimTK::Stage stage = SimTK::Stage::Topology; stage <= state.getSystemStage(); ++stage)
        system.calcDecorativeGeometryAndAppend(state, stage, geometry);
    for (const SimTK::DecorativeGeometry& piece : decorations) geometry.push_back(piece);
    std::map<int, Scene> ofBodies;
    for (const SimTK::DecorativeGeometry& piece : geometry) {
        SceneBuilder builder(
            ofBodies[piece.getBodyId()], shapes, [](int) { return Transform(); },
            [](const Vec3&, double) { return 100.0; });
        addDecoration(piece, builder);
    }
    std::vector<int> mobods;
    for (auto& [body, ofBody] : ofBodies) {
        if (ofBody.surfaces.empty()) continue;
        const auto name = bodyNames.find(body);
        scene.bodies.emplace_back();
        scene.bodies.back().name = name != bodyNames.end() ? name->second
                                   : body == 0             ? "ground"
                                                           : "body " + std::to_string(body);
        scene.bodies.back().items = std::move(ofBody.surfaces);
        mobods.push_back(body);
    }
    return mobods;
}

void OffscreenVisualizer::writeAnimation(const std::string& file, const std::vector<State>& states,
                                         const AnimationOptions& options) const {
    checkMotion(int(states.size()), file);
    const MovingScene scene = impl->captureScene(Impl::toMotion(states));
    GltfMotion(scene, options).write(file);
}

void OffscreenVisualizer::writeAnimation(const std::string& file, const MotionRecorder& motion,
                                         const AnimationOptions& options) const {
    checkMotion(motion.getNumStates(), file);
    const MovingScene scene = impl->captureScene(Impl::toMotion(motion));
    GltfMotion(scene, options).write(file);
}

}  // namespace simflex
