#include "simflex/part/SidFile.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>

#include "simflex/base/NumberText.h"
#include "simflex/base/UnfinishedFile.h"

namespace simflex {
namespace {

/** Entries by row and column, and by row, coordinate and column; all 0-based. **/
using Order0 = std::function<double(int row, int column)>;
using Order1 = std::function<double(int row, int coordinate, int column)>;

/** Matrix structures as numbered by the format. **/
enum class Structure { Zero = 0, Diagonal = 1, General = 3, Unit = 4 };

class SidText {
public:
    SidText(int numNodes, int numModes, const std::string& comment) : m_numModes(numModes) {
        line(0, std::to_string(numNodes) + " " + std::to_string(numModes) +
                    " : No. nodes, No. modes: " + comment);
    }

    void line(int indent, const std::string& text) {
        m_text += std::string(size_t(indent), ' ') + text + "\n";
    }
    void assign(int indent, const std::string& name, const std::string& value) {
        constexpr size_t Column = 48;
        std::string left = std::string(size_t(indent), ' ') + name;
        if (left.size() < Column) left.resize(Column, ' ');
        m_text += left + "=" + value + "\n";
    }
    void assign(int indent, const std::string& name, double value) {
        std::string number = writeFortran(value, 11);
        if (number[0] != '-') number = ' ' + number;
        for (char& c : number)
            if (c == 'E') c = 'D';
        assign(indent, name, number);
    }

    /** Writes a matrix as Taylor series, of order 0 without m1. **/
    void taylor(int indent, const std::string& name, int numRows, int numColumns,
                Structure structure, const Order0& m0, const Order1& m1 = {}) {
        line(indent, name);
        const int inner = indent + 5;
        assign(inner, "order", " " + std::to_string(m1 ? 1 : 0));
        assign(inner, "nrow", " " + std::to_string(numRows));
        assign(inner, "ncol", " " + std::to_string(numColumns));
        assign(inner, "nq", " " + std::to_string(m_numModes));
        assign(inner, "nqn", " 0");
        assign(inner, "structure", " " + std::to_string(int(structure)));
        const bool hasEntries = structure == Structure::Diagonal || structure == Structure::General;
        for (int j = 0; hasEntries && j < numColumns; ++j)
            for (int i = 0; i < numRows; ++i) {
                const double value = m0(i, j);
                if (value != 0) assign(inner, "m0" + places({i, j}), value);
            }
        for (int j = 0; m1 && j < numColumns; ++j)
            for (int i = 0; i < numRows; ++i)
                for (int k = 0; k < m_numModes; ++k) {
                    const double value = m1(i, k, j);
                    if (value != 0) assign(inner, "m1" + places({i, k, j}), value);
                }
        line(indent, "end " + name);
    }

    const std::string& text() const { return m_text; }

private:
    static std::string places(std::initializer_list<int> indices) {
        std::string text;
        for (const int index : indices)
            text += (text.empty() ? "( " : ", ") + std::to_string(index + 1);
        return text + ")";
    }

    std::string m_text;
    int m_numModes;
};

/** A node: number, position in the deck, Phi and Psi (3×n_f, column stride `stride`). **/
struct SidNode {
    int number = 0;
    std::array<double, 3> position{};
    const double* Phi = nullptr;
    size_t stride = 3;
    const double* Psi = nullptr;  ///< null: no rotations
};

std::vector<SidNode> listNodes(const ReducedBody& body, ExchangeNodes which) {
    std::vector<SidNode> nodes;
    const bool withMesh = which == ExchangeNodes::All || body.interfaces.empty();
    const size_t stride = 3 * size_t(body.mesh.numNodes());
    const auto inDeck = [&](std::array<double, 3> s) {
        for (size_t a = 0; a < 3; ++a) s[a] += body.centerOfMass[a];
        return s;
    };
    for (int node = 0; withMesh && node < body.mesh.numNodes(); ++node)
        nodes.push_back({body.mesh.nodeNumbers[size_t(node)], inDeck(body.mesh.position(node)),
                         body.Phi.data() + 3 * size_t(node), stride, nullptr});
    int next = 1 + *std::max_element(body.mesh.nodeNumbers.begin(), body.mesh.nodeNumbers.end());
    for (const auto& interface : body.interfaces)
        nodes.push_back(
            {next++, inDeck(interface.position), interface.Phi.data(), 3, interface.Psi.data()});
    return nodes;
}

/** Returns entry (i, j) of the cross-product matrix of a. **/
double crossEntry(const double* a, int i, int j) {
    if (i == j) return 0;
    const int k = 3 - i - j;
    return (j == (i + 1) % 3 ? -1 : 1) * a[k];
}

}  // namespace

void writeSid(const std::string& path, const ReducedBody& body, ExchangeNodes which) {
    body.validate();
    const int n = body.numModes;
    const auto nodes = listNodes(body, which);
    std::string comment = "simflex, part " + body.name + ", m kg s; ";
    for (size_t k = 0; k < body.interfaces.size(); ++k)
        comment += "interface " + body.interfaces[k].name + " is node " +
                   std::to_string(nodes[nodes.size() - body.interfaces.size() + k].number) + "; ";
    for (char& c : comment)
        if ((unsigned char)(c) < ' ') c = ' ';
    SidText out(int(nodes.size()), n, comment);
    out.line(1, "part");
    out.assign(6, "new modal", "");
    out.line(11, "refmod");
    out.assign(16, "mass", body.mass);
    out.assign(16, "nelastq", " " + std::to_string(n));
    for (int i = 0; i < n; ++i) {
        char name[40], value[80];
        const std::string frequency =
            writeFixed(std::sqrt(body.omegaSquared[size_t(i)]) / (2 * M_PI), 3);
        std::snprintf(name, sizeof name, "ielastq (%4d)", i + 1);
        std::snprintf(value, sizeof value, " Eigen Mode %4d : %12.40s Hz", i + 1,
                      frequency.c_str());
        out.assign(16, name, std::string(value));
    }
    out.line(11, "end refmod");

    out.line(11, "frame");
    for (const SidNode& node : nodes) {
        constexpr int Indent = 21;
        const auto phi = [&](int a, int i) {
            return node.Phi[node.stride * size_t(i) + size_t(a)];
        };
        const auto psi = [&](int a, int i) { return node.Psi ? node.Psi[3 * i + a] : 0.0; };
        out.assign(16, "new node", " " + std::to_string(node.number));
        out.assign(Indent, "rframe", " body ref");
        out.taylor(
            Indent, "origin", 3, 1, Structure::General,
            [&](int a, int) { return node.position[size_t(a)]; },
            [&](int a, int i, int) { return phi(a, i); });
        out.taylor(Indent, "phi", 3, n, Structure::General, phi);
        out.taylor(Indent, "psi", 3, n, node.Psi ? Structure::General : Structure::Zero, psi);
        out.taylor(
            Indent, "AP", 3, 3, Structure::General, [](int a, int b) { return a == b ? 1.0 : 0.0; },
            [&](int a, int i, int b) {
                return node.Psi ? crossEntry(node.Psi + 3 * size_t(i), a, b) : 0.0;
            });
        out.line(16, "end node");
    }
    out.line(11, "end frame");

    const auto& c = body.centerOfMass;
    const double cc = c[0] * c[0] + c[1] * c[1] + c[2] * c[2];
    constexpr size_t TensorAxes[6][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}};
    /** Index in the components of I of each product ωₐω_b of Oe (xx yy zz xy yz xz). **/
    constexpr size_t Products[6] = {0, 1, 2, 3, 5, 4};
    const auto I1 = [&](size_t component, int i) { return body.I1[6 * size_t(i) + component]; };
    const auto at = [n](const std::vector<double>& A, int i, int j) {
        return A[size_t(i) + size_t(n) * size_t(j)];
    };
    constexpr int Indent = 11;
    out.taylor(
        Indent, "mdCM", 3, 1, Structure::General,
        [&](int a, int) { return body.mass * c[size_t(a)]; }, [](int, int, int) { return 0.0; });
    out.taylor(
        Indent, "J", 6, 1, Structure::General,
        [&](int k, int) {
            const size_t a = TensorAxes[k][0], b = TensorAxes[k][1];
            return body.inertia[size_t(k)] + body.mass * ((a == b ? cc : 0) - c[a] * c[b]);
        },
        [&](int k, int i, int) { return I1(size_t(k), i); });
    out.taylor(Indent, "Ct", n, 3, Structure::Zero, {});
    out.taylor(
        Indent, "Cr", n, 3, Structure::General, [](int, int) { return 0.0; },
        [&](int i, int j, int a) { return at(body.N[size_t(a)], j, i); });
    out.taylor(Indent, "Me", n, n, Structure::Unit, {});
    out.taylor(Indent, "Gr", 3, 3 * n, Structure::General, [&](int a, int column) {
        const int b = column % 3;
        const size_t component = a == b ? size_t(a) : a + b == 1 ? 3 : a + b == 2 ? 4 : 5;
        return I1(component, column / 3);
    });
    out.taylor(Indent, "Ge", n, 3 * n, Structure::General, [&](int i, int column) {
        return -2 * at(body.N[size_t(column % 3)], i, column / 3);
    });
    out.taylor(
        Indent, "Oe", n, 6, Structure::General,
        [&](int i, int product) { return -(product < 3 ? 0.5 : 1.0) * I1(Products[product], i); },
        [&](int i, int j, int product) {
            const size_t component = Products[product];
            const double share = product < 3 ? 1 : 2;
            const double stiffening =
                body.stiffening ? at(body.stiffening->turning[component], i, j) : 0.0;
            return share * (stiffening - at(body.I2[component], i, j));
        });
    out.taylor(Indent, "ksigma", n, 1, Structure::Zero, {});
    out.taylor(Indent, "Ke", n, n, Structure::Diagonal,
               [&](int i, int j) { return i == j ? body.omegaSquared[size_t(i)] : 0.0; });
    out.taylor(Indent, "De", n, n, Structure::Zero, {});
    out.line(6, "end modal");
    out.line(1, "end part");
    replaceFile(path, out.text());
}

}  // namespace simflex
