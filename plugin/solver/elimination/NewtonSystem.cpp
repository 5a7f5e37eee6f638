#include "simflex/solver/NewtonSystem.h"

#include <algorithm>
#include <istream>
#include <limits>
#include <ostream>
#include <stdexcept>
#include <string>

#include "simflex/base/Checkpoint.h"

namespace simflex {

template <class Scalar>
void BasicNewtonSystem<Scalar>::Block::resize(int numSpeeds, std::vector<int> constraintRows) {
    size = numSpeeds;
    part = -1;
    form = Form::General;
    columns = Columns::Own;
    const size_t n = size_t(numSpeeds);
    matrix.assign(n * n, 0);
    rows = std::move(constraintRows);
    Gt.assign(n * rows.size(), 0);
}

template <class Scalar>
void BasicNewtonSystem<Scalar>::Block::resize(int partIndex, int numModes,
                                              std::vector<int> constraintRows) {
    size = 6 + numModes;
    part = partIndex;
    form = Form::Arrow;
    columns = Columns::Own;
    head.assign(36, 0);
    coupling.assign(3 * size_t(numModes), 0);
    rows = std::move(constraintRows);
    Gt.assign(size_t(size) * rows.size(), 0);
}

template <class Scalar>
void BasicNewtonSystem<Scalar>::Block::resize(int partIndex, int numModes,
                                              std::vector<Side> columnSides,
                                              std::vector<int> constraintRows) {
    resize(partIndex, numModes, std::move(constraintRows));
    columns = Columns::Shared;
    sides = std::move(columnSides);
    Gt.assign(6 * rows.size(), 0);
    coefficients.assign(6 * rows.size(), 0);
}

template <class Scalar>
int BasicNewtonSystem<Scalar>::numSpeeds() const {
    int total = 0;
    for (const Block& block : blocks) total += block.size;
    return total;
}

template <class Scalar>
void BasicNewtonSystem<Scalar>::expandGt(const NewtonBlock& block, double* Gt) const {
    if (block.columns == NewtonBlock::Columns::Own) {
        std::copy(block.Gt.begin(), block.Gt.end(), Gt);
        return;
    }
    const Part& part = parts[size_t(block.part)];
    const size_t n = size_t(part.numModes);
    const double *rigid = block.Gt.data(), *coefficients = block.coefficients.data();
    for (const Side& side : block.sides) {
        const double* shapes = part.shapes->data() + 6 * n * size_t(side.frame);
        for (int k = 0; k < side.numColumns; ++k, rigid += 6, coefficients += 6, Gt += 6 + n) {
            std::copy_n(rigid, 6, Gt);
            for (size_t i = 0; i < n; ++i) {
                Gt[6 + i] = 0;
                for (size_t a = 0; a < 6; ++a) Gt[6 + i] += shapes[i + n * a] * coefficients[a];
            }
        }
    }
}

template <class Scalar>
void BasicNewtonSystem<Scalar>::checkSizes() const {
    const auto refuse = [](const std::string& what) {
        throw std::invalid_argument("NewtonSystem: " + what);
    };
    for (size_t p = 0; p < parts.size(); ++p) {
        const Part& part = parts[p];
        if (part.numModes < 1 || part.diagonal.size() != size_t(part.numModes) || !part.shapes ||
            part.shapes->size() != 6 * part.diagonal.size() * size_t(part.numFrames))
            refuse("the sizes of part " + std::to_string(p) + " do not fit together");
    }
    for (size_t b = 0; b < blocks.size(); ++b) {
        const Block& block = blocks[b];
        const std::string name = "block " + std::to_string(b);
        const size_t n = size_t(block.size), m = block.rows.size();
        bool fits = block.size >= 0;
        fits = fits && block.Gt.size() == size_t(block.heightOfGt()) * m;
        if (block.part < 0) {
            fits = fits && block.form != Block::Form::Arrow && block.matrix.size() == n * n &&
                   block.columns == Block::Columns::Own &&
                   (block.form != Block::Form::Tree || block.tree.screws.size() == 6 * n);
        } else {
            if (block.part >= int(parts.size())) refuse(name + " names a part that is not there");
            const Part& part = parts[size_t(block.part)];
            const bool isShared = block.columns == Block::Columns::Shared;
            int columns = isShared ? 0 : int(m);
            for (const Side& side : block.sides) {
                if (side.frame < 0 || side.frame >= part.numFrames)
                    refuse(name + " names frame " + std::to_string(side.frame) + " of " +
                           std::to_string(part.numFrames));
                columns += side.numColumns;
            }
            fits = fits && block.size == 6 + part.numModes && columns == int(m) &&
                   block.head.size() == 36 && block.coupling.size() == 3 * (n - 6) &&
                   block.coefficients.size() == (isShared ? 6 * m : 0) &&
                   (block.form == Block::Form::Arrow || block.matrix.size() == n * n) &&
                   block.form != Block::Form::Tree;
        }
        if (!fits) refuse("the sizes of " + name + " do not fit together");
        for (int row : block.rows)
            if (row < 0 || row >= numMultipliers())
                refuse(name + " names constraint row " + std::to_string(row) + " of " +
                       std::to_string(numMultipliers()));
    }
    if (!compliance.empty() && compliance.size() != c.size())
        refuse("the compliance has " + std::to_string(compliance.size()) + " entries for " +
               std::to_string(c.size()) + " rows");
    for (size_t k = 0; k < pairs.size(); ++k)
        if (pairs[k] < (k == 0 ? 0 : pairs[k - 1] + 2) || pairs[k] + 1 >= int(compliance.size()))
            refuse("no pair begins at row " + std::to_string(pairs[k]));
    for (const Coupling& coupling : couplings) {
        if (coupling.values.size() != coupling.rows.size() * coupling.rows.size())
            refuse("the sizes of a coupling do not fit together");
        for (int row : coupling.rows)
            if (row < 0 || row >= numMultipliers())
                refuse("a coupling names constraint row " + std::to_string(row) + " of " +
                       std::to_string(numMultipliers()));
    }
    if (r.size() != size_t(numSpeeds()))
        refuse("r has " + std::to_string(r.size()) + " entries for " + std::to_string(numSpeeds()) +
               " speeds");
}

namespace {

constexpr int LargestCount = 1 << 26;

template <class T>
void writeArray(std::ostream& stream, const std::vector<T>& values) {
    stream << values.size();
    for (const T& value : values) stream << ' ' << value;
    stream << '\n';
}

[[noreturn]] void refuseStream() {
    throw std::runtime_error("NewtonSystem::read: damaged or truncated stream");
}

int readInteger(std::istream& stream, int lowest) {
    int value = lowest - 1;
    stream >> value;
    if (!stream || value < lowest || value > LargestCount) refuseStream();
    return value;
}

template <class T>
void readArray(std::istream& stream, std::vector<T>& values) {
    values.assign(size_t(readInteger(stream, 0)), T());
    for (T& value : values) stream >> value;
    if (!stream) refuseStream();
}

}  // namespace

template <>
void NewtonSystem::write(std::ostream& stream) const {
    const std::streamsize precision = stream.precision(std::numeric_limits<double>::max_digits10);
    stream << "simflex-newton-system 6\n" << parts.size() << ' ' << blocks.size() << '\n';
    for (const Part& part : parts) {
        stream << part.numModes << ' ' << part.numFrames << '\n';
        writeArray(stream, part.diagonal);
        writeArray(stream, *part.shapes);
    }
    for (const Block& block : blocks) {
        // A tree is written out.
        const bool isTree = block.form == Block::Form::Tree;
        std::vector<double> expanded;
        if (isTree) {
            expanded.resize(block.matrix.size());
            std::vector<double> workspace;
            block.tree.expand(block.size, expanded.data(), workspace);
        }
        stream << block.size << ' ' << block.part << ' '
               << int(isTree ? Block::Form::General : block.form) << ' ' << int(block.columns)
               << '\n';
        stream << block.sides.size();
        for (const Side& side : block.sides) stream << ' ' << side.frame << ' ' << side.numColumns;
        stream << '\n';
        writeArray(stream, block.head);
        writeArray(stream, block.coupling);
        writeArray(stream, isTree ? expanded : block.matrix);
        writeArray(stream, block.rows);
        writeArray(stream, block.Gt);
        writeArray(stream, block.coefficients);
    }
    writeArray(stream, r);
    writeArray(stream, c);
    writeArray(stream, compliance);
    writeArray(stream, pairs);
    stream << couplings.size() << '\n';
    for (const Coupling& coupling : couplings) {
        writeArray(stream, coupling.rows);
        writeArray(stream, coupling.values);
    }
    stream.precision(precision);
}

template <>
NewtonSystem NewtonSystem::read(std::istream& stream) {
    std::string magic;
    int version = 0;
    stream >> magic >> version;
    if (magic != "simflex-newton-system" || version != 6)
        throw std::runtime_error("NewtonSystem::read: not a Newton system of version 6");
    NewtonSystem system;
    const int numParts = readInteger(stream, 0), numBlocks = readInteger(stream, 0);
    system.parts.resize(size_t(numParts));
    system.blocks.resize(size_t(numBlocks));
    for (Part& part : system.parts) {
        part.numModes = readInteger(stream, 0);
        part.numFrames = readInteger(stream, 0);
        readArray(stream, part.diagonal);
        auto shapes = std::make_shared<std::vector<double>>();
        readArray(stream, *shapes);
        part.shapes = shapes;
    }
    for (Block& block : system.blocks) {
        block.size = readInteger(stream, 0);
        block.part = readInteger(stream, -1);
        block.form = Block::Form(std::min(readInteger(stream, 0), int(Block::Form::General)));
        block.columns = Block::Columns(std::min(readInteger(stream, 0), int(Block::Columns::Own)));
        block.sides.resize(size_t(readInteger(stream, 0)));
        for (Side& side : block.sides) {
            side.frame = readInteger(stream, 0);
            side.numColumns = readInteger(stream, 0);
        }
        readArray(stream, block.head);
        readArray(stream, block.coupling);
        readArray(stream, block.matrix);
        readArray(stream, block.rows);
        readArray(stream, block.Gt);
        readArray(stream, block.coefficients);
    }
    readArray(stream, system.r);
    readArray(stream, system.c);
    readArray(stream, system.compliance);
    readArray(stream, system.pairs);
    system.couplings.resize(size_t(readInteger(stream, 0)));
    for (Coupling& coupling : system.couplings) {
        readArray(stream, coupling.rows);
        readArray(stream, coupling.values);
    }
    try {
        system.checkSizes();
    } catch (const std::invalid_argument& error) {
        throw std::runtime_error(std::string("NewtonSystem::read: ") + error.what());
    }
    return system;
}

template <>
void BasicTreeMatrix<double>::visit(Checkpoint& checkpoint, int numSpeeds) {
    constexpr int MostBodies = 1 << 20;
    int count = int(nodes.size());
    checkpoint.visitWithin(count, 0, MostBodies, "the number of bodies");
    nodes.resize(size_t(count));
    int end = 0;
    for (int b = 0; b < count; ++b) {
        Node& node = nodes[size_t(b)];
        checkpoint.visitWithin(node.parent, -1, b - 1, "a body's parent");
        checkpoint.visitWithin(node.numSpeeds, 0, 6, "the speeds of a body");
        node.firstSpeed = end;
        end += node.numSpeeds;
    }
    if (end != numSpeeds) Checkpoint::refuse("its tree of bodies has other speeds");
    if (checkpoint.isReading()) resize(nodes, numSpeeds);
    checkpoint.visit(inertia, screws, motions, turned, own);
}

template <>
void NewtonSystem::visit(Checkpoint& checkpoint) {
    for (Part& part : parts) checkpoint.visit(part.diagonal);
    for (Block& block : blocks) {
        int form = int(block.form);
        const Block::Form simplest = block.part < 0 ? Block::Form::Symmetric : Block::Form::Arrow;
        const Block::Form last = block.part < 0 ? Block::Form::Tree : Block::Form::General;
        checkpoint.visitWithin(form, int(simplest), int(last), "the form of a matrix");
        block.form = Block::Form(form);
        checkpoint.visit(block.head, block.coupling, block.Gt, block.coefficients);
        if (block.form == Block::Form::Arrow) continue;
        if (block.form == Block::Form::Tree) {
            block.tree.visit(checkpoint, block.size);
            continue;
        }
        block.matrix.resize(size_t(block.size) * size_t(block.size));
        checkpoint.visit(block.matrix);
    }
    const std::vector<double> known = compliance;
    checkpoint.visit(compliance);
    // Where there is one belongs to the structure.
    for (size_t row = 0; row < known.size(); ++row)
        if ((compliance[row] != 0) != (known[row] != 0))
            Checkpoint::refuse("its row " + std::to_string(row) +
                               " is another force element's or joint's");
    for (Coupling& coupling : couplings) checkpoint.visit(coupling.values);
}

template struct BasicNewtonSystem<double>;
template struct BasicNewtonSystem<std::complex<double>>;

}  // namespace simflex
