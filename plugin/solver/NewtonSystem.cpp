#include "simflex/solver/NewtonSystem.h"

#include <istream>
#include <limits>
#include <ostream>
#include <stdexcept>
#include <string>

namespace simflex {

void NewtonSystem::Block::resize(int numSpeeds, std::vector<int> constraintRows) {
    size = numSpeeds;
    const size_t n = size_t(numSpeeds), tail = n > 6 ? n - 6 : 0;
    head.assign(36, 0);
    coupling.assign(6 * tail, 0);
    diagonal.assign(tail, 0);
    dense.assign(n * n, 0);
    rows = std::move(constraintRows);
    Gt.assign(n * rows.size(), 0);
    r.assign(n, 0);
}

int NewtonSystem::numSpeeds() const {
    int total = 0;
    for (const Block& block : blocks) total += block.size;
    return total;
}

namespace {

constexpr int LargestCount = 1 << 26;

template <class T>
void writeArray(std::ostream& stream, const std::vector<T>& values) {
    stream << values.size();
    for (const T& value : values) stream << ' ' << value;
    stream << '\n';
}

int readCount(std::istream& stream) {
    int count = -1;
    stream >> count;
    if (!stream || count < 0 || count > LargestCount)
        throw std::runtime_error("NewtonSystem::read: damaged or truncated stream");
    return count;
}

template <class T>
void readArray(std::istream& stream, std::vector<T>& values) {
    values.assign(readCount(stream), T());
    for (T& value : values) stream >> value;
    if (!stream) throw std::runtime_error("NewtonSystem::read: damaged or truncated stream");
}

}  // namespace

void NewtonSystem::write(std::ostream& stream) const {
    const std::streamsize precision = stream.precision(std::numeric_limits<double>::max_digits10);
    stream << "simflex-newton-system 1\n" << blocks.size() << '\n';
    for (const Block& block : blocks) {
        stream << block.size << ' ' << (block.form == Block::Form::Arrow ? 1 : 0) << '\n';
        writeArray(stream, block.head);
        writeArray(stream, block.coupling);
        writeArray(stream, block.diagonal);
        writeArray(stream, block.dense);
        writeArray(stream, block.rows);
        writeArray(stream, block.Gt);
        writeArray(stream, block.r);
    }
    writeArray(stream, c);
    stream.precision(precision);
}

NewtonSystem NewtonSystem::read(std::istream& stream) {
    std::string magic;
    int version = 0;
    stream >> magic >> version;
    if (magic != "simflex-newton-system" || version != 1)
        throw std::runtime_error("NewtonSystem::read: not a Newton system of version 1");
    NewtonSystem system;
    system.blocks.resize(readCount(stream));
    for (Block& block : system.blocks) {
        block.size = readCount(stream);
        block.form = readCount(stream) ? Block::Form::Arrow : Block::Form::Dense;
        readArray(stream, block.head);
        readArray(stream, block.coupling);
        readArray(stream, block.diagonal);
        readArray(stream, block.dense);
        readArray(stream, block.rows);
        readArray(stream, block.Gt);
        readArray(stream, block.r);
    }
    readArray(stream, system.c);
    for (const Block& block : system.blocks) {
        const size_t n = size_t(block.size), tail = n > 6 ? n - 6 : 0;
        bool isWhole = block.head.size() == 36 && block.coupling.size() == 6 * tail &&
                       block.diagonal.size() == tail && block.dense.size() == n * n &&
                       block.Gt.size() == n * block.rows.size() && block.r.size() == n &&
                       (block.form == Block::Form::Dense || n > 6);
        for (int row : block.rows) isWhole = isWhole && row >= 0 && row < system.numMultipliers();
        if (!isWhole)
            throw std::runtime_error(
                "NewtonSystem::read: the sizes of a block do not fit together");
    }
    return system;
}

}  // namespace simflex
