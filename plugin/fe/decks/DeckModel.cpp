#include "DeckModel.h"

#include <algorithm>
#include <cstdio>

#include "IntegratedSolids.h"
#include "simflex/base/NumberText.h"

namespace simflex {
namespace {

void writeNumbers(std::ostream& out, const std::vector<int>& numbers, size_t first) {
    constexpr size_t PerLine = 16;
    for (size_t i = 0; i < numbers.size(); ++i) {
        const bool last = i + 1 == numbers.size();
        const bool full = (i + first + 1) % PerLine == 0;
        out << numbers[i] << (last ? "\n" : full ? ",\n" : ",");
    }
}

}  // namespace

bool DeckModel::isForCalculix() const {
    return std::any_of(solids.begin(), solids.end(),
                       [](const auto& entry) { return !isIntegratedSolid(entry.first); });
}

void DeckModel::write(std::ostream& out, const std::set<int>& leftOut) const {
    out << "*NODE\n";
    for (int node = 0; node < mesh.numNodes() - mesh.numInternalNodes; ++node) {
        out << mesh.nodeNumbers[node];
        for (const double x : mesh.position(node)) out << ',' << writeFortran(x, 13);
        out << '\n';
    }
    for (const auto& [type, elements] : solids) {
        if (elements.empty() || leftOut.count(elements.front().number)) continue;
        if (isIntegratedSolid(type) && type != BeamSolid) continue;
        out << "*ELEMENT, TYPE=" << (type == BeamSolid ? "C3D20" : type) << "\n";
        for (const Solid& solid : elements) {
            out << solid.number << ",";
            writeNumbers(out, solid.nodes, 1);
        }
    }
    std::set<std::string> written;
    for (const auto& [name, numbers] : elementSets)
        for (const int number : numbers) {
            if (leftOut.count(number)) continue;
            if (written.insert(name).second) out << "*ELSET, ELSET=" << name << "\n";
            out << number << ",\n";
        }
    for (const DeckCard& card : materials) writeCard(out, card);
    for (const DeckCard& card : sections) {
        DeckCard bare = card;
        if (card.keyword == LayersCard) continue;
        if (card.keyword == "SOLIDSECTION") {
            if (!written.count(card.get("ELSET"))) continue;
            bare.data.clear();
        }
        writeCard(out, bare);
    }
}

void DeckModel::writeModel(std::ostream& out) const {
    write(out, {});
}

void DeckModel::writeClean(std::ostream& out) const {
    std::set<int> leftOut;
    for (const auto& [type, elements] : solids)
        if (isIntegratedSolid(type))
            for (const Solid& solid : elements) leftOut.insert(solid.number);
    write(out, leftOut);
    out << "*STEP\n*FREQUENCY, SOLVER=MATRIXSTORAGE\n*END STEP\n";
}

}  // namespace simflex
