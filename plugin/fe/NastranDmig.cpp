#include "simflex/fe/NastranDmig.h"

#include <stdexcept>

#include "simflex/base/AsciiText.h"
#include "simflex/fe/decks/BulkCards.h"
#include "simflex/fe/decks/NodeTable.h"

namespace simflex {
namespace {

constexpr long EntriesPerReport = 50000;

/** Reads form and type of the matrix from its header. **/
MatrixForm readHeader(const BulkCards& cards, const BulkCard& card, const std::string& name) {
    const int form = cards.parseInteger(card, card.field(2), "IFO");
    const int type = cards.parseInteger(card, card.field(3), "TIN");
    if (type != 1 && type != 2)
        cards.refuse(card, name + " has type " + std::to_string(type) +
                               "; it must be real: 1 (single) or 2 (double precision)");
    if (form == 6) return MatrixForm::Symmetric;
    if (form == 1) return MatrixForm::General;
    cards.refuse(card, name + " has form " + std::to_string(form) +
                           "; it must be 6 (symmetric) or 1 (square)");
}

MatrixFile readMatrix(const std::string& path, const std::string& wanted, const char* what,
                      const NodeTable& nodes, const ProgressCallback& progress) {
    const std::string phase = std::string("reading ") + what, name = upperCase(wanted);
    BulkCards cards(path, "punch file", {"DMIG"});
    NodalEntries byNode(nodes);
    MatrixFile file;
    file.what = path + ": matrix " + name;
    bool hasHeader = false;
    std::set<std::string> others;
    long count = 0;
    for (BulkCard card; cards.next(card);) {
        if (count++ % EntriesPerReport == 0)
            reportProgress(progress, phase, cards.lines().fraction());
        if (upperCase(card.field(0)) != name) {
            if (others.size() < 20) others.insert(upperCase(card.field(0)));
            continue;
        }
        const int column = cards.parseInteger(card, card.field(1), "GJ");
        if (column == 0) {
            file.form = readHeader(cards, card, name);
            hasHeader = true;
            continue;
        }
        if (!hasHeader) cards.refuse(card, name + " has a column before its header");
        const int columnDirection = cards.parseInteger(card, card.field(2), "CJ");
        for (size_t k = 4; k < card.fields.size(); k += 4) {
            if (card.field(k).empty() && card.field(k + 2).empty()) continue;
            if (!card.field(k + 3).empty() &&
                cards.parseNumber(card, card.field(k + 3), "an imaginary part") != 0)
                cards.refuse(card, name + " has complex entries; it must be real");
            byNode.add(cards.lines(), cards.parseInteger(card, card.field(k), "a grid number"),
                       cards.parseInteger(card, card.field(k + 1), "a component"), column,
                       columnDirection,
                       cards.parseNumber(card, card.field(k + 2), "a matrix element"));
        }
    }
    if (!hasHeader) {
        std::string list;
        for (const std::string& other : others) list += (list.empty() ? "" : ", ") + other;
        throw std::invalid_argument(path + ": there is no DMIG matrix " + name + "; it has " +
                                    (list.empty() ? "none" : list));
    }
    file.entries = std::move(byNode.entries);
    return file;
}

}  // namespace

FeModel readNastranDmig(const std::string& punchFile, const std::string& gridsFile,
                        const NastranDmigOptions& options) {
    reportProgress(options.progress, "reading the nodes", 0);
    NodeTable nodes = readNodeTable(gridsFile.empty() ? punchFile : gridsFile);
    MatrixFile K = readMatrix(punchFile, options.stiffnessName, "K", nodes, options.progress);
    MatrixFile M = readMatrix(options.massFile.empty() ? punchFile : options.massFile,
                              options.massName, "M", nodes, options.progress);
    return assembleModel(punchFile, "Nastran", std::move(nodes), std::move(K), std::move(M),
                         options.progress);
}

}  // namespace simflex
