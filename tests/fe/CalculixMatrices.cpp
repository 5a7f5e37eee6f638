#include "fe/CalculixMatrices.h"

#include <fstream>
#include <sstream>
#include <stdexcept>

#include "fe/TestDecks.h"
#include "simflex/base/NumberText.h"

namespace simflex {
namespace testing {
namespace {

void writeModel(std::ostream& out, const DeckModel& deck) {
    out << "*NODE\n";
    for (int node = 0; node < deck.mesh.numNodes() - deck.mesh.numInternalNodes; ++node) {
        out << deck.mesh.nodeNumbers[size_t(node)];
        for (const double x : deck.mesh.position(node)) out << ',' << writeFortran(x, 13);
        out << '\n';
    }
    for (const auto& [type, solids] : deck.solids) {
        if (type[0] != 'C') continue;
        out << "*ELEMENT, TYPE=" << type << "\n";
        for (const auto& solid : solids) {
            out << solid.number;
            for (size_t k = 0; k < solid.nodes.size(); ++k)
                out << (k == 15 ? ",\n" : ",") << solid.nodes[k];
            out << '\n';
        }
    }
    for (const auto& [name, numbers] : deck.elementSets) {
        out << "*ELSET, ELSET=" << name << "\n";
        for (const int number : numbers) out << number << ",\n";
    }
    for (const DeckCard& card : deck.materials) writeCard(out, card);
    for (DeckCard card : deck.sections) {
        if (card.keyword == LayersCard) continue;
        if (card.keyword == "SOLIDSECTION") card.data.clear();
        writeCard(out, card);
    }
    out << "*STEP\n*FREQUENCY, SOLVER=MATRIXSTORAGE\n*END STEP\n";
}

std::ifstream openFile(const std::string& path) {
    std::ifstream in(path);
    if (!in) throw std::runtime_error("CalculiX did not write " + path);
    return in;
}

Eigen::MatrixXd readMatrix(const std::string& path, const std::vector<int>& dofs, int size) {
    Eigen::MatrixXd A = Eigen::MatrixXd::Zero(size, size);
    std::ifstream in = openFile(path);
    int row, column;
    for (double value; in >> row >> column >> value;) {
        const int i = dofs.at(size_t(row) - 1), j = dofs.at(size_t(column) - 1);
        A(i, j) = A(j, i) = value;
    }
    return A;
}

}  // namespace

CalculixMatrices calcCalculixMatrices(const TestFolder& folder, const DeckModel& deck) {
    std::ostringstream text;
    writeModel(text, deck);
    writeText(folder / "matrices.inp", text.str());
    runOrThrow("cd '" + folder.path() + "' && ccx matrices", folder / "ccx.log");
    std::vector<int> dofs;
    std::ifstream in = openFile(folder / "matrices.dof");
    for (std::string line; in >> line;) {
        const size_t point = line.find('.');
        dofs.push_back(3 * deck.mesh.indexOf(std::stoi(line.substr(0, point))) +
                       std::stoi(line.substr(point + 1)) - 1);
    }
    const int size = 3 * deck.mesh.numNodes();
    return {readMatrix(folder / "matrices.sti", dofs, size),
            readMatrix(folder / "matrices.mas", dofs, size)};
}

}  // namespace testing
}  // namespace simflex
