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

}  // namespace simflex
