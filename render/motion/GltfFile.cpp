#include "GltfFile.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>

#include "simflex/base/UnfinishedFile.h"

namespace simflex {

namespace {

constexpr int FloatType = 5126, UnsignedIntType = 5125, UnsignedShortType = 5123;

std::size_t countComponents(const std::string& type) {
    static const std::map<std::string, std::size_t> counts = {
        {"SCALAR", 1}, {"VEC3", 3}, {"VEC4", 4}};
    return counts.at(type);
}

void append(std::vector<std::uint8_t>& bytes, std::uint32_t number) {
    for (int shift = 0; shift < 32; shift += 8) bytes.push_back(std::uint8_t(number >> shift));
}

void pad(std::vector<std::uint8_t>& bytes, std::uint8_t with) {
    while (bytes.size() % 4 != 0) bytes.push_back(with);
}

}  // namespace

int GltfFile::addView(const void* bytes, std::size_t size, Target target) {
    Json view = Json::object();
    view.add("buffer", 0).add("byteOffset", int(m_bytes.size())).add("byteLength", int(size));
    if (target != Target::None) view.add("target", int(target));
    const auto* first = static_cast<const std::uint8_t*>(bytes);
    m_bytes.insert(m_bytes.end(), first, first + size);
    pad(m_bytes, 0);
    if (m_bytes.size() > std::size_t(1) << 30)
        throw std::runtime_error("the animation takes more than 1 GB: fewer times or parts do");
    return add("bufferViews", std::move(view));
}

int GltfFile::addFloats(const std::vector<float>& values, const std::string& type, Target target,
                        bool bounds) {
    const std::size_t width = countComponents(type), count = values.size() / width;
    Json accessor = Json::object();
    accessor.add("bufferView", addView(values.data(), values.size() * sizeof(float), target))
        .add("componentType", FloatType)
        .add("count", int(count))
        .add("type", type);
    if (bounds) {
        std::vector<double> least(width, values.empty() ? 0 : INFINITY);
        std::vector<double> largest(width, values.empty() ? 0 : -INFINITY);
        for (std::size_t i = 0; i < values.size(); ++i) {
            least[i % width] = std::min(least[i % width], double(values[i]));
            largest[i % width] = std::max(largest[i % width], double(values[i]));
        }
        accessor.add("min", least).add("max", largest);
    }
    return add("accessors", std::move(accessor));
}

int GltfFile::addIndices(const std::vector<std::uint32_t>& values) {
    Json accessor = Json::object();
    accessor
        .add("bufferView",
             addView(values.data(), values.size() * sizeof(values[0]), Target::Triangles))
        .add("componentType", UnsignedIntType)
        .add("count", int(values.size()))
        .add("type", "SCALAR");
    return add("accessors", std::move(accessor));
}

int GltfFile::addColors(const std::vector<float>& values) {
    std::vector<std::uint16_t> numbers;
    numbers.reserve(values.size());
    for (const float value : values)
        numbers.push_back(std::uint16_t(std::lround(65535 * std::clamp(value, 0.0f, 1.0f))));
    Json accessor = Json::object();
    accessor
        .add("bufferView",
             addView(numbers.data(), numbers.size() * sizeof(numbers[0]), Target::Vertices))
        .add("componentType", UnsignedShortType)
        .add("normalized", true)
        .add("count", int(numbers.size() / 4))
        .add("type", "VEC4");
    return add("accessors", std::move(accessor));
}

int GltfFile::add(const std::string& array, Json item) {
    for (auto& [name, items] : m_arrays)
        if (name == array) {
            items.push_back(std::move(item));
            return int(items.size()) - 1;
        }
    m_arrays.push_back({array, {std::move(item)}});
    return 0;
}

int GltfFile::getNumber(const std::string& array) const {
    for (const auto& [name, items] : m_arrays)
        if (name == array) return int(items.size());
    return 0;
}

void GltfFile::write(const std::string& path, Json asset, const Json& scene) const {
    asset.add("version", "2.0").add("generator", "simflex");
    Json root = Json::object();
    Json buffer = Json::object(), buffers = Json::list(), scenes = Json::list();
    buffer.add("byteLength", int(m_bytes.size()));
    buffers.add(std::move(buffer));
    scenes.add(scene);
    root.add("asset", std::move(asset)).add("scene", 0).add("scenes", std::move(scenes));
    for (const auto& [name, items] : m_arrays) {
        Json list = Json::list();
        for (const Json& item : items) list.add(item);
        root.add(name, std::move(list));
    }
    if (!m_bytes.empty()) root.add("buffers", std::move(buffers));

    const std::string text = root.write(0);
    std::vector<std::uint8_t> json(text.begin(), text.end());
    pad(json, ' ');
    std::vector<std::uint8_t> file;
    const std::size_t size = 12 + 8 + json.size() + (m_bytes.empty() ? 0 : 8 + m_bytes.size());
    append(file, 0x46546C67);  // "glTF"
    append(file, 2);
    append(file, std::uint32_t(size));
    append(file, std::uint32_t(json.size()));
    append(file, 0x4E4F534A);  // "JSON"
    file.insert(file.end(), json.begin(), json.end());
    if (!m_bytes.empty()) {
        append(file, std::uint32_t(m_bytes.size()));
        append(file, 0x004E4942);  // "BIN"
        file.insert(file.end(), m_bytes.begin(), m_bytes.end());
    }
    replaceFile(path, file);
}

}  // namespace simflex
