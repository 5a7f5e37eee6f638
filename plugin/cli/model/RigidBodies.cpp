#include "simflex/cli/model/RigidBodies.h"

#include <cmath>
#include <filesystem>
#include <map>
#include <optional>

#include "simflex/cli/model/MassProperties.h"
#include "simflex/cli/model/ModelGeometry.h"
#include "simflex/cli/model/ModelSystem.h"
#include "simflex/cli/model/ModelTexts.h"

namespace simflex {
namespace cli {

using namespace SimTK;

namespace {

const std::map<std::string, Vec3> kColors = {
    {"steel", Vec3(0.62, 0.66, 0.71)},  {"aluminium", Vec3(0.80, 0.82, 0.84)},
    {"brass", Vec3(0.80, 0.68, 0.36)},  {"copper", Vec3(0.76, 0.48, 0.33)},
    {"black", Vec3(0.10, 0.10, 0.11)},  {"gray", Vec3(0.50, 0.50, 0.50)},
    {"white", Vec3(0.95, 0.95, 0.95)},  {"red", Vec3(0.80, 0.18, 0.16)},
    {"orange", Vec3(0.93, 0.55, 0.15)}, {"yellow", Vec3(0.95, 0.82, 0.22)},
    {"green", Vec3(0.26, 0.63, 0.28)},  {"blue", Vec3(0.16, 0.42, 0.75)},
    {"purple", Vec3(0.50, 0.26, 0.62)}, {"cyan", Vec3(0.15, 0.68, 0.72)},
};

/** A shape, at its place in the body. **/
struct Shape {
    std::optional<SolidMoments> moments;  ///< missing: of a mesh, until they are asked for
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

double readPositive(const ModelValue& value) {
    const double number = value.getNumber();
    if (!(number > 0)) value.fail("it is " + std::to_string(number) + "; it must be more than 0");
    return number;
}

PolygonalMesh readMesh(const ModelValue& file, double scale) {
    const std::string path = file.getFilePath();
    if (!std::filesystem::is_regular_file(path)) failMissingFile(file);
    std::string ending = std::filesystem::path(path).extension().string();
    for (char& c : ending) c = char(std::tolower((unsigned char)(c)));
    if (ending != ".stl" && ending != ".obj" && ending != ".vtp")
        file.fail("a mesh is a file .stl, .obj or .vtp");
    PolygonalMesh mesh;
    try {
        mesh.loadFile(path);
    } catch (const std::exception& error) {
        file.fail("the mesh '" + path + "' cannot be read: " + error.what());
    }
    if (mesh.getNumFaces() == 0) file.fail("there are no faces in '" + path + "'");
    return mesh.scaleMesh(scale);
}

Shape readShape(const ModelValue& value) {
    Shape shape{{}, {}, {}, {}, readPose(value), value};
    std::string kinds;
    for (const char* kind : {"box", "sphere", "cylinder", "mesh"})
        if (value.has(kind)) kinds += kinds.empty() ? kind : std::string(" and ") + kind;
    if (kinds.empty()) value.fail("say which: box, sphere, cylinder or mesh");
    if (kinds.find(' ') != std::string::npos) value.fail("it is " + kinds + "; give one of them");
    if (value.has("axis") && kinds != "cylinder") value.get("axis").fail("only of a cylinder");
    if (value.has("scale") && kinds != "mesh") value.get("scale").fail("only of a mesh");
    const ModelValue size = value.get(kinds);
    if (kinds == "box") {
        const Vec3 sides = size.getVec3();
        for (int a = 0; a < 3; ++a)
            if (!(sides[a] > 0)) size.fail("the sides of a box must be more than 0");
        shape.moments = calcBoxMoments(sides);
        shape.drawing = std::make_shared<DecorativeBrick>(sides / 2);
    } else if (kinds == "sphere") {
        const double radius = readPositive(size);
        shape.moments = calcSphereMoments(radius);
        shape.drawing = std::make_shared<DecorativeSphere>(radius);
        shape.drawing->setResolution(3);
    } else if (kinds == "cylinder") {
        if (size.getSize() != 2) size.fail("a cylinder is [radius, length]");
        const double radius = readPositive(size.at(0)), length = readPositive(size.at(1));
        const CoordinateAxis axis =
            value.has("axis") ? readAxis(value.get("axis")) : CoordinateAxis(ZAxis);
        shape.moments = calcCylinderMoments(radius, length, axis);
        shape.drawing = std::make_shared<DecorativeCylinder>(radius, length / 2);  // along y
        shape.drawing->setResolution(3);
        if (axis == XAxis) shape.drawing->setTransform(Rotation(-Pi / 2, ZAxis));
        if (axis == ZAxis) shape.drawing->setTransform(Rotation(Pi / 2, XAxis));
    } else {
        shape.mesh = readMesh(size, value.has("scale") ? readPositive(value.get("scale")) : 1);
        shape.meshName = std::filesystem::path(size.getText()).filename().string();
        shape.drawing = std::make_shared<DecorativeMesh>(shape.mesh);
    }
    return shape;
}

Mat33 readInertia(const ModelValue& value) {
    const std::vector<double> I = value.getNumbers();
    if (I.size() != 3 && I.size() != 6)
        value.fail("an inertia is [Ixx, Iyy, Izz] or [Ixx, Iyy, Izz, Ixy, Ixz, Iyz]; there are " +
                   std::to_string(I.size()) + " numbers");
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
    const ModelValue mass = value.get("mass"), density = value.get("density"),
                     inertia = value.get("inertia"), center = value.get("center_of_mass");
    const bool hasMass = value.has("mass"), hasInertia = value.has("inertia");
    if (hasMass && mass.getNumber() <= 0)
        mass.fail("the mass is " + mass.getText() + "; it must be more than 0 kg");
    if (hasInertia) {
        if (!hasMass) inertia.fail("the body needs its mass as well");
        if (value.has("density"))
            density.fail("mass and inertia are given: leave either them or the density out");
        const Mat33 I = readInertia(inertia);
        const double m = mass.getNumber();
        withPlace(inertia, [&] { checkInertia(m, I); });
        const Vec3 c = readVec3(center);
        const Inertia central(Vec3(I(0, 0), I(1, 1), I(2, 2)), Vec3(I(1, 0), I(2, 0), I(2, 1)));
        return MassProperties(m, c, central.shiftFromMassCenter(c, m));
    }
    if (value.has("center_of_mass"))
        center.fail("it goes with mass and inertia; that of a shape follows from its position");
    if (hasMass && value.has("density")) density.fail("the mass is given: leave one of both out");
    if (!hasMass && !value.has("density"))
        value.fail(
            "a rigid body needs mass and inertia, or a shape with density or mass (or "
            "`part`, for a flexible one)");
    if (shapes.empty())
        (hasMass ? mass : density)
            .fail(hasMass ? "the body needs its inertia as well, or a shape to take it from"
                          : "a density needs a shape");
    SolidMoments moments;
    for (const Shape& shape : shapes) moments += shape.calcMoments().moved(shape.X_BS);
    const double rho = hasMass ? mass.getNumber() / moments.volume : readPositive(density);
    return moments.calcMassProperties(rho);
}

}  // namespace

std::vector<std::string> listColors() {
    std::vector<std::string> names;
    for (const auto& color : kColors) names.push_back(color.first);
    return names;
}

Vec3 readColor(const ModelValue& value) {
    if (!value.isScalar()) {
        const Vec3 color = value.getVec3();
        for (int a = 0; a < 3; ++a)
            if (!(color[a] >= 0 && color[a] <= 1))
                value.fail("red, green and blue are from 0 to 1");
        return color;
    }
    const std::string text = value.getText();
    const auto found = kColors.find(text);
    if (found != kColors.end()) return found->second;
    if (text.empty() || text[0] != '#') value.failUnknown("colour", text, listColors());
    if (text.size() != 7 || text.find_first_not_of("0123456789abcdefABCDEF", 1) != text.npos)
        value.fail("'" + text + "' is no colour: write '#rrggbb' with hexadecimal digits");
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

}  // namespace cli
}  // namespace simflex
