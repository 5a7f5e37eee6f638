/** @file
Mass properties of shapes and meshes against closed forms. **/

#include <cctype>

#include "BuiltModel.h"
#include "simflex/model/builders/MassProperties.h"

namespace simflex::test {
namespace {

using namespace SimTK;
using namespace model;
using ::testing::AllOf;
using ::testing::HasSubstr;

/** Returns the largest difference of volume, centre and second moments, each relative to the
shape's. **/
double compare(const SolidMoments& a, const SolidMoments& b) {
    const double size = std::cbrt(b.volume);
    double largest = std::abs(a.volume - b.volume) / b.volume;
    largest = std::max(largest, (a.center - b.center).norm() / size);
    return std::max(largest, (a.second - b.second).norm() / (b.volume * size * size));
}

/** A regular prism about z. **/
PolygonalMesh makePrism(int sides, double radius, double length) {
    PolygonalMesh mesh;
    Array_<int> bottom, top;
    for (int i = 0; i < sides; ++i) {
        const Vec3 p = radius * Vec3(std::cos(2 * Pi * i / sides), std::sin(2 * Pi * i / sides), 0);
        bottom.push_back(mesh.addVertex(p - Vec3(0, 0, length / 2)));
        top.push_back(mesh.addVertex(p + Vec3(0, 0, length / 2)));
    }
    for (int i = 0; i < sides; ++i) {
        const int j = (i + 1) % sides;
        const int side[] = {bottom[i], bottom[j], top[j], top[i]};
        mesh.addFace(Array_<int>(side, side + 4));
    }
    mesh.addFace(top);
    mesh.addFace(Array_<int>(bottom.rbegin(), bottom.rend()));
    return mesh;
}

TEST(MassProperties, OfABoxMeshAreThoseOfTheBoxWhereverItIs) {
    const Vec3 sides(0.3, 0.2, 0.7);
    for (const Transform& X :
         {Transform(), Transform(Rotation(1, UnitVec3(1, 2, 3)), Vec3(4, -5, 6))}) {
        PolygonalMesh mesh;
        mesh.copyAssign(PolygonalMesh::createBrickMesh(sides / 2, 3));
        mesh.transformMesh(X);
        EXPECT_LT(compare(calcMeshMoments(mesh, "box"), calcBoxMoments(sides).moved(X)),
                  2e-14 * 100);
    }
}

TEST(MassProperties, OfARegularPrismAreItsClosedForm) {
    const int n = 7;
    const double r = 0.4, length = 1.1, a = 2 * Pi / n;
    SolidMoments exact;
    exact.volume = n / 2.0 * r * r * std::sin(a) * length;
    const double inPlane = exact.volume * r * r * (2 + std::cos(a)) / 12;  // second moment of area
    exact.second = Mat33(inPlane, 0, 0, 0, inPlane, 0, 0, 0, exact.volume * length * length / 12);
    EXPECT_LT(compare(calcMeshMoments(makePrism(n, r, length), "prism"), exact), 1e-14);
}

TEST(MassProperties, OfFineMeshesTendToSphereAndCylinderWithTheSquareOfTheirEdges) {
    const auto error = [](int n) {
        return compare(calcMeshMoments(makePrism(n, 0.4, 1), "prism"),
                       calcCylinderMoments(0.4, 1, ZAxis));
    };
    EXPECT_NEAR(error(40) / error(80), 4, 0.1);
    const auto ballError = [](int resolution) {
        return compare(calcMeshMoments(PolygonalMesh::createSphereMesh(0.3, resolution), "ball"),
                       calcSphereMoments(0.3));
    };
    EXPECT_NEAR(ballError(3) / ballError(4), 4, 0.2);
}

TEST(MassProperties, OfShapesAreTheTextbooks) {
    const double m = 2;
    const auto inertiaOf = [&](const SolidMoments& moments) {
        return moments.calcMassProperties(m / moments.volume).getInertia();
    };
    const Inertia box = inertiaOf(calcBoxMoments(Vec3(1, 2, 3)));
    EXPECT_LT((box.getMoments() - m * Inertia::brick(Vec3(0.5, 1, 1.5)).getMoments()).norm(),
              1e-14);
    const Inertia ball = inertiaOf(calcSphereMoments(0.3));
    EXPECT_LT((ball.getMoments() - m * Inertia::sphere(0.3).getMoments()).norm(), 1e-15);
    const Inertia x = inertiaOf(calcCylinderMoments(0.2, 1.4, XAxis));
    EXPECT_LT((x.getMoments() - m * Inertia::cylinderAlongX(0.2, 0.7).getMoments()).norm(), 1e-15);
    const Inertia z = inertiaOf(calcCylinderMoments(0.2, 1.4, ZAxis));
    EXPECT_LT((z.getMoments() - m * Inertia::cylinderAlongZ(0.2, 0.7).getMoments()).norm(), 1e-15);
    EXPECT_LT(z.getProducts().norm(), 1e-15);
}

TEST(MassProperties, InsideOutMeshesCountAsTheSolidTheyEnclose) {
    PolygonalMesh mesh = makePrism(5, 1, 1), turned;
    for (int i = 0; i < mesh.getNumVertices(); ++i) turned.addVertex(mesh.getVertexPosition(i));
    for (int f = 0; f < mesh.getNumFaces(); ++f) {
        Array_<int> face;
        for (int k = mesh.getNumVerticesForFace(f); k-- > 0;)
            face.push_back(mesh.getFaceVertex(f, k));
        turned.addFace(face);
    }
    EXPECT_LT(compare(calcMeshMoments(turned, "turned"), calcMeshMoments(mesh, "mesh")), 1e-14);
}

TEST(MassProperties, HolesTwistedFacesAndFlatMeshesAreRefused) {
    const auto messageOf = [](const PolygonalMesh& mesh) -> std::string {
        try {
            calcMeshMoments(mesh, "part.stl");
        } catch (const std::invalid_argument& error) {
            return error.what();
        }
        return "";
    };
    PolygonalMesh whole = makePrism(4, 1, 1), open, twisted;
    for (int i = 0; i < whole.getNumVertices(); ++i) {
        open.addVertex(whole.getVertexPosition(i));
        twisted.addVertex(whole.getVertexPosition(i));
    }
    for (int f = 0; f < whole.getNumFaces(); ++f) {
        Array_<int> face;
        for (int k = 0; k < whole.getNumVerticesForFace(f); ++k)
            face.push_back(whole.getFaceVertex(f, k));
        if (f > 0) open.addFace(face);
        twisted.addFace(f > 0 ? face : Array_<int>(face.rbegin(), face.rend()));
    }
    EXPECT_EQ(messageOf(whole), "");
    EXPECT_THAT(messageOf(open), AllOf(HasSubstr("'part.stl'"), HasSubstr("hole")));
    EXPECT_THAT(messageOf(twisted), HasSubstr("oriented inconsistently"));
    EXPECT_THAT(messageOf(makePrism(4, 1, 0)), HasSubstr("no volume"));
    EXPECT_THAT(messageOf(PolygonalMesh()), HasSubstr("0 faces"));
}

TEST(MassProperties, ImpossibleInertiaIsNamed) {
    const auto messageOf = [](double mass, const Mat33& inertia) -> std::string {
        try {
            checkInertia(mass, inertia);
        } catch (const std::invalid_argument& error) {
            return error.what();
        }
        return "";
    };
    const auto diagonal = [](double x, double y, double z) {
        return Mat33(x, 0, 0, 0, y, 0, 0, 0, z);
    };
    EXPECT_EQ(messageOf(1, diagonal(1, 2, 3)), "");  // a flat one
    EXPECT_THAT(messageOf(1, diagonal(1, 2, 3.1)), HasSubstr("largest is more than"));
    EXPECT_THAT(messageOf(1, diagonal(1, -1, 1)), HasSubstr("not positive"));
    EXPECT_THAT(messageOf(1, Mat33(1, 2, 0, 2, 1, 0, 0, 0, 1)), HasSubstr("not positive"));
    EXPECT_THAT(messageOf(0, diagonal(1, 1, 1)), HasSubstr("mass is 0"));
}

using RigidShapes = BuiltModelTest;

TEST_F(RigidShapes, OfBodiesGiveTheirMassProperties) {
    // A box as a surface in millimetres, in the three kinds of file.
    const char* const corners[] = {"0 0 0",  "100 0 0",  "100 50 0",  "0 50 0",
                                   "0 0 20", "100 0 20", "100 50 20", "0 50 20"};
    const int triangles[][3] = {{0, 2, 1}, {0, 3, 2}, {4, 5, 6}, {4, 6, 7}, {0, 1, 5}, {0, 5, 4},
                                {1, 2, 6}, {1, 6, 5}, {2, 3, 7}, {2, 7, 6}, {3, 0, 4}, {3, 4, 7}};
    std::string obj, stl = "solid box\n", points, moved, polygons, ends;
    for (const char* corner : corners) {
        obj += std::string("v ") + corner + "\n";
        points += corner + std::string(" ");
        moved += std::string("1") + (corner[0] == '0' ? "00" : "") + corner + " ";
    }
    for (const auto& t : triangles) {
        stl += "facet normal 0 0 0\nouter loop\n";
        for (const int i : t) stl += std::string("vertex ") + corners[i] + "\n";
        stl += "endloop\nendfacet\n";
        obj += "f";
        for (const int i : t) {
            obj += " " + std::to_string(i + 1);
            polygons += std::to_string(i) + " ";
        }
        obj += "\n";
        ends += std::to_string(3 * (1 + int(&t - triangles))) + " ";
    }
    testing::writeText(folder / "box.obj", obj);
    testing::writeText(folder / "box.stl", stl + "endsolid box\n");
    // The same surface, split between two solids, and scaled by 1e-4.
    const size_t half = stl.find("facet", stl.size() / 2);
    std::string small = stl;
    for (size_t at = 0; (at = small.find("vertex ", at)) != std::string::npos; ++at)
        for (at += 7; small[at] != '\n'; ++at)
            if (std::isdigit(small[at]) && !std::isdigit(small[at + 1])) {
                small.insert(at + 1, "e-4");
                at += 3;
            }
    testing::writeText(folder / "halves.stl", stl.substr(0, half) + "endsolid box\nsolid rest\n" +
                                                  stl.substr(half) + "endsolid rest\n");
    testing::writeText(folder / "small.stl", small + "endsolid box\n");
    const auto makeArray = [](const std::string& attributes, const std::string& numbers) {
        return "<DataArray " + attributes + " format=\"ascii\">" + numbers + "</DataArray>\n";
    };
    const auto makePiece = [&](const std::string& places) {
        return "<Piece NumberOfPoints=\"8\" NumberOfPolys=\"12\">\n<Points>" +
               makeArray("type=\"Float64\" NumberOfComponents=\"3\"", places) + "</Points><Polys>" +
               makeArray("type=\"Int32\" Name=\"connectivity\"", polygons) +
               makeArray("type=\"Int32\" Name=\"offsets\"", ends) + "</Polys></Piece>";
    };
    const auto writeVtp = [&](const char* name, const std::string& pieces) {
        testing::writeText(folder / name,
                           "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"0.1\" "
                           "byte_order=\"LittleEndian\"><PolyData>\n" +
                               pieces + "</PolyData></VTKFile>\n");
    };
    writeVtp("box.vtp", makePiece(points));
    writeVtp("two.vtp", makePiece(points) + makePiece(moved));
    testing::writeText(folder / "open.obj", obj.substr(0, obj.rfind('f')));
    const auto model = build(R"(
bodies:
  box: {shape: {box: [0.1, 0.05, 0.02], position: [0.05, 0.025, 0.01]}, density: 1000, color: steel}
  obj: {shape: {mesh: box.obj, scale: 1e-3}, density: 1000, color: '#102030'}
  stl: {shape: {mesh: box.stl, scale: 1e-3, position: [0.05, 0.025, 0.01]}, mass: 0.1, color: [1, 0.5, 0]}
  two: {shape: [{box: [0.05, 0.05, 0.02], position: [0.025, 0.025, 0.01]}, {box: [0.05, 0.05, 0.02], position: [0.075, 0.025, 0.01]}], density: 1000}
  rod: {shape: {cylinder: [0.01, 0.2], axis: y, rotation: {axis: z, angle: 90*deg}}, density: 7800}
  ball: {shape: {sphere: 0.1}, mass: 2}
  drawn: {shape: {sphere: 0.1}, mass: 1, inertia: [1, 1, 1]}
  vtp: {shape: {mesh: box.vtp, scale: 1e-3}, density: 1000}
  pieces: {shape: {mesh: two.vtp, scale: 1e-3}, density: 1000}
  halves: {shape: {mesh: halves.stl, scale: 1e-3}, density: 1000}
  small: {shape: {mesh: small.stl, scale: 10}, density: 1000}
)");
    const State state = model->makeInitialState();
    const auto get = [&](int i) {
        return model->getBodies()[size_t(i)].mobod.getBodyMassProperties(state);
    };
    const MassProperties box = get(0);
    EXPECT_NEAR(box.getMass(), 0.1, 1e-16);
    EXPECT_LT((box.getMassCenter() - Vec3(0.05, 0.025, 0.01)).norm(), 1e-16);
    EXPECT_LT((box.calcCentralInertia().getMoments() -
               0.1 / 12 * Vec3(0.05 * 0.05 + 0.02 * 0.02, 0.1 * 0.1 + 0.02 * 0.02, 0.0125))
                  .norm(),
              1e-17);
    for (const int i : {1, 3, 7, 9, 10}) {
        EXPECT_NEAR(get(i).getMass(), 0.1, 1e-15) << i;
        EXPECT_LT((get(i).getMassCenter() - box.getMassCenter()).norm(), 1e-15) << i;
        EXPECT_LT((get(i).getInertia().toMat33() - box.getInertia().toMat33()).norm(), 1e-16) << i;
    }
    EXPECT_NEAR(get(8).getMass(), 0.2, 1e-15);
    EXPECT_LT((get(8).getMassCenter() - box.getMassCenter() - Vec3(0.5, 0, 0)).norm(), 1e-15);
    EXPECT_LT((get(2).getMassCenter() - 2 * box.getMassCenter()).norm(), 1e-15);
    EXPECT_LT(
        (get(2).calcCentralInertia().getMoments() - box.calcCentralInertia().getMoments()).norm(),
        1e-16);
    const double m = 7800 * Pi * 1e-4 * 0.2;
    EXPECT_NEAR(get(4).getMass(), m, 1e-14);
    EXPECT_LT(
        (get(4).getInertia().getMoments() - m * Inertia::cylinderAlongX(0.01, 0.1).getMoments())
            .norm(),
        1e-16);
    EXPECT_LT((get(5).getInertia().getMoments() - Vec3(2 * 0.4 * 0.01)).norm(), 1e-16);
    EXPECT_EQ(get(6).getInertia().getMoments(), Vec3(1));
    EXPECT_EQ(model->getBodies()[3].mobod.getBody().getNumDecorations(), 2);
    EXPECT_THAT(messageOf("bodies: {a: {shape: {mesh: open.obj}, density: 1}}"),
                AllOf(HasSubstr("bodies.a.shape"), HasSubstr("'open.obj' is not closed")));
    EXPECT_EQ(messageOf("bodies: {a: {shape: {mesh: open.obj}, mass: 1, inertia: [1, 1, 1]}}"), "");
    EXPECT_THAT(messageOf("bodies: {a: {shape: {mesh: none.obj}, density: 1}}"),
                HasSubstr("no file"));
    const std::string triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    std::string large = "f";
    for (int k = 0; k < 10001; ++k) large += ' ' + std::to_string(k % 3 + 1);
    const std::pair<std::string, const char*> faces[] = {
        {large + "\n", "face 1 has 10001 vertices, more than 10000: split it"},
        {"f 1 2 9\n", "face 1 names vertex 9; there are 3"},
        {"f 1 2 3\nf 0 1 2\n", "face 2 names vertex 0; there are 3"},
        {"f 1 2\n", "face 1 has 2 vertices; a face has three or more"},
        {"f 1 2 -2147483648\n", "face 1 names vertex -2147483644; there are 3"},
        {"f 1 2 3x\n", "line 4: '3x' names no vertex"}};
    for (const auto& [face, message] : faces) {
        testing::writeText(folder / "bad.obj", triangle + face);
        EXPECT_THAT(messageOf("bodies: {a: {shape: {mesh: bad.obj}, density: 1}}"),
                    AllOf(HasSubstr("bodies.a.shape.mesh: the mesh '"),
                          HasSubstr("/bad.obj' cannot be read: "), HasSubstr(message)));
    }
    // Such words overrun a buffer in Simbody's readers.
    const std::string word(5000, 'a'), facet = "facet normal 0 0 1\nouter loop\nvertex 0 0 0\n";
    const std::pair<const char*, std::string> files[] = {
        {"obj", "v 0 0 0\nv 1 0 " + word + "\n"},
        {"obj", "v 0 0 0\nv 1 0 0\nf 1 2 " + word + "\n"},
        {"stl", "solid " + word + "\n" + facet + word + " 1 1 1\n"},
        {"stl", "solid a\n" + facet + "vertex 1 1 " + word + "\n"},
        {"stl", word},
        {"vtp", "<" + word + ">"},
        {"vtp", "<VTKFile type=\"" + word + "\">"},
        {"vtp", "<VTKFile type=\"PolyData\"><Piece NumberOfPoints=\"" + word + "\">"},
        {"vtp",
         "<VTKFile type=\"PolyData\"><Piece NumberOfPoints=\"1\" NumberOfPolys=\"1\"><Points>"
         "<DataArray format=\"" +
             word + "\">"},
        {"vtp", [] {  // of many levels
             std::string xml;
             for (int k = 0; k < 300000; ++k) xml += "<a>";
             return xml;
         }()}};
    for (const auto& [ending, text] : files) {
        const std::string name = std::string("long.") + ending;
        testing::writeText(folder / name, text);
        const std::string message =
            messageOf("bodies: {a: {shape: {mesh: " + name + "}, density: 1}}");
        EXPECT_THAT(message, HasSubstr("cannot be read: "));
        EXPECT_LT(message.size(), 500u);
    }
}

}  // namespace
}  // namespace simflex::test
