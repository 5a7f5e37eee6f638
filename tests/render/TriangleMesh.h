#pragma once
/** @file
A triangle in the plane z = 0, as a mesh and as mesh files. **/

#include <stdlib.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <stdexcept>
#include <string>

#include "Simbody.h"

namespace simflex {
namespace test {

/** Corners (−½, −½), (½, −½), (0, ½): area ½. **/
inline SimTK::PolygonalMesh makeTriangleMesh() {
    SimTK::PolygonalMesh mesh;
    for (const SimTK::Vec3& p :
         {SimTK::Vec3(-0.5, -0.5, 0), SimTK::Vec3(0.5, -0.5, 0), SimTK::Vec3(0, 0.5, 0)})
        mesh.addVertex(p);
    mesh.addFace(SimTK::Array_<int>{0, 1, 2});
    return mesh;
}

/** Writes the same triangle to a file, which lasts as long as the process because tests run in
parallel.
@param extension  obj, stl or vtp **/
inline std::string writeTriangleFile(const std::string& extension) {
    namespace fs = std::filesystem;
    struct Folder {
        std::string path = (fs::temp_directory_path() / "simflex-triangle-XXXXXX").string();
        Folder() {
            if (!mkdtemp(path.data())) throw std::runtime_error("no folder " + path);
        }
        ~Folder() {
            std::error_code ignored;
            fs::remove_all(path, ignored);
        }
    };
    static const Folder folder;
    static const std::map<std::string, std::string> texts = {
        {"obj", "v -0.5 -0.5 0\nv 0.5 -0.5 0\nv 0 0.5 0\nf 1 2 3\n"},
        {"stl",
         "solid t\nfacet normal 0 0 1\nouter loop\nvertex -0.5 -0.5 0\nvertex 0.5 -0.5 0\n"
         "vertex 0 0.5 0\nendloop\nendfacet\nendsolid t\n"},
        {"vtp",
         "<?xml version=\"1.0\"?><VTKFile type=\"PolyData\" version=\"0.1\"><PolyData>"
         "<Piece NumberOfPoints=\"3\" NumberOfVerts=\"0\" NumberOfLines=\"0\" "
         "NumberOfStrips=\"0\" NumberOfPolys=\"1\"><Points><DataArray type=\"Float32\" "
         "NumberOfComponents=\"3\" format=\"ascii\">-0.5 -0.5 0 0.5 -0.5 0 0 0.5 0"
         "</DataArray></Points><Polys><DataArray type=\"Int32\" Name=\"connectivity\" "
         "format=\"ascii\">0 1 2</DataArray><DataArray type=\"Int32\" Name=\"offsets\" "
         "format=\"ascii\">3</DataArray></Polys></Piece></PolyData></VTKFile>\n"}};
    const std::string path = folder.path + "/triangle." + extension;
    std::ofstream(path) << texts.at(extension);
    return path;
}

}  // namespace test
}  // namespace simflex
