#include "simflex/model/builders/RigidBodies.h"

#include <cmath>
#include <filesystem>
#include <map>
#include <optional>

#include "simflex/base/InputFile.h"
#include "simflex/body/SurfaceFile.h"
#include "simflex/model/builders/MassProperties.h"
#include "simflex/model/builders/ModelGeometry.h"
#include "simflex/model/builders/ModelSystem.h"
#include "simflex/model/file/ModelTexts.h"

namespace simflex {
namespace model {

using namespace SimTK;

namespace {

const std::map<std::string, Vec3> NamedColors = {
    {"steel", Vec3(0.62, 0.66, 0.71)},  {"aluminium", Vec3(0.80, 0.82, 0.84)},
    {"brass", Vec3(0.80, 0.68, 0.36)},  {"copper", Vec3(0.76, 0.48, 0.33)},
    {"black", Vec3(0.10, 0.10, 0.11)},  {"gray", Vec3(0.50, 0.50, 0.50)},
    {"white", Vec3(0.95, 0.95, 0.95)},  {"red", Vec3(0.80, 0.18, 0.16)},
    {"orange", Vec3(0.93, 0.55, 0.15)}, {"yellow", Vec3(0.95, 0.82, 0.22)},
    {"green", Vec3(0.26, 0.63, 0.28)},  {"blue", Vec3(0.16, 0.42, 0.75)},
    {"purple", Vec3(0.50, 0.26, 0.62)}, {"cyan", Vec3(0.15, 0.68, 0.72)},
};

struct Shape {
    std::optional<SolidMoments> moments;  ///< for a mesh, computed only on request
    PolygonalMesh mesh;
    std::string meshName;
    std::shared_ptr<DecorativeGeometry> drawing;
    Transform X_BS;
    ModelValue value;

    SolidMoments calcMoments() const {
        return moments ? *moments
                       : withPlace(value, [&] { return calcMeshMoments(mesh, meshName); });
    }
};

constexpr double FarthestVertex = 1e30;  // products of five such lengths do not overflow

PolygonalMesh readMesh(const ModelValue& file, double scale) {
    const std::string path = file.getFilePath();
    if (!isInputFile(path)) failMissingFile(file);
    PolygonalMesh mesh;
    try {
        mesh = readSurface(path);
    } catch (const std::runtime_error& error) {
        file.fail("the mesh '" + path + "' cannot be read: " + error.what());
    }
    for (int vertex = 0; vertex < mesh.getNumVertices(); ++vertex)
        if (!(mesh.getVertexPosition(vertex).norm() < FarthestVertex))
            file.fail("vertex " + std::to_string(vertex + 1) + " of '" + path +
                      "' is not at a finite place");
    return mesh.scaleMesh(scale);
}

Shape readShape(const ModelValue& value) {
    Shape shape{{}, {}, {}, {}, readPose(value), value};
    if (value.has("box")) {
        const Vec3 sides = value.get("box").getVec3();
        shape.moments = calcBoxMoments(sides);
        shape.drawing = std::make_shared<DecorativeBrick>(sides / 2);
    } else if (value.has("sphere")) {
        const double radius = value.get("sphere").getNumber();
        shape.moments = calcSphereMoments(radius);
        shape.drawing = std::make_shared<DecorativeSphere>(radius);
        shape.drawing->setResolution(3);
    } else if (value.has("cylinder")) {
        const ModelValue size = value.get("cylinder");
        const double radius = size.at(0).getNumber(), length = size.at(1).getNumber();
        const CoordinateAxis axis = readAxis(value.get("axis"));
        shape.moments = calcCylinderMoments(radius, length, axis);
        shape.drawing = std::make_shared<DecorativeCylinder>(radius, length / 2);  // along y
        shape.drawing->setResolution(3);
        if (axis == XAxis) shape.drawing->setTransform(Rotation(-Pi / 2, ZAxis));
        if (axis == ZAxis) shape.drawing->setTransform(Rotation(Pi / 2, XAxis));
    } else {
        const ModelValue file = value.get("mesh");
        shape.mesh = readMesh(file, value.get("scale").getNumber());
        shape.meshName = std::filesystem::path(file.getText()).filename().string();
        shape.drawing = std::make_shared<DecorativeMesh>(shape.mesh);
    }
    return shape;
}

Mat33 readInertia(const ModelValue& value) {
    const std::vector<double> I = value.getNumbers();
    Mat33 inertia(0);
    for (int a = 0; a < 3; ++a) inertia(a, a) = I[size_t(a)];
    if (I.size() == 6) {
        inertia(0, 1) = inertia(1, 0) = I[3];
        inertia(0, 2) = inertia(2, 0) = I[4];
        inertia(1, 2) = inertia(2, 1) = I[5];
    }
    return inertia;
}

MassProperties makeMassProperties(const ModelValue& value, const std::vector<Shape>& shapes) {
    const ModelValue mass = value.get("mass"), inertia = value.get("inertia");
    const bool hasMass = value.has("mass");
    if (value.has("inertia")) {
        const Mat33 I = readInertia(inertia);
        const double m = mass.getNumber();
        withPlace(inertia, [&] { checkInertia(m, I); });
        const Vec3 c = readVec3(value.get("center_of_mass"));
        const Inertia central(Vec3(I(0, 0), I(1, 1), I(2, 2)), Vec3(I(1, 0), I(2, 0), I(2, 1)));
        return MassProperties(m, c, central.shiftFromMassCenter(c, m));
    }
    if (!hasMass && !value.has("density"))
        value.fail(
            "a rigid body needs mass and inertia, or a shape with density or mass (or "
            "`part`, for a flexible one)");
    if (shapes.empty()) mass.fail("the body needs its inertia as well, or a shape to take it from");
    SolidMoments moments;
    for (const Shape& shape : shapes) moments += shape.calcMoments().moved(shape.X_BS);
    const double rho =
        hasMass ? mass.getNumber() / moments.volume : value.get("density").getNumber();
    return moments.calcMassProperties(rho);
}

}  // namespace

std::vector<std::string> listColors() {
    std::vector<std::string> names;
    for (const auto& color : NamedColors) names.push_back(color.first);
    return names;
}

Vec3 readColor(const ModelValue& value) {
    if (!value.isScalar()) return value.getVec3();
    const std::string text = value.getText();
    const auto found = NamedColors.find(text);
    if (found != NamedColors.end()) return found->second;
    if (text.empty() || text[0] != '#') value.failUnknown("colour", text, listColors());
    if (text.size() != 7 || text.find_first_not_of("0123456789abcdefABCDEF", 1) != text.npos)
        value.fail("'" + text + "' is not a color: write '#rrggbb' with hexadecimal digits");
    const unsigned rgb = unsigned(std::stoul(text.substr(1), nullptr, 16));
    return Vec3(rgb >> 16, rgb >> 8 & 255, rgb & 255) / 255;
}

Body::Rigid makeRigidBody(const ModelValue& value) {
    std::vector<Shape> shapes;
    if (value.has("shape")) {
        const ModelValue given = value.get("shape");
        if (given.isMap()) shapes.push_back(readShape(given));
        for (int i = 0; given.isList() && i < given.getSize(); ++i)
            shapes.push_back(readShape(given.at(i)));
    }
    Body::Rigid body(makeMassProperties(value, shapes));
    const Vec3 color = value.has("color") ? readColor(value.get("color")) : Vec3(-1);
    for (const Shape& shape : shapes) {
        if (color[0] >= 0) shape.drawing->setColor(color);
        body.addDecoration(shape.X_BS, *shape.drawing);
    }
    return body;
}

}  // namespace model
}  // namespace simflex
