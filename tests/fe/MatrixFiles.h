#pragma once
/** @file
The matrices of a model in the text formats of other programs. **/

#include <algorithm>
#include <cstdio>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "simflex/fe/FeModel.h"

namespace simflex {
namespace testing {

class MatrixText {
public:
    explicit MatrixText(const FeModel& model) : _mesh(model.mesh) {
        for (int node = 0; node < _mesh.numNodes(); ++node) _nodes.push_back(node);
        for (int dof = 0; dof < 3 * _mesh.numNodes(); ++dof) _rowOf.push_back(dof);
    }

    /** Shuffles the nodes in their table, and the rows with them. **/
    void shuffleNodes(unsigned seed) {
        std::shuffle(_nodes.begin(), _nodes.end(), std::mt19937(seed));
        for (size_t k = 0; k < _nodes.size(); ++k)
            for (size_t a = 0; a < 3; ++a) _rowOf[3 * size_t(_nodes[k]) + a] = int(3 * k + a);
    }
    /** Shuffles all rows. **/
    void shuffleDofs(unsigned seed) {
        std::shuffle(_rowOf.begin(), _rowOf.end(), std::mt19937(seed));
    }

    std::string nodes() const {
        std::string text = "number, x, y, z\n";
        for (const int node : _nodes) text += nodeLine("%d, %.17g, %.17g, %.17g\n", node);
        return text;
    }
    std::string dofs() const {
        std::vector<std::string> lines(_rowOf.size());
        for (size_t dof = 0; dof < _rowOf.size(); ++dof)
            lines[size_t(_rowOf[dof])] =
                std::to_string(number(int(dof / 3))) + "." + std::to_string(dof % 3 + 1) + "\n";
        std::string text;
        for (const auto& line : lines) text += line;
        return text;
    }

    std::string market(const SymmetricMatrix& A, int copies) const {
        std::string text;
        long count = 0;
        forEach(A, copies, [&](int row, int column, double value) {
            const int i = _rowOf[size_t(row)], j = _rowOf[size_t(column)];
            text += line("%d %d %.17g\n", std::max(i, j) + 1, std::min(i, j) + 1, value);
            ++count;
        });
        return header("symmetric", A.size * copies, count) + text;
    }
    std::string marketGeneral(const SymmetricMatrix& A, int copies = 1) const {
        std::string text;
        long count = 0;
        forEach(A, copies, [&](int row, int column, double value) {
            const int i = _rowOf[size_t(row)] + 1, j = _rowOf[size_t(column)] + 1;
            text += line("%d %d %.17g\n", i, j, value);
            if (i != j) text += line("%d %d %.17g\n", j, i, value);
            count += i == j ? 1 : 2;
        });
        return header("general", A.size * copies, count) + text;
    }

    /** Returns node and direction, lower triangle, comma-separated. **/
    std::string abaqus(const SymmetricMatrix& A, int copies) const {
        std::ostringstream text;
        char value[40];
        forEach(A, copies, [&](int row, int column, double entry) {
            std::snprintf(value, sizeof value, "%.16e", entry);
            text << number(row / 3) << "," << row % 3 + 1 << ", " << number(column / 3) << ","
                 << column % 3 + 1 << ", " << value << "\n";
        });
        return text.str();
    }
    /** Returns row, column, value; both triangles, separated by blanks. **/
    std::string coordinate(const SymmetricMatrix& A, int copies) const {
        std::string text;
        forEach(A, copies, [&](int row, int column, double value) {
            text += line("  %d   %d  %.16e\n", row + 1, column + 1, value);
            if (row != column) text += line("  %d   %d  %.16e\n", column + 1, row + 1, value);
        });
        return text;
    }
    /** Returns nodes, elements and sets with Abaqus-only cards. **/
    std::string abaqusDeck() const {
        std::string text = "*HEADING\n brick\n*PREPRINT, ECHO=NO\n*NODE\n";
        for (const int node : _nodes) text += nodeLine("%d, %.17g, %.17g, %.17g\n", node);
        text += "*ELEMENT, TYPE=C3D8R\n";
        const auto& elements = _mesh.elements[0];
        for (int e = 0; e < elements.numElements(); ++e) {
            text += std::to_string(e + 1);
            for (int k = 0; k < 8; ++k)
                text += ", " + std::to_string(number(elements.nodes[size_t(8 * e + k)]));
            text += "\n";
        }
        for (const auto& [name, members] : _mesh.nodeSets) {
            text += "*NSET, NSET=" + name + "\n";
            for (const int node : members) text += std::to_string(number(node)) + ",\n";
        }
        return text +
               "*CONNECTOR BEHAVIOR, NAME=C\n*STEP\n*MATRIX GENERATE, STIFFNESS\n*END STEP\n";
    }

    std::string gridsFree() const {
        std::string text = "$ grids\nBEGIN BULK\nGRDSET,,0,,,,0\n";
        for (const int node : _nodes) text += nodeLine("GRID,%d,,%.17g,%.17g,%.17g,0\n", node);
        return text + "ENDDATA\n";
    }
    std::string dmigFree(const std::string& name, const SymmetricMatrix& A, int copies) const {
        std::ostringstream text;
        text << "DMIG," << name << ",0,6,2,0\n";
        forEachColumn(A, copies, [&](int column, const auto& entries) {
            text << "DMIG," << name << "," << number(column / 3) << "," << column % 3 + 1 << ",";
            bool first = true;
            for (const auto& [row, value] : entries) {
                char field[40];
                std::snprintf(field, sizeof field, "%.17g", value);
                text << (first ? "," : "+,") << number(row / 3) << "," << row % 3 + 1 << ","
                     << field << ",\n";
                first = false;
            }
        });
        return text.str();
    }
    std::string dmigLarge(const std::string& name, const SymmetricMatrix& A, int copies) const {
        char text[200];
        std::snprintf(text, sizeof text, "DMIG    %-8s%8d%8d%8d%8d\n", name.c_str(), 0, 6, 2, 0);
        std::string result = text;
        forEachColumn(A, copies, [&](int column, const auto& entries) {
            std::snprintf(text, sizeof text, "DMIG*   %-16s%16d%16d\n", name.c_str(),
                          number(column / 3), column % 3 + 1);
            result += text;
            for (const auto& [row, value] : entries) {
                char field[40];
                std::snprintf(field, sizeof field, "%16.9E", value);
                std::string nastran = field;
                nastran[nastran.find('E')] = 'D';
                std::snprintf(text, sizeof text, "*       %16d%16d%s\n", number(row / 3),
                              row % 3 + 1, nastran.c_str());
                result += text;
            }
        });
        return result;
    }

private:
    int number(int node) const { return _mesh.nodeNumbers[size_t(node)]; }

    std::string nodeLine(const char* format, int node) const {
        const auto x = _mesh.position(node);
        char text[200];
        std::snprintf(text, sizeof text, format, number(node), x[0], x[1], x[2]);
        return text;
    }
    static std::string line(const char* format, int i, int j, double value) {
        char text[100];
        std::snprintf(text, sizeof text, format, i, j, value);
        return text;
    }
    static std::string header(const char* form, int size, long count) {
        std::ostringstream text;
        text << "%%MatrixMarket matrix coordinate real " << form << "\n"
             << size << " " << size << " " << count << "\n";
        return text.str();
    }
    /** Visits the entries of the lower triangle of A ⊗ 1 (copies 1 or 3), in DOF numbers. **/
    template <class Visit>
    static void forEach(const SymmetricMatrix& A, int copies, Visit visit) {
        for (int column = 0; column < A.size; ++column)
            for (int a = 0; a < copies; ++a)
                for (auto k = A.columnStarts[size_t(column)];
                     k < A.columnStarts[size_t(column) + 1]; ++k)
                    visit(copies * A.rows[size_t(k)] + a, copies * column + a, A.values[size_t(k)]);
    }
    template <class Visit>
    static void forEachColumn(const SymmetricMatrix& A, int copies, Visit visit) {
        for (int column = 0; column < A.size; ++column)
            for (int a = 0; a < copies; ++a) {
                std::vector<std::pair<int, double>> entries;
                for (auto k = A.columnStarts[size_t(column)];
                     k < A.columnStarts[size_t(column) + 1]; ++k)
                    entries.emplace_back(copies * A.rows[size_t(k)] + a, A.values[size_t(k)]);
                visit(copies * column + a, entries);
            }
    }

    const Mesh& _mesh;
    std::vector<int> _nodes;  ///< in the order of their table
    std::vector<int> _rowOf;  ///< of each degree of freedom
};

}  // namespace testing
}  // namespace simflex
