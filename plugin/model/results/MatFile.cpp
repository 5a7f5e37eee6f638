#include "simflex/model/results/MatFile.h"

#include <cstdint>
#include <cstring>
#include <stdexcept>

#include "simflex/base/UnfinishedFile.h"
#include "simflex/model/LinearSystem.h"

namespace simflex {
namespace model {

using SimTK::Matrix;

namespace {

// Of data and of arrays, by their numbers in MATLAB's description of the format.
enum class MatType : std::uint32_t {
    Int8 = 1,
    UInt16 = 4,
    Int32 = 5,
    UInt32 = 6,
    Double = 9,
    Matrix = 14
};
enum class MatClass : std::uint32_t { Cell = 1, Char = 4, Double = 6 };
constexpr std::uint32_t ComplexFlag = 0x800;

template <class Number>
void appendNumber(std::string& bytes, Number number) {
    char raw[sizeof number];
    std::memcpy(raw, &number, sizeof number);
    bytes.append(raw, sizeof raw);
}

/** With its tag, and zeroes up to the next multiple of 8. **/
void appendElement(std::string& bytes, MatType type, const std::string& contents) {
    if (contents.size() > UINT32_MAX)
        throw std::length_error("a matrix of " + std::to_string(contents.size()) +
                                " bytes is too large for a .mat file of format 5");
    appendNumber(bytes, static_cast<std::uint32_t>(type));
    appendNumber(bytes, static_cast<std::uint32_t>(contents.size()));
    bytes += contents;
    bytes.append((8 - contents.size() % 8) % 8, '\0');
}

/** Flags, dimensions and name of an array. **/
std::string beginArray(MatClass kind, std::uint32_t flags, size_t rows, size_t columns,
                       const std::string& name) {
    std::string bytes, contents;
    appendNumber(contents, static_cast<std::uint32_t>(kind) | flags);
    appendNumber(contents, std::uint32_t(0));
    appendElement(bytes, MatType::UInt32, contents);
    contents.clear();
    appendNumber(contents, static_cast<std::int32_t>(rows));
    appendNumber(contents, static_cast<std::int32_t>(columns));
    appendElement(bytes, MatType::Int32, contents);
    appendElement(bytes, MatType::Int8, name);
    return bytes;
}

/** UTF-16 of UTF-8, which is well-formed. **/
std::u16string toUtf16(const std::string& text) {
    std::u16string units;
    for (size_t i = 0; i < text.size();) {
        const auto first = static_cast<unsigned char>(text[i]);
        const size_t length = first < 0x80 ? 1 : first < 0xE0 ? 2 : first < 0xF0 ? 3 : 4;
        std::uint32_t code = length == 1 ? first : first & (0xFFu >> (length + 1));
        for (size_t k = 1; k < length && i + k < text.size(); ++k)
            code = code << 6 | (static_cast<unsigned char>(text[i + k]) & 0x3F);
        i += length;
        if (code >= 0x10000) {
            units += static_cast<char16_t>(0xD800 + ((code - 0x10000) >> 10));
            units += static_cast<char16_t>(0xDC00 + ((code - 0x10000) & 0x3FF));
        } else {
            units += static_cast<char16_t>(code);
        }
    }
    return units;
}

template <class Scalar, class Part>
std::string collect(const SimTK::Matrix_<Scalar>& matrix, const Part& part) {
    std::string bytes;
    bytes.reserve(size_t(matrix.nrow()) * size_t(matrix.ncol()) * sizeof(double));
    for (int j = 0; j < matrix.ncol(); ++j)
        for (int i = 0; i < matrix.nrow(); ++i) appendNumber(bytes, double(part(matrix(i, j))));
    return bytes;
}

}  // namespace

void MatFile::add(const std::string& name, const Matrix& matrix) {
    std::string array =
        beginArray(MatClass::Double, 0, size_t(matrix.nrow()), size_t(matrix.ncol()), name);
    appendElement(array, MatType::Double, collect(matrix, [](double x) { return x; }));
    appendElement(m_bytes, MatType::Matrix, array);
}

void MatFile::add(const std::string& name, const SimTK::Matrix_<SimTK::Complex>& matrix) {
    std::string array = beginArray(MatClass::Double, ComplexFlag, size_t(matrix.nrow()),
                                   size_t(matrix.ncol()), name);
    appendElement(array, MatType::Double,
                  collect(matrix, [](const SimTK::Complex& x) { return x.real(); }));
    appendElement(array, MatType::Double,
                  collect(matrix, [](const SimTK::Complex& x) { return x.imag(); }));
    appendElement(m_bytes, MatType::Matrix, array);
}

void MatFile::add(const std::string& name, const std::vector<std::string>& texts) {
    std::string array = beginArray(MatClass::Cell, 0, texts.size(), 1, name);
    for (const std::string& text : texts) {
        const std::u16string units = toUtf16(text);
        std::string cell = beginArray(MatClass::Char, 0, units.empty() ? 0 : 1, units.size(), "");
        std::string contents;
        for (const char16_t unit : units) appendNumber(contents, static_cast<std::uint16_t>(unit));
        appendElement(cell, MatType::UInt16, contents);
        appendElement(array, MatType::Matrix, cell);
    }
    appendElement(m_bytes, MatType::Matrix, array);
}

void MatFile::write(const std::string& path) const {
    std::string head = "MATLAB 5.0 MAT-file, written by simflex";
    head.resize(116, ' ');
    head.append(8, '\0');
    appendNumber(head, std::uint16_t(0x0100));
    appendNumber(head, std::uint16_t(0x4D49));  // "MI" to who reads bytes in another order
    replaceFile(path, head + m_bytes);
}

}  // namespace model

void LinearSystem::writeMat(const std::string& path) const {
    model::MatFile file;
    file.add("A", A);
    file.add("B", B);
    file.add("C", C);
    file.add("D", D);
    for (const auto& [name, ports] :
         {std::pair("inputs", &inputs), std::pair("outputs", &outputs)}) {
        std::vector<std::string> names, units;
        for (const Port& port : *ports) {
            names.push_back(port.name);
            units.push_back(port.unit);
        }
        file.add(name, names);
        file.add(name == std::string("inputs") ? "input_units" : "output_units", units);
    }
    file.write(path);
}

}  // namespace simflex
