#include "simflex/fe/MatrixMarket.h"

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <stdexcept>
#include <utility>

#include "simflex/base/AsciiText.h"
#include "simflex/base/NumberText.h"
#include "simflex/fe/decks/NodeTable.h"

namespace simflex {
namespace {

constexpr long LinesPerReport = 200000;

MatrixForm readHeader(TextLines& lines) {
    const std::string cure =
        "; simflex reads '%%MatrixMarket matrix coordinate real symmetric' (or general)";
    if (!lines.next()) lines.refuse("the file is empty" + cure);
    std::vector<std::string_view> words;
    splitFields(lines.line(), words);
    if (words.size() != 5 || lowerCase(words[0]) != "%%matrixmarket" ||
        lowerCase(words[1]) != "matrix")
        lines.refuse("this is no Matrix Market header" + cure);
    if (lowerCase(words[2]) != "coordinate")
        lines.refuse("the matrix is stored as " + quoteField(words[2]) + cure);
    const std::string field = lowerCase(words[3]), form = lowerCase(words[4]);
    if (field != "real" && field != "integer" && field != "double")
        lines.refuse("the matrix has entries of kind " + quoteField(words[3]) + cure);
    if (form == "symmetric") return MatrixForm::Symmetric;
    if (form == "general") return MatrixForm::General;
    lines.refuse("the matrix is declared " + quoteField(words[4]) + cure);
}

/** @param dofs  3·node + axis of each row. **/
MatrixFile readMatrix(const std::string& path, const char* what, const std::vector<int>& dofs,
                      const ProgressCallback& progress) {
    const std::string phase = std::string("reading ") + what;
    TextLines lines(path, "matrix");
    MatrixFile file;
    file.what = path + ": the matrix";
    file.form = readHeader(lines);

    std::vector<std::string_view> fields;
    const auto nextData = [&] {
        while (lines.nextFilled())
            if (trimBlanks(lines.line())[0] != '%') {
                splitFields(lines.line(), fields);
                return true;
            }
        return false;
    };
    if (!nextData() || fields.size() != 3)
        lines.refuse("here must stand the size: rows, columns, entries");
    const int numRows = lines.parseInteger(fields[0], "the number of rows");
    const int numColumns = lines.parseInteger(fields[1], "the number of columns");
    const int numEntries = lines.parseInteger(fields[2], "the number of entries");
    if (numRows != numColumns || size_t(std::max(numRows, 0)) != dofs.size())
        lines.refuse("the matrix is " + std::to_string(numRows) + " × " +
                     std::to_string(numColumns) + ", the nodes have " +
                     std::to_string(dofs.size()) +
                     " degrees of freedom: three for each node of the nodes' file, in its order; "
                     "where the matrix has others, give a file of the degrees of freedom");

    int count = 0, numLower = 0, numUpper = 0;
    for (; nextData(); ++count) {
        if (fields.size() != 3) lines.refuse("an entry has three fields: row, column, value");
        const int row = lines.parseInteger(fields[0], "the row");
        const int column = lines.parseInteger(fields[1], "the column");
        if (std::min(row, column) < 1 || std::max(row, column) > numRows)
            lines.refuse("entry (" + std::to_string(row) + ", " + std::to_string(column) +
                         ") lies outside the matrix of size " + std::to_string(numRows) +
                         "; rows and columns are counted from 1");
        numLower += row > column;
        numUpper += row < column;
        file.entries.add(dofs[size_t(row - 1)], dofs[size_t(column - 1)],
                         lines.parseNumber(fields[2], "the value"));
        if (file.form == MatrixForm::Symmetric && numLower && numUpper)
            lines.refuse(
                "the matrix is declared symmetric, but has entries below and above the "
                "diagonal; write one triangle, or declare it general");
        if (count % LinesPerReport == 0) reportProgress(progress, phase, lines.fraction());
    }
    if (count != numEntries)
        throw std::invalid_argument(path + ": the file has " + std::to_string(count) +
                                    " entries, its header says " + std::to_string(numEntries) +
                                    (count < numEntries ? "; is it cut short?" : ""));
    return file;
}

/** Returns the degree of freedom of each row, in the order of the nodes, or from a file `node
direction`. **/
std::vector<int> findDofs(const NodeTable& nodes, const std::string& path) {
    std::vector<int> dofs;
    if (path.empty()) {
        for (const int node : nodes.order)
            for (int axis = 0; axis < 3; ++axis) dofs.push_back(3 * node + axis);
        return dofs;
    }
    TextLines lines(path, "file of the degrees of freedom");
    std::vector<std::string_view> fields;
    std::vector<char> seen(3 * size_t(nodes.mesh.numNodes()), 0);
    while (lines.nextFilled()) {
        std::string_view text = trimBlanks(lines.line());
        if (std::string_view("#%!*$").find(text[0]) != std::string_view::npos) continue;
        splitFields(text, fields);
        if (fields.size() == 1 && fields[0].find('.') != std::string_view::npos) {
            const size_t dot = fields[0].find('.');
            fields = {fields[0].substr(0, dot), fields[0].substr(dot + 1)};
        }
        if (fields.size() != 2)
            lines.refuse("the line has " + std::to_string(fields.size()) +
                         " fields; it must have two: node number and direction");
        const int number = lines.parseInteger(fields[0], "the node number");
        const int direction = lines.parseInteger(fields[1], "the direction");
        if (direction < 1 || direction > 3)
            lines.refuse(
                "direction " + std::to_string(direction) + " of node " + std::to_string(number) +
                " is not a translation (1, 2 or 3); simflex needs plain nodal translations");
        const auto& numbers = nodes.mesh.nodeNumbers;
        const auto found = std::lower_bound(numbers.begin(), numbers.end(), number);
        if (found == numbers.end() || *found != number)
            lines.refuse("the nodes' file does not list node " + std::to_string(number));
        dofs.push_back(3 * int(found - numbers.begin()) + direction - 1);
        if (seen[size_t(dofs.back())]++)
            lines.refuse("direction " + std::to_string(direction) + " of node " +
                         std::to_string(number) + " comes twice");
    }
    return dofs;
}

/** A file that must be written completely. **/
class OutputFile {
public:
    explicit OutputFile(const std::string& path)
        : m_path(path), m_file(std::fopen(path.c_str(), "w")) {
        if (!m_file) throw std::runtime_error("cannot write '" + path + "'");
    }
    ~OutputFile() {
        if (m_file) std::fclose(m_file);
    }
    OutputFile(const OutputFile&) = delete;
    OutputFile& operator=(const OutputFile&) = delete;

    operator std::FILE*() const { return m_file; }

    void close() {
        const bool failed = std::ferror(m_file) != 0;
        const bool closed = std::fclose(std::exchange(m_file, nullptr)) == 0;
        if (failed || !closed)
            throw std::runtime_error("cannot write all of '" + m_path + "'; is the disk full?");
    }

private:
    std::string m_path;
    std::FILE* m_file;
};

/** @param copies  3 for m ⊗ 1₃, 1 for the matrix itself. **/
void writeMatrix(const std::string& path, const SymmetricMatrix& A, int copies) {
    OutputFile out(path);
    std::fprintf(out, "%%%%MatrixMarket matrix coordinate real symmetric\n%d %d %lld\n",
                 copies * A.size, copies * A.size, (long long)(copies * A.numEntries()));
    for (int column = 0; column < A.size; ++column)
        for (int axis = 0; axis < copies; ++axis)
            for (auto k = A.columnStarts[size_t(column)]; k < A.columnStarts[size_t(column) + 1];
                 ++k)
                std::fprintf(out, "%d %d %s\n", copies * A.rows[size_t(k)] + axis + 1,
                             copies * column + axis + 1, writeGeneral(A.values[size_t(k)]).c_str());
    out.close();
}

const char* calculixNameOf(ElementType type) {
    switch (type) {
        case ElementType::Tet4:
            return "C3D4";
        case ElementType::Tet10:
            return "C3D10";
        case ElementType::Hex8:
            return "C3D8";
        case ElementType::Hex20:
            return "C3D20";
        case ElementType::Wedge6:
            return "C3D6";
        case ElementType::Wedge15:
            return "C3D15";
    }
    throw std::invalid_argument("unknown element type");
}

/** One item per data line, except for elements, whose nodes are written eight per line. **/
void writeMesh(const std::string& path, const Mesh& mesh) {
    constexpr int PerLine = 8;
    OutputFile out(path);
    std::fprintf(out, "*NODE\n");
    for (int node = 0; node < mesh.numNodes(); ++node) {
        const auto x = mesh.position(node);
        std::fprintf(out, "%d, %s, %s, %s\n", mesh.nodeNumbers[size_t(node)],
                     writeGeneral(x[0]).c_str(), writeGeneral(x[1]).c_str(),
                     writeGeneral(x[2]).c_str());
    }
    int element = 0;
    for (const ElementBlock& block : mesh.elements) {
        std::fprintf(out, "*ELEMENT, TYPE=%s, ELSET=BODY\n", calculixNameOf(block.type));
        const int size = numNodesOf(block.type);
        for (int e = 0; e < block.numElements(); ++e) {
            std::fprintf(out, "%d", ++element);
            for (int k = 0; k < size; ++k)
                std::fprintf(out, k > 0 && k % PerLine == 0 ? ",\n%d" : ",%d",
                             mesh.nodeNumbers[size_t(block.nodes[size_t(size * e + k)])]);
            std::fprintf(out, "\n");
        }
    }
    for (const auto& [name, nodes] : mesh.nodeSets) {
        std::fprintf(out, "*NSET, NSET=%s\n", name.c_str());
        for (const int node : nodes) std::fprintf(out, "%d,\n", mesh.nodeNumbers[size_t(node)]);
    }
    out.close();
}

}  // namespace

FeModel readMatrixMarket(const std::string& stiffnessFile, const std::string& massFile,
                         const std::string& nodesFile, const MatrixMarketOptions& options) {
    reportProgress(options.progress, "reading the nodes", 0);
    NodeTable nodes = readNodeTable(nodesFile);
    const std::vector<int> dofs = findDofs(nodes, options.dofs);
    MatrixFile K = readMatrix(stiffnessFile, "K", dofs, options.progress);
    MatrixFile M = readMatrix(massFile, "M", dofs, options.progress);
    return assembleModel(stiffnessFile, "Matrix Market", std::move(nodes), std::move(K),
                         std::move(M), options.progress);
}

void writeMatrixMarket(const FeModel& model, const std::string& prefix) {
    if (!model.constraints.empty())
        throw std::invalid_argument(model.source +
                                    ": the model has constraints (ties, equations), which Matrix "
                                    "Market files cannot hold");
    writeMatrix(prefix + "_K.mtx", model.K, 1);
    writeMatrix(prefix + "_M.mtx", model.m, 3);
    writeMesh(prefix + "_nodes.inp", model.mesh);
}

}  // namespace simflex
