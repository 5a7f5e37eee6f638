#include "simflex/fe/AbaqusMatrices.h"

#include <algorithm>
#include <stdexcept>

#include "simflex/fe/decks/NodeTable.h"

namespace simflex {
namespace {

constexpr long TermsPerReport = 200000;

/** Reads lines of five fields by node, or of three by row, which require `size` rows. **/
MatrixFile readMatrix(const std::string& path, const char* what, const NodeTable& nodes,
                      const ProgressCallback& progress) {
    const std::string phase = std::string("reading ") + what;
    TextLines lines(path, "matrix");
    NodalEntries byNode(nodes);
    MatrixFile file;
    file.what = path + ": the matrix";
    const int numDofs = 3 * nodes.mesh.numNodes();
    std::vector<std::string_view> fields;
    size_t numFields = 0;
    int largestRow = 0;
    long count = 0;
    while (lines.nextFilled()) {
        if (trimBlanks(lines.line())[0] == '*') continue;
        splitFields(lines.line(), fields);
        if (numFields == 0) numFields = fields.size();
        if (fields.size() != numFields || (numFields != 3 && numFields != 5))
            lines.refuse("the line has " + std::to_string(fields.size()) +
                         " fields; it must have five (node, direction, node, direction, value) or, "
                         "throughout the file, three (row, column, value)");
        const double value = lines.parseNumber(fields.back(), "the value");
        if (numFields == 5) {
            byNode.add(lines, lines.parseInteger(fields[0], "the node"),
                       lines.parseInteger(fields[1], "the direction"),
                       lines.parseInteger(fields[2], "the second node"),
                       lines.parseInteger(fields[3], "the second direction"), value);
        } else {
            const int row = lines.parseInteger(fields[0], "the row");
            const int column = lines.parseInteger(fields[1], "the column");
            if (std::min(row, column) < 1 || std::max(row, column) > numDofs)
                lines.refuse("entry (" + std::to_string(row) + ", " + std::to_string(column) +
                             ") lies outside the matrix of " + std::to_string(numDofs) +
                             " rows, three for each node of the nodes' file; write "
                             "FORMAT=MATRIX INPUT, which names nodes and directions");
            largestRow = std::max({largestRow, row, column});
            byNode.entries.add(row - 1, column - 1, value);
        }
        if (count++ % TermsPerReport == 0) reportProgress(progress, phase, lines.fraction());
    }
    if (numFields == 3 && largestRow != numDofs)
        throw std::invalid_argument(path + ": the matrix has " + std::to_string(largestRow) +
                                    " rows, the nodes' file " + std::to_string(numDofs / 3) +
                                    " nodes; there must be three rows for each node; write "
                                    "FORMAT=MATRIX INPUT, which names nodes and directions");
    file.entries = std::move(byNode.entries);
    return file;
}

}  // namespace

FeModel readAbaqusMatrices(const std::string& stiffnessFile, const std::string& massFile,
                           const std::string& nodesFile, const ProgressCallback& progress) {
    reportProgress(progress, "reading the nodes", 0);
    NodeTable nodes = readNodeTable(nodesFile);
    MatrixFile K = readMatrix(stiffnessFile, "K", nodes, progress);
    MatrixFile M = readMatrix(massFile, "M", nodes, progress);
    return assembleModel(stiffnessFile, "Abaqus", std::move(nodes), std::move(K), std::move(M),
                         progress);
}

}  // namespace simflex
