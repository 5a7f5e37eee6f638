#include "simflex/part/ArrayFile.h"

#include <libdeflate.h>
#include <matio.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <memory>
#include <new>
#include <stdexcept>
#include <string_view>

#include "simflex/base/AsciiText.h"
#include "simflex/base/InputFile.h"
#include "simflex/base/NumberText.h"
#include "simflex/base/UnfinishedFile.h"
#include "simflex/base/Utf8.h"
#include "simflex/base/ZipFile.h"
#include "simflex/part/TextLines.h"

namespace simflex {
namespace {

bool isNumPy(const std::string& path) {
    return lowerCase(std::filesystem::path(path).extension().string()) == ".npz";
}

[[noreturn]] void failDamaged(const std::string& path, const std::string& what) {
    throw std::invalid_argument(path + ": " + what + "; is the file damaged?");
}

// .npz: a ZIP archive of .npy files

std::uint64_t readLittle(const std::string& bytes, size_t at, int size) {
    std::uint64_t value = 0;
    for (int k = 0; k < size; ++k)
        value |= std::uint64_t(static_cast<unsigned char>(bytes[at + size_t(k)])) << (8 * k);
    return value;
}

void writeLittle(std::string& bytes, std::uint64_t value, int size) {
    for (int k = 0; k < size; ++k) bytes += char(value >> (8 * k) & 255);
}

/** Returns the value of a key in the dictionary of a .npy header. **/
std::string findKey(const std::string& header, const std::string& key) {
    const size_t at = header.find("'" + key + "'");
    const size_t colon = at == std::string::npos ? at : header.find(':', at);
    if (colon == std::string::npos) return "";
    size_t end = header.find(key == "shape" ? ')' : ',', colon);
    if (end == std::string::npos) end = header.size();
    return std::string(trimBlanks(std::string_view(header).substr(colon + 1, end - colon - 1)));
}

template <class T>
void convert(const char* bytes, std::vector<double>& values) {
    for (size_t k = 0; k < values.size(); ++k) {
        T value;
        std::memcpy(&value, bytes + k * sizeof value, sizeof value);
        values[k] = double(value);
    }
}

/** @returns false for non-numeric types. **/
bool convertNumbers(const std::string& type, const char* bytes, std::vector<double>& values) {
    if (type == "f8")
        convert<double>(bytes, values);
    else if (type == "f4")
        convert<float>(bytes, values);
    else if (type == "i8")
        convert<std::int64_t>(bytes, values);
    else if (type == "i4")
        convert<std::int32_t>(bytes, values);
    else if (type == "i2")
        convert<std::int16_t>(bytes, values);
    else if (type == "i1")
        convert<std::int8_t>(bytes, values);
    else if (type == "u8")
        convert<std::uint64_t>(bytes, values);
    else if (type == "u4")
        convert<std::uint32_t>(bytes, values);
    else if (type == "u2")
        convert<std::uint16_t>(bytes, values);
    else if (type == "u1" || type == "b1")
        convert<std::uint8_t>(bytes, values);
    else
        return false;
    return true;
}

/** To the other order of bytes. **/
void swapItems(std::string& bytes, size_t itemSize) {
    for (auto item = bytes.begin(); item != bytes.end(); item += std::ptrdiff_t(itemSize))
        std::reverse(item, item + std::ptrdiff_t(itemSize));
}

/** Rows first becomes columns first. **/
void transpose(FileArray& array) {
    const auto rows = size_t(array.numRows()), columns = size_t(array.numColumns());
    std::vector<double> values(array.values.size());
    for (size_t i = 0; i < rows; ++i)
        for (size_t j = 0; j < columns; ++j) values[i + rows * j] = array.values[columns * i + j];
    array.values = std::move(values);
}

/** @returns false for an array to be ignored. **/
bool readNpy(const std::string& path, const std::string& text, FileArray& array) {
    constexpr size_t Fixed = 10;
    if (text.size() < Fixed || text.compare(0, 6, "\x93NUMPY") != 0)
        failDamaged(path, array.name + " is no .npy file");
    const int lengthSize = text[6] == 1 ? 2 : 4;
    if (text.size() < size_t(8 + lengthSize)) failDamaged(path, array.name + " is cut off");
    const std::uint64_t length = readLittle(text, 8, lengthSize),
                        begin = 8 + std::uint64_t(lengthSize) + length;
    if (begin > text.size()) failDamaged(path, array.name + " is cut off");
    const std::string header = text.substr(8 + size_t(lengthSize), size_t(length));
    std::string descriptor = findKey(header, "descr"), shape = findKey(header, "shape");
    descriptor.erase(std::remove(descriptor.begin(), descriptor.end(), '\''), descriptor.end());
    if (descriptor.size() != 3 || shape.empty() || shape[0] != '(') return false;
    const auto itemSize = std::uint64_t(descriptor[2] - '0');
    std::uint64_t count = 1;
    for (size_t at = 1; at < shape.size();) {
        const size_t comma = std::min(shape.find(',', at), shape.size());
        const auto field = trimBlanks(std::string_view(shape).substr(at, comma - at));
        at = comma + 1;
        if (field.empty()) continue;
        int size = 0;
        if (!readInteger(field, size) || size < 0) failDamaged(path, array.name + " has no shape");
        array.shape.push_back(size);
        if (size > 0 && count > text.size() / std::uint64_t(size))
            failDamaged(path, array.name + " is shorter than its shape");
        count *= std::uint64_t(size);
    }
    if (array.shape.size() > 2 || itemSize < 1 || itemSize > 8) return false;
    if ((text.size() - begin) / itemSize < count)
        failDamaged(path, array.name + " is shorter than its shape");
    array.values.resize(size_t(count));
    std::string bytes = text.substr(size_t(begin), size_t(count * itemSize));
    if (descriptor[0] == '>') swapItems(bytes, size_t(itemSize));
    if (!convertNumbers(descriptor.substr(1), bytes.data(), array.values)) return false;
    if (array.shape.size() == 2 && findKey(header, "fortran_order") != "True") transpose(array);
    return true;
}

std::vector<std::int64_t> toIntegers(const std::string& path, const std::string& name,
                                     const std::vector<double>& values, std::int64_t most) {
    std::vector<std::int64_t> result;
    for (const double value : values) {
        if (!(value >= 0 && value <= double(most)) || value != double(std::int64_t(value)))
            failDamaged(path, name + " has " + writeGeneral(value, 6) +
                                  "; it must be a whole number from 0 to " + std::to_string(most));
        result.push_back(std::int64_t(value));
    }
    return result;
}

void checkSparse(const std::string& path, const FileArray& array) {
    const auto& starts = array.columnStarts;
    if (!std::is_sorted(starts.begin(), starts.end()) || starts[0] != 0 ||
        starts.back() != std::int64_t(array.values.size()) ||
        array.rows.size() != array.values.size())
        failDamaged(path,
                    "sparse matrix " + array.name + " has columns that do not fit its values");
}

/** Combines SciPy's three arrays into one sparse matrix. **/
std::vector<FileArray> joinSparse(const std::string& path,
                                  std::map<std::string, FileArray> arrays) {
    std::vector<std::string> sparse;
    for (const auto& [name, array] : arrays)
        if (name.size() > 5 && name.compare(name.size() - 5, 5, "_data") == 0) {
            const std::string stem = name.substr(0, name.size() - 5);
            if (arrays.count(stem + "_indices") && arrays.count(stem + "_indptr"))
                sparse.push_back(stem);
        }
    std::vector<FileArray> result;
    for (const std::string& name : sparse) {
        FileArray array;
        array.name = name;
        array.values = std::move(arrays[name + "_data"].values);
        const FileArray &starts = arrays[name + "_indptr"], &rows = arrays[name + "_indices"];
        const auto size = std::int64_t(starts.values.size()) - 1;
        if (size < 1) failDamaged(path, "sparse matrix " + name + " is empty");
        array.shape = {size, size};
        array.columnStarts =
            toIntegers(path, starts.name, starts.values, std::int64_t(array.values.size()));
        array.rows = toIntegers(path, rows.name, rows.values, size - 1);
        checkSparse(path, array);
        for (const char* part : {"_data", "_indices", "_indptr", "_shape", "_format"})
            arrays.erase(name + part);
        result.push_back(std::move(array));
    }
    for (auto& entry : arrays) result.push_back(std::move(entry.second));
    return result;
}

std::vector<FileArray> readNpz(const std::string& path) {
    std::map<std::string, FileArray> arrays;
    for (ZipReader zip(path); zip.next();) {
        FileArray array;
        array.name = zip.getName().substr(0, zip.getName().rfind(".npy"));
        if (readNpy(path, zip.read(), array)) arrays[array.name] = std::move(array);
    }
    return joinSparse(path, std::move(arrays));
}

/** Returns the bytes of a .npy file. **/
std::string makeNpy(const std::string& type, const std::vector<std::int64_t>& shape,
                    const std::string& data) {
    constexpr size_t Alignment = 64, Fixed = 10;
    std::string header = "{'descr': '" + type + "', 'fortran_order': True, 'shape': (";
    for (const std::int64_t size : shape) header += std::to_string(size) + ",";
    header += "), }";
    header.resize((Fixed + header.size() + Alignment) / Alignment * Alignment - Fixed - 1, ' ');
    header += '\n';
    std::string npy = "\x93NUMPY";
    npy += '\1';
    npy += '\0';
    writeLittle(npy, header.size(), 2);
    return npy + header + data;
}

template <class T>
std::string bytesOf(const std::vector<T>& values) {
    return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

/** Fixed-width strings of four-byte characters. **/
std::string makeNpy(const std::vector<std::string>& texts) {
    std::vector<std::u32string> lines;
    size_t width = 1;
    for (const std::string& text : texts) {
        lines.push_back(decodeUtf8(text));
        width = std::max(width, lines.back().size());
    }
    std::string data;
    for (std::u32string& line : lines) {
        line.resize(width);
        for (const char32_t code : line) writeLittle(data, code, 4);
    }
    return makeNpy("<U" + std::to_string(width), {std::int64_t(texts.size())}, data);
}

void writeNpz(const std::string& path, const std::vector<FileArray>& arrays) {
    ZipWriter zip(path);
    const auto add = [&](const std::string& name, const std::string& npy) {
        zip.add(name + ".npy", npy, ZipMethod::Stored);
    };
    for (const FileArray& array : arrays) {
        const auto count = std::int64_t(array.values.size());
        if (array.isSparse()) {
            const auto numStarts = std::int64_t(array.columnStarts.size());
            add(array.name + "_data", makeNpy("<f8", {count}, bytesOf(array.values)));
            add(array.name + "_indices", makeNpy("<i8", {count}, bytesOf(array.rows)));
            add(array.name + "_indptr", makeNpy("<i8", {numStarts}, bytesOf(array.columnStarts)));
        } else if (!array.texts.empty()) {
            add(array.name, makeNpy(array.texts));
        } else {
            add(array.name, makeNpy("<f8", array.shape, bytesOf(array.values)));
        }
    }
    zip.finish();
}

// .mat

struct MatCloser {
    void operator()(mat_t* file) const { Mat_Close(file); }
    void operator()(matvar_t* variable) const { Mat_VarFree(variable); }
};
/** Size limit of a variable in MATLAB's format 5, including row and column indices. **/
constexpr size_t MostInMat = (size_t(1) << 32) * 8 / 12;
using MatFile = std::unique_ptr<mat_t, MatCloser>;
using MatVariable = std::unique_ptr<matvar_t, MatCloser>;

/** NumPy's name of the numbers of an element; empty: it has none. **/
std::string findType(std::uint32_t element) {
    static const char* const Types[] = {"",   "i1", "u1", "i2", "u2", "i4", "u4",
                                        "f4", "",   "f8", "",   "",   "i8", "u8"};
    return element < std::size(Types) ? Types[element] : "";
}

/** Reads MATLAB's format 5 (save -v6, -v7): elements of a tag (type, size) and their bytes. matio
gives zeros for what is missing of a file, and unpacks whatever there is; so this is read here. **/
class MatReader {
public:
    explicit MatReader(const std::string& path) : m_path(path) {}

    std::vector<FileArray> read() {
        constexpr size_t Header = 128, Version = 124;
        std::ifstream file = openInputFile(m_path);
        if (!file.is_open()) throw std::runtime_error("cannot read '" + m_path + "'");
        const std::string bytes(std::istreambuf_iterator<char>(file), {});
        m_packed = bytes.size();
        const std::string order = bytes.size() < Header ? "" : bytes.substr(Version + 2, 2);
        m_isSwapped = order == "MI";
        if (order != "IM" && !m_isSwapped) failDamaged(m_path, "it is no .mat file of MATLAB");
        if (bytes[Version + (m_isSwapped ? 0 : 1)] != 1)
            throw std::invalid_argument(m_path +
                                        ": this version of .mat is not read; write it by "
                                        "save -v7, or as .npz");
        std::vector<FileArray> arrays;
        std::string_view rest = std::string_view(bytes).substr(Header);
        while (!rest.empty()) {
            std::string unpacked;
            Element element = takeElement(rest);
            if (element.type == Compressed) {
                unpacked = unpack(element.bytes);
                std::string_view inner = unpacked;
                element = takeElement(inner);
            }
            FileArray array;
            if (element.type == Matrix && readMatrix(element.bytes, array))
                arrays.push_back(std::move(array));
        }
        return arrays;
    }

private:
    static constexpr std::uint32_t Utf8 = 16, Matrix = 14, Compressed = 15;
    static constexpr std::uint32_t SparseClass = 5, FirstClass = 6, LastClass = 15;  // of numbers
    static constexpr std::uint32_t IsComplex = 1 << 11;
    struct Element {
        std::uint32_t type;
        std::string_view bytes;
    };

    std::uint32_t readWord(std::string_view bytes, size_t at) const {
        std::string word(bytes.substr(at, 4));
        if (m_isSwapped) std::reverse(word.begin(), word.end());
        return std::uint32_t(readLittle(word, 0, 4));
    }

    /** The first element of `rest`, which begins behind it afterwards. **/
    Element takeElement(std::string_view& rest) const {
        constexpr size_t Tag = 8, Small = 4, Alignment = 8;
        if (rest.size() < Tag) failDamaged(m_path, "it is cut off");
        std::uint32_t type = readWord(rest, 0), size = readWord(rest, 4);
        size_t begin = Tag;
        if (type >> 16 != 0) {  // size and up to four bytes within the tag
            size = type >> 16;
            type &= 0xffff;
            begin = Small;
        }
        if (size > rest.size() - begin || (begin == Small && size > Small))
            failDamaged(m_path, "it is cut off");
        const Element element{type, rest.substr(begin, size)};
        size_t end = begin + size;
        if (type != Compressed) end = (end + Alignment - 1) / Alignment * Alignment;
        rest.remove_prefix(std::min(end, rest.size()));
        if (findType(type).empty() && (type < Matrix || type > Utf8 + 2))
            failDamaged(m_path, "it has an element of type " + std::to_string(type));
        return element;
    }

    void count(std::uint64_t bytes) {
        if (unpacksToTooMuch(m_packed, m_unpacked + bytes))
            throw std::invalid_argument(m_path +
                                        ": it would fill the machine: unpacked it has more than a "
                                        "hundred times its size");
    }

    std::string unpack(std::string_view packed) {
        const std::unique_ptr<libdeflate_decompressor, void (*)(libdeflate_decompressor*)> tool(
            libdeflate_alloc_decompressor(), libdeflate_free_decompressor);
        if (!tool) throw std::bad_alloc();
        std::string bytes(8 * packed.size() + 64, '\0');
        for (;;) {
            count(bytes.size());
            size_t size = 0;
            const libdeflate_result result = libdeflate_zlib_decompress(
                tool.get(), packed.data(), packed.size(), bytes.data(), bytes.size(), &size);
            if (result == LIBDEFLATE_SUCCESS) {
                bytes.resize(size);
                m_unpacked += size;
                return bytes;
            }
            if (result != LIBDEFLATE_INSUFFICIENT_SPACE)
                failDamaged(m_path, "a compressed array of it cannot be unpacked");
            bytes.resize(2 * bytes.size());
        }
    }

    std::vector<double> readNumbers(std::string_view& rest, const std::string& name) {
        const Element element = takeElement(rest);
        const std::string type = findType(element.type);
        const auto size = size_t(type.empty() ? 0 : type[1] - '0');
        if (size == 0 || element.bytes.size() % size != 0)
            failDamaged(m_path, name + " has no numbers");
        std::string bytes(element.bytes);
        if (m_isSwapped) swapItems(bytes, size);
        std::vector<double> values(bytes.size() / size);
        m_unpacked += values.size() * sizeof(double);
        count(0);
        convertNumbers(type, bytes.data(), values);
        return values;
    }

    /** @returns false for what is no matrix of real numbers. **/
    bool readMatrix(std::string_view rest, FileArray& array) {
        constexpr size_t FlagsSize = 8;
        if (rest.empty()) return false;
        const Element flags = takeElement(rest);
        if (flags.bytes.size() < FlagsSize) failDamaged(m_path, "an array of it has no kind");
        const std::uint32_t kind = readWord(flags.bytes, 0);
        const bool isSparse = (kind & 255) == SparseClass;
        const bool hasNumbers =
            isSparse || ((kind & 255) >= FirstClass && (kind & 255) <= LastClass);
        if (!hasNumbers || (kind & IsComplex)) return false;
        const std::vector<double> shape = readNumbers(rest, "the shape of an array");
        array.name = takeElement(rest).bytes;
        if (shape.size() != 2) return false;
        for (const double size : shape) {
            if (!(size >= 0 && size <= double(MostRows)) || size != std::floor(size))
                failDamaged(m_path, array.name + " has no shape");
            array.shape.push_back(std::int64_t(size));
        }
        std::vector<double> rows, starts;
        if (isSparse) {
            rows = readNumbers(rest, array.name);
            starts = readNumbers(rest, array.name);
        }
        array.values = readNumbers(rest, array.name);
        if (!isSparse) {
            if (std::int64_t(array.values.size()) != array.shape[0] * array.shape[1])
                failDamaged(m_path, array.name + " has " + std::to_string(array.values.size()) +
                                        " numbers, not its " + std::to_string(array.shape[0]) +
                                        "×" + std::to_string(array.shape[1]));
            return true;
        }
        array.columnStarts = toIntegers(m_path, array.name, starts, std::int64_t(rows.size()));
        if (array.columnStarts.size() != size_t(array.shape[1]) + 1)
            failDamaged(m_path, "sparse matrix " + array.name + " has " +
                                    std::to_string(array.shape[1]) + " columns and " +
                                    std::to_string(array.columnStarts.size()) + " column starts");
        // There may be room for more values.
        const auto numValues = size_t(array.columnStarts.back());
        rows.resize(std::min(rows.size(), numValues));
        array.values.resize(std::min(array.values.size(), numValues));
        array.rows = toIntegers(m_path, array.name, rows, array.shape[0] - 1);
        checkSparse(m_path, array);
        return true;
    }

    static constexpr std::int64_t MostRows = std::int64_t(1) << 31;
    std::string m_path;
    bool m_isSwapped = false;  ///< the other order of bytes
    std::uint64_t m_packed = 0, m_unpacked = 0;
};

void writeMat(const std::string& path, const std::vector<FileArray>& arrays) {
    UnfinishedFile unfinished(path);
    MatFile file(Mat_CreateVer(unfinished.getPath().c_str(),
                               "MATLAB 5.0 MAT-file, written by simflex", MAT_FT_MAT5));
    if (!file) throw std::runtime_error("cannot write '" + path + "'");
    for (const FileArray& array : arrays) {
        if (array.values.size() >= MostInMat / sizeof(double))
            throw std::runtime_error("cannot write '" + path + "': " + array.name +
                                     " is larger than the 4 GB of a .mat; write a .npz");
        MatVariable variable;
        size_t dims[2] = {size_t(array.numRows()), size_t(array.numColumns())};
        std::vector<mat_uint32_t> rows(array.rows.begin(), array.rows.end()),
            starts(array.columnStarts.begin(), array.columnStarts.end());
        auto* values = const_cast<double*>(array.values.data());
        if (array.isSparse()) {
            mat_sparse_t sparse{};
            sparse.nzmax = sparse.nir = sparse.ndata = mat_uint32_t(array.values.size());
            sparse.njc = mat_uint32_t(starts.size());
            sparse.ir = rows.data();
            sparse.jc = starts.data();
            sparse.data = values;
            variable.reset(
                Mat_VarCreate(array.name.c_str(), MAT_C_SPARSE, MAT_T_DOUBLE, 2, dims, &sparse, 0));
        } else if (!array.texts.empty()) {
            dims[0] = array.texts.size();
            dims[1] = 1;
            variable.reset(
                Mat_VarCreate(array.name.c_str(), MAT_C_CELL, MAT_T_CELL, 2, dims, nullptr, 0));
            for (size_t k = 0; k < array.texts.size() && variable; ++k) {
                std::u16string text = convertToUtf16(array.texts[k]);
                size_t size[2] = {text.empty() ? size_t(0) : size_t(1), text.size()};
                Mat_VarSetCell(
                    variable.get(), int(k),
                    Mat_VarCreate(nullptr, MAT_C_CHAR, MAT_T_UINT16, 2, size, text.data(), 0));
            }
        } else {
            variable.reset(
                Mat_VarCreate(array.name.c_str(), MAT_C_DOUBLE, MAT_T_DOUBLE, 2, dims, values, 0));
        }
        if (!variable || Mat_VarWrite(file.get(), variable.get(), MAT_COMPRESSION_NONE) != 0)
            throw std::runtime_error("cannot write " + array.name + " to '" + path + "'");
    }
    file.reset();
    unfinished.finish();
}

}  // namespace

bool isArrayFile(const std::string& path) {
    return isNumPy(path) || lowerCase(std::filesystem::path(path).extension().string()) == ".mat";
}

FileArray makeArray(const std::string& name, std::int64_t numRows, std::int64_t numColumns,
                    std::vector<double> values) {
    FileArray array;
    array.name = name;
    array.shape = {numRows, numColumns};
    array.values = std::move(values);
    return array;
}

std::vector<FileArray> readArrayFile(const std::string& path) {
    try {
        return isNumPy(path) ? readNpz(path) : MatReader(path).read();
    } catch (const std::bad_alloc&) {
        failDamaged(path, "it says that it has more numbers than memory holds");
    }
}

void writeArrayFile(const std::string& path, const std::vector<FileArray>& arrays) {
    isNumPy(path) ? writeNpz(path, arrays) : writeMat(path, arrays);
}

}  // namespace simflex
