#pragma once
/** @file
Meshes and parts as VTK XML unstructured grids (.vtu), which ParaView and VisIt open. Standard types
only.

    writeVtu("crank.vtu", readReducedBody("crank.h5"));   // every mode as a vector field

    VtuFile file(mesh);                                   // a mesh with fields of one's own
    file.addPointField("displacement [m]", 3, displacements);
    file.write("crank.vtu");

Binary (appended raw, 64-bit headers, the machine's byte order); fields have single precision,
points double. Elements keep their type and get VTK's node order; a mesh without elements is written
as points. The same content gives the same bytes. **/

#include <array>
#include <string>
#include <utility>
#include <vector>

#include "simflex/part/Mesh.h"
#include "simflex/part/ReducedBody.h"

namespace simflex {

class VtuFile {
public:
    /** Points are the mesh's positions until setPoints() is called. The mesh must outlive this. **/
    explicit VtuFile(const Mesh& mesh) : m_mesh(mesh) {}

    /** Coordinates x y z of each node [m].
    @throws std::invalid_argument if there are not 3×numNodes, as all of these for a wrong size. **/
    void setPoints(std::vector<double> positions);

    /** A field with `components` numbers a node, node by node. Six components are a symmetric
    tensor in the order of ReducedBody::ModalStress (xx yy zz xy xz yz); the file gets VTK's. **/
    void addPointField(const std::string& name, int components, std::vector<float> values);
    /** A whole number for each node. **/
    void addPointNumbers(const std::string& name, std::vector<int> values);

    /** Numbers and texts that belong to the whole mesh (field data). **/
    void addNumbers(const std::string& name, std::vector<double> values);
    void addTexts(const std::string& name, std::vector<std::string> values);
    /** Time of the frame [s]. **/
    void setTime(double time) { addNumbers("TimeValue", {time}); }

    /** The file appears under its name only when it is complete.
    @throws std::runtime_error that names the file if it cannot be written.
    @throws std::invalid_argument if an element names a node that the mesh does not have. **/
    void write(const std::string& path) const;

private:
    template <class Number>
    struct Array {
        std::string name;
        int components;
        std::vector<Number> values;
    };

    void checkSize(const std::string& what, size_t found, size_t perNode) const;

    const Mesh& m_mesh;
    std::vector<double> m_points;
    std::vector<Array<float>> m_fields;
    std::vector<Array<int>> m_indices;
    std::vector<Array<double>> m_numbers;
    std::vector<std::pair<std::string, std::vector<std::string>>> m_texts;
};

/** Writes the undeformed part in deck coordinates, with
- "mode 01 123.4 Hz" … : displacement of each mode [m per unit ξ], modes being mass-normalised;
- "stress 01 …" and "von Mises 01 …" if the part has modal stress [Pa per unit ξ], in B; NaN at
nodes without;
- "node number" of the deck and "interface": 0 for none, else its place in the list from 1;
- field data "frequency [Hz]", "interface names", "part" and "source".
@throws as VtuFile::write(). **/
void writeVtu(const std::string& path, const ReducedBody& part);

/** Von Mises stress of a tensor xx yy zz xy xz yz. **/
double calcVonMises(const std::array<double, 6>& stress);

/** Text for XML: markup escaped; control characters, and bytes that are not UTF-8, replaced by '?'.
 * **/
std::string escapeXml(const std::string& text);

}  // namespace simflex
