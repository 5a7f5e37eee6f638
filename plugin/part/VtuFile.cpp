#include "simflex/part/VtuFile.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <stdexcept>

#include "simflex/base/UnfinishedFile.h"
#include "simflex/base/Utf8.h"
#include "simflex/part/Frequency.h"

namespace simflex {
namespace {

namespace fs = std::filesystem;

constexpr int Vertex = 1;  // VTK's cell types

struct VtkCell {
    int type;
    std::vector<int> order;  ///< our local index of each VTK node; empty: identical order
};

VtkCell describeCell(ElementType type) {
    switch (type) {
        case ElementType::Tet4:
            return {10, {}};
        case ElementType::Tet10:
            return {24, {}};
        case ElementType::Hex8:
            return {12, {}};
        case ElementType::Hex20:
            return {25, {}};
        // The normal of VTK's first triangle points out of the wedge, ours into it.
        case ElementType::Wedge6:
            return {13, {0, 2, 1, 3, 5, 4}};
        case ElementType::Wedge15:
            return {26, {0, 2, 1, 3, 5, 4, 8, 7, 6, 11, 10, 9, 12, 14, 13}};
    }
    throw std::invalid_argument("VtuFile: unknown element type");
}

/** Indices of VTK's XX YY ZZ XY YZ XZ in xx yy zz xy xz yz. **/
constexpr std::array<int, 6> TensorOrder = {0, 1, 2, 3, 5, 4};
constexpr const char* TensorNames =
    R"( ComponentName0="XX" ComponentName1="YY" ComponentName2="ZZ")"
    R"( ComponentName3="XY" ComponentName4="YZ" ComponentName5="XZ")";

template <class Number>
const char* nameOfType();
template <>
const char* nameOfType<float>() {
    return "Float32";
}
template <>
const char* nameOfType<double>() {
    return "Float64";
}
template <>
const char* nameOfType<int>() {
    return "Int32";
}
template <>
const char* nameOfType<std::int64_t>() {
    return "Int64";
}
template <>
const char* nameOfType<std::uint8_t>() {
    return "UInt8";
}

/** Writes the header with the future offsets of the data, then the data in the same order. **/
class AppendedWriter {
public:
    explicit AppendedWriter(const fs::path& path) : m_out(path, std::ios::binary) {
        m_out.imbue(std::locale::classic());
    }

    void text(const std::string& line) { m_out << line; }

    /** Declares an array; `values` must live until writeData(). **/
    template <class Number>
    void announce(const std::string& attributes, const std::vector<Number>& values) {
        m_out << "<DataArray type=\"" << nameOfType<Number>() << "\" " << attributes
              << " format=\"appended\" offset=\"" << m_offset << "\"/>\n";
        const std::uint64_t size = values.size() * sizeof(Number);
        m_blocks.push_back({reinterpret_cast<const char*>(values.data()), size});
        m_offset += sizeof size + size;
    }

    void writeData() {
        m_out << "<AppendedData encoding=\"raw\">\n_";
        for (const auto& [data, size] : m_blocks) {
            m_out.write(reinterpret_cast<const char*>(&size), sizeof size);
            m_out.write(data, std::streamsize(size));
        }
        m_out << "\n</AppendedData>\n";
    }

    bool finish() { return bool(m_out.flush()); }

private:
    std::ofstream m_out;
    std::uint64_t m_offset = 0;
    std::vector<std::pair<const char*, std::uint64_t>> m_blocks;
};

const char* nameOfByteOrder() {
    const std::uint16_t one = 1;
    unsigned char first = 0;
    std::memcpy(&first, &one, 1);
    return first == 1 ? "LittleEndian" : "BigEndian";
}

std::string quote(const std::string& text) {
    return "\"" + escapeXml(text) + "\"";
}

}  // namespace

std::string escapeXml(const std::string& text) {
    std::string escaped;
    for (size_t at = 0; at < text.size();) {
        const size_t length = calcUtf8Length(text, at);
        const unsigned char c = (unsigned char)(text[at]);
        if (length == 0 || c < 0x20 || c == 0x7F) {
            escaped += '?';
        } else if (c == '&') {
            escaped += "&amp;";
        } else if (c == '<') {
            escaped += "&lt;";
        } else if (c == '>') {
            escaped += "&gt;";
        } else if (c == '"') {
            escaped += "&quot;";
        } else {
            escaped += text.substr(at, length);
        }
        at += std::max<size_t>(length, 1);
    }
    return escaped;
}

double calcVonMises(const std::array<double, 6>& s) {
    const double xy = s[0] - s[1], yz = s[1] - s[2], zx = s[2] - s[0];
    return std::sqrt(0.5 * (xy * xy + yz * yz + zx * zx) +
                     3 * (s[3] * s[3] + s[4] * s[4] + s[5] * s[5]));
}

void VtuFile::checkSize(const std::string& what, size_t found, size_t perNode) const {
    const size_t wanted = perNode * size_t(m_mesh.numNodes());
    if (found != wanted)
        throw std::invalid_argument("VtuFile: " + what + " has " + std::to_string(found) +
                                    " numbers, the mesh of " + std::to_string(m_mesh.numNodes()) +
                                    " nodes needs " + std::to_string(wanted));
}

void VtuFile::setPoints(std::vector<double> positions) {
    checkSize("points", positions.size(), 3);
    m_points = std::move(positions);
}

void VtuFile::addPointField(const std::string& name, int components, std::vector<float> values) {
    checkSize("field '" + name + "'", values.size(), size_t(components));
    if (components == 6) {
        for (size_t at = 0; at < values.size(); at += 6) {
            std::array<float, 6> tensor;
            for (size_t k = 0; k < 6; ++k) tensor[k] = values[at + size_t(TensorOrder[k])];
            std::copy(tensor.begin(), tensor.end(), values.begin() + std::ptrdiff_t(at));
        }
    }
    m_fields.push_back({name, components, std::move(values)});
}

void VtuFile::addPointNumbers(const std::string& name, std::vector<int> values) {
    checkSize("field '" + name + "'", values.size(), 1);
    m_indices.push_back({name, 1, std::move(values)});
}

void VtuFile::addNumbers(const std::string& name, std::vector<double> values) {
    m_numbers.push_back({name, 1, std::move(values)});
}

void VtuFile::addTexts(const std::string& name, std::vector<std::string> values) {
    m_texts.emplace_back(name, std::move(values));
}

void VtuFile::write(const std::string& path) const {
    std::vector<int> connectivity;
    std::vector<std::int64_t> offsets;
    std::vector<std::uint8_t> types;
    for (const ElementBlock& block : m_mesh.elements) {
        const VtkCell cell = describeCell(block.type);
        const size_t perElement = size_t(numNodesOf(block.type));
        for (size_t e = 0; e < size_t(block.numElements()); ++e) {
            for (size_t k = 0; k < perElement; ++k) {
                const size_t place = cell.order.empty() ? k : size_t(cell.order[k]);
                const int node = block.nodes[e * perElement + place];
                if (node < 0 || node >= m_mesh.numNodes())
                    throw std::invalid_argument("VtuFile: an element uses node index " +
                                                std::to_string(node) + ", the mesh has " +
                                                std::to_string(m_mesh.numNodes()) + " nodes");
                connectivity.push_back(node);
            }
            offsets.push_back(std::int64_t(connectivity.size()));
            types.push_back(std::uint8_t(cell.type));
        }
    }
    if (types.empty())
        for (int node = 0; node < m_mesh.numNodes(); ++node) {
            connectivity.push_back(node);
            offsets.push_back(node + 1);
            types.push_back(Vertex);
        }

    UnfinishedFile unfinished(path);
    AppendedWriter out(unfinished.getPath());
    out.text(
        "<?xml version=\"1.0\"?>\n"
        "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"" +
        std::string(nameOfByteOrder()) +
        "\" header_type=\"UInt64\">\n"
        "<UnstructuredGrid>\n<FieldData>\n");
    for (const auto& array : m_numbers)
        out.announce("Name=" + quote(array.name) + " NumberOfTuples=\"" +
                         std::to_string(array.values.size()) + "\"",
                     array.values);
    for (const auto& [name, values] : m_texts) {
        std::string codes;
        for (const std::string& value : values) {
            for (const char c : value) codes += std::to_string(int((unsigned char)(c))) + " ";
            codes += "0 ";
        }
        out.text("<Array type=\"String\" Name=" + quote(name) + " NumberOfTuples=\"" +
                 std::to_string(values.size()) + "\" format=\"ascii\">" + codes + "</Array>\n");
    }
    out.text("</FieldData>\n<Piece NumberOfPoints=\"" + std::to_string(m_mesh.numNodes()) +
             "\" NumberOfCells=\"" + std::to_string(types.size()) + "\">\n<PointData>\n");
    for (const auto& array : m_indices) out.announce("Name=" + quote(array.name), array.values);
    for (const auto& array : m_fields)
        out.announce("Name=" + quote(array.name) + " NumberOfComponents=\"" +
                         std::to_string(array.components) + "\"" +
                         (array.components == 6 ? TensorNames : ""),
                     array.values);
    out.text("</PointData>\n<Points>\n");
    out.announce("Name=\"Points\" NumberOfComponents=\"3\"",
                 m_points.empty() ? m_mesh.positions : m_points);
    out.text("</Points>\n<Cells>\n");
    out.announce("Name=\"connectivity\"", connectivity);
    out.announce("Name=\"offsets\"", offsets);
    out.announce("Name=\"types\"", types);
    out.text("</Cells>\n</Piece>\n</UnstructuredGrid>\n");
    out.writeData();
    out.text("</VTKFile>\n");
    if (!out.finish())
        throw std::runtime_error("cannot write '" + path +
                                 "': no such folder, or the disk is full");
    unfinished.finish(Durability::ProcessEnd);
}

void writeVtu(const std::string& path, const ReducedBody& part) {
    part.validate();
    const size_t numNodes = size_t(part.mesh.numNodes());
    VtuFile file(part.mesh);
    std::vector<double> deck = part.mesh.positions;
    for (size_t i = 0; i < deck.size(); ++i) deck[i] += part.centerOfMass[i % 3];
    file.setPoints(std::move(deck));

    file.addPointNumbers("node number", part.mesh.nodeNumbers);
    std::vector<int> tied(numNodes, 0);
    std::vector<std::string> names;
    for (size_t k = 0; k < part.interfaces.size(); ++k) {
        names.push_back(part.interfaces[k].name);
        for (const int node : part.interfaces[k].nodes) tied[size_t(node)] = int(k) + 1;
    }
    file.addPointNumbers("interface", std::move(tied));

    const std::vector<double> hertz = calcFrequencies(part);
    std::vector<std::string> labels;
    for (int i = 0; i < part.numModes; ++i)
        labels.push_back(formatModeNumber(i + 1, part.numModes) + " " +
                         formatFrequency(hertz[size_t(i)]));
    for (size_t i = 0; i < labels.size(); ++i) {
        const auto first = part.Phi.begin() + std::ptrdiff_t(3 * numNodes * i);
        file.addPointField("mode " + labels[i], 3,
                           std::vector<float>(first, first + std::ptrdiff_t(3 * numNodes)));
    }
    if (part.modalStress) {
        const ReducedBody::ModalStress& modal = *part.modalStress;
        for (size_t i = 0; i < labels.size(); ++i) {
            const float none = std::numeric_limits<float>::quiet_NaN();
            std::vector<float> stress(6 * numNodes, none), vonMises(numNodes, none);
            for (size_t k = 0; k < modal.nodes.size(); ++k) {
                std::array<double, 6> tensor{};
                for (size_t c = 0; c < 6; ++c) {
                    const float value = modal.stress[6 * (modal.nodes.size() * i + k) + c];
                    stress[6 * size_t(modal.nodes[k]) + c] = value;
                    tensor[c] = double(value);
                }
                vonMises[size_t(modal.nodes[k])] = float(calcVonMises(tensor));
            }
            file.addPointField("stress " + labels[i], 6, std::move(stress));
            file.addPointField("von Mises " + labels[i], 1, std::move(vonMises));
        }
    }
    file.addNumbers("frequency [Hz]", hertz);
    file.addTexts("interface names", std::move(names));
    file.addTexts("part", {part.name});
    file.addTexts("source", {part.provenance.source});
    file.write(path);
}

}  // namespace simflex
