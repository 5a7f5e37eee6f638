#pragma once
/** @file
Meshes and parts as VTK XML unstructured grids (.vtu) for ParaView and VisIt. Standard types only.

    writeVtu("crank.vtu", readReducedBody("crank.h5"));   // every mode as a vector field

    VtuFile file(mesh);                                   // a mesh with fields of one's own
    file.addPointField("displacement [m]", 3, displacements);
    file.write("crank.vtu");

Binary (appended raw, 64-bit headers, native byte order); fields have single precision, points
double. Elements keep their type and get VTK's node order; a mesh without elements is written as
points. Equal content gives equal bytes. **/

#include <array>
#include <string>
#include <utility>
#include <vector>

#include "simflex/part/Mesh.h"
#include "simflex/part/ReducedBody.h"

namespace simflex {

class VtuFile {
public:
    /** Points are the mesh's positions unless setPoints() is called. The mesh must outlive this
    object. **/
    explicit VtuFile(const Mesh& mesh) : m_mesh(mesh) {}

    /** Sets coordinates x y z of each node [m].
    @throws std::invalid_argument unless there are 3×numNodes; so do all of these for a wrong
    size. **/
    void setPoints(std::vector<double> positions);

    /** Adds a field with `components` values per node, node by node. Six components are a symmetric
    tensor in the order of ReducedBody::ModalStress (xx yy zz xy xz yz); the file gets VTK's
    order. **/
    void addPointField(const std::string& name, int components, std::vector<float> values);
    void addPointNumbers(const std::string& name, std::vector<int> values);

    /** Add numbers or texts for the whole mesh (field data). **/
    void addNumbers(const std::string& name, std::vector<double> values);
    void addTexts(const std::string& name, std::vector<std::string> values);
    /** Sets the time of the frame [s]. **/
    void setTime(double time) { addNumbers("TimeValue", {time}); }

    /** Writes the file, which appears under its name only when it is complete.
    @throws std::runtime_error naming the file if it cannot be written.
    @throws std::invalid_argument if an element refers to a node that the mesh does not have. **/
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

- "mode 01 123.4 Hz" … : displacement of each mass-normalised mode [m per unit ξ];
- "stress 01 …" and "von Mises 01 …" if the part has modal stress [Pa per unit ξ], in B; NaN at
  nodes without;
- "node number" of the deck and "interface": its index from 1, 0 for none;
- field data "frequency [Hz]", "interface names", "part" and "source".

@throws as VtuFile::write(). **/
void writeVtu(const std::string& path, const ReducedBody& part);

/** Returns the von Mises stress of a tensor xx yy zz xy xz yz. **/
double calcVonMises(const std::array<double, 6>& stress);

/** Escapes markup for XML and replaces control characters and invalid UTF-8 by '?'. **/
std::string escapeXml(const std::string& text);

}  // namespace simflex
