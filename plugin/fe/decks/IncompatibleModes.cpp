#include "IncompatibleModes.h"

#include <algorithm>
#include <array>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace simflex {
namespace {

constexpr size_t NumCorners = 8, NumModes = 3;

/** Bᵀ A B of x = B y: x_j = y_j − ⅛ Σ y_corners of internal nodes, x = y of all others.
@param cornersOf  of the internal nodes, which are the last
@param width      entries of a node: 3 of K, 1 of m **/
SymmetricMatrix congruence(const SymmetricMatrix& A, const std::vector<std::vector<int>>& cornersOf,
                           int width) {
    const int firstInternal = A.size / width - int(cornersOf.size());
    using Row = std::vector<std::pair<int, double>>;
    const auto rowOf = [&](int dof) {
        Row row{{dof, 1.0}};
        const int internal = dof / width - firstInternal;
        if (internal >= 0)
            for (const int corner : cornersOf[size_t(internal)])
                row.emplace_back(corner * width + dof % width, -1.0 / NumCorners);
        return row;
    };
    std::vector<std::int32_t> rows, columns;
    std::vector<double> values;
    const auto add = [&](int i, int j, double value) {
        rows.push_back(i);
        columns.push_back(j);
        values.push_back(value);
    };
    for (int column = 0; column < A.size; ++column) {
        const Row right = rowOf(column);
        for (auto k = A.columnStarts[size_t(column)]; k < A.columnStarts[size_t(column) + 1]; ++k) {
            const int row = A.rows[size_t(k)];
            const Row left = rowOf(row);
            for (const auto& [i, a] : left)
                for (const auto& [j, b] : right) {
                    const double value = A.values[size_t(k)] * a * b;
                    if (row == column) {
                        if (i >= j) add(i, j, value);
                    } else {
                        add(i, j, i == j ? 2 * value : value);
                    }
                }
        }
    }
    return SymmetricMatrix::fromEntries(A.size, rows, columns, values);
}

const std::vector<DeckModel::Solid>* findSolids(const DeckModel& deck) {
    const auto found = deck.solids.find(IncompatibleSolid);
    return found == deck.solids.end() ? nullptr : &found->second;
}

}  // namespace

void addInternalNodes(DeckModel& deck) {
    const auto* solids = findSolids(deck);
    if (!solids) return;
    Mesh& mesh = deck.mesh;
    std::int64_t next = std::int64_t(mesh.nodeNumbers.back()) + 1;
    if (next + std::int64_t(NumModes * solids->size()) > std::numeric_limits<int>::max())
        throw std::invalid_argument(
            "CalculiX numbers the internal nodes of C3D8I behind those of the deck, and there are "
            "no "
            "numbers left behind " +
            std::to_string(mesh.nodeNumbers.back()) + "; renumber the nodes");
    mesh.numInternalNodes = int(NumModes * solids->size());
    for (int k = 0; k < mesh.numInternalNodes; ++k) mesh.nodeNumbers.push_back(int(next++));
    mesh.positions.resize(3 * mesh.nodeNumbers.size());
}

void placeInternalNodes(DeckModel& deck) {
    const auto* solids = findSolids(deck);
    if (!solids) return;
    Mesh& mesh = deck.mesh;
    auto to = mesh.positions.end() - std::ptrdiff_t(3 * NumModes * solids->size());
    for (const DeckModel::Solid& solid : *solids) {
        std::array<double, 3> center{};
        for (const int number : solid.nodes) {
            const auto x = mesh.position(mesh.indexOf(number));
            for (size_t a = 0; a < 3; ++a) center[a] += x[a] / NumCorners;
        }
        for (size_t mode = 0; mode < NumModes; ++mode)
            to = std::copy(center.begin(), center.end(), to);
    }
}

void turnToInternalNodes(const DeckModel& deck, FeModel& model) {
    const auto* solids = findSolids(deck);
    if (!solids) return;
    std::vector<std::vector<int>> cornersOf;
    for (const DeckModel::Solid& solid : *solids) {
        std::vector<int> corners;
        for (const int number : solid.nodes) corners.push_back(deck.mesh.indexOf(number));
        cornersOf.insert(cornersOf.end(), NumModes, corners);
    }
    model.K = congruence(model.K, cornersOf, 3);
    model.m = congruence(model.m, cornersOf, 1);
}

}  // namespace simflex
