#pragma once
/** @file
Writes binary glTF 2.0 files: buffers and the JSON that describes them. Internal to the renderer.
Khronos: glTF 2.0 Specification, https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html **/

#include <cstdint>
#include <string>
#include <vector>

#include "simflex/base/Json.h"

namespace simflex {

class GltfFile {
public:
    /** Purpose of a buffer view. **/
    enum class Target { None = 0, Vertices = 34962, Triangles = 34963 };

    /** Adds an accessor with its own buffer view. @param type  "SCALAR", "VEC3" …
    @param bounds  whether to include minimum and maximum, required for positions and times
    @return its index **/
    int addFloats(const std::vector<float>& values, const std::string& type, Target target,
                  bool bounds = false);
    int addIndices(const std::vector<std::uint32_t>& values);
    /** Adds VEC4 values from 0 to 1 in 16 bits. **/
    int addColors(const std::vector<float>& values);

    /** Adds an item to a named array of the format. @return its index in the array **/
    int add(const std::string& array, Json item);
    int getNumber(const std::string& array) const;

    /** Writes the file with `asset`. @throws std::runtime_error. **/
    void write(const std::string& path, Json asset, const Json& scene) const;

private:
    int addView(const void* bytes, std::size_t size, Target target);

    std::vector<std::uint8_t> m_bytes;
    std::vector<std::pair<std::string, std::vector<Json>>> m_arrays;
};

}  // namespace simflex
