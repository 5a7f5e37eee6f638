#pragma once
/** @file
Reads a .vtu file with appended raw data according to VTK's file format document: it follows the
tags and their offsets and assumes nothing about the writer. Little-endian machines. **/

#include <cstdint>
#include <cstring>
#include <fstream>
#include <map>
#include <regex>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace simflex::test {

struct VtuArray {
    std::string type;
    int components = 1;
    std::vector<double> values;
};

/** Arrays by name. Reading throws if the file is inconsistent. **/
struct VtuContent {
    std::string xml;  ///< everything but the binary data
    int numPoints = 0, numCells = 0;
    std::map<std::string, VtuArray> arrays;
    std::map<std::string, std::string> texts;  ///< character codes of the string arrays

    const VtuArray& operator[](const std::string& name) const { return arrays.at(name); }
};

inline std::string findAttribute(const std::string& tag, const std::string& name) {
    std::smatch found;
    return std::regex_search(tag, found, std::regex("[ ]" + name + "=\"([^\"]*)\""))
               ? found[1].str()
               : "";
}

template <class Number>
std::vector<double> decode(const std::string& bytes) {
    std::vector<double> values(bytes.size() / sizeof(Number));
    for (size_t k = 0; k < values.size(); ++k) {
        Number value;
        std::memcpy(&value, bytes.data() + k * sizeof value, sizeof value);
        values[k] = double(value);
    }
    return values;
}

inline VtuContent readVtu(const std::string& path) {
    std::ifstream in(path, std::ios::binary);
    std::ostringstream all;
    all << in.rdbuf();
    const std::string text = all.str();
    const std::string mark = "<AppendedData encoding=\"raw\">",
                      end = "</AppendedData>\n</VTKFile>\n";
    const size_t appended = text.find(mark);
    if (!in || appended == std::string::npos || text.size() < end.size() ||
        text.compare(text.size() - end.size(), end.size(), end) != 0)
        throw std::runtime_error("no appended data in " + path);
    const size_t data = text.find('_', appended) + 1;

    VtuContent content;
    content.xml = text.substr(0, appended) + mark + end;
    content.numPoints = std::stoi(findAttribute(content.xml, "NumberOfPoints"));
    content.numCells = std::stoi(findAttribute(content.xml, "NumberOfCells"));
    if (findAttribute(content.xml, "byte_order") != "LittleEndian" ||
        findAttribute(content.xml, "header_type") != "UInt64")
        throw std::runtime_error("other header in " + path);
    const std::regex tags("<DataArray [^>]*/>");
    for (std::sregex_iterator tag(content.xml.begin(), content.xml.end(), tags), last; tag != last;
         ++tag) {
        VtuArray array;
        const std::string attributes = tag->str();
        array.type = findAttribute(attributes, "type");
        const std::string components = findAttribute(attributes, "NumberOfComponents");
        if (!components.empty()) array.components = std::stoi(components);
        const size_t at = data + std::stoull(findAttribute(attributes, "offset"));
        std::uint64_t size = 0;
        std::memcpy(&size, text.data() + at, sizeof size);
        const std::string bytes = text.substr(at + sizeof size, size);
        if (bytes.size() != size) throw std::runtime_error("cut short: " + path);
        array.values = array.type == "Float32"   ? decode<float>(bytes)
                       : array.type == "Float64" ? decode<double>(bytes)
                       : array.type == "Int32"   ? decode<std::int32_t>(bytes)
                       : array.type == "Int64"   ? decode<std::int64_t>(bytes)
                       : array.type == "UInt8"   ? decode<std::uint8_t>(bytes)
                                                 : throw std::runtime_error(array.type);
        content.arrays[findAttribute(attributes, "Name")] = array;
    }
    const std::regex strings("<Array type=\"String\"([^>]*)>([^<]*)</Array>");
    for (std::sregex_iterator tag(content.xml.begin(), content.xml.end(), strings), last;
         tag != last; ++tag)
        content.texts[findAttribute((*tag)[1].str(), "Name")] = (*tag)[2].str();
    return content;
}

}  // namespace simflex::test
