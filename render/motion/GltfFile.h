#pragma once
/** @file
A binary glTF 2.0 file: buffers and the JSON that describes them, no more. Internal to the renderer.

Khronos: glTF 2.0 Specification, https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html **/

#include <cstdint>
#include <string>
#include <vector>

#include "simflex/base/Json.h"

namespace simflex {

class GltfFile {
public:
    /** What a buffer view is for. **/
    enum class Target { None = 0, Vertices = 34962, Triangles = 34963 };

    /** Adds an accessor of its own buffer view. @param type  "SCALAR", "VEC3" …
    @param bounds  whether it says its least and largest values, as positions and times must
    @return its number **/
    int addFloats(const std::vector<float>& values, const std::string& type, Target target,
                  bool bounds = false);
    int addIndices(const std::vector<std::uint32_t>& values);
    /** From 0 to 1, in 16 bits; VEC4. **/
    int addColors(const std::vector<float>& values);

    /** Members of the arrays that the format names so. @return number in its array **/
    int add(const std::string& array, Json item);
    int getNumber(const std::string& array) const;

    /** Writes it, with `asset` besides. @throws std::runtime_error. **/
    void write(const std::string& path, Json asset, const Json& scene) const;

private:
    int addView(const void* bytes, std::size_t size, Target target);

    std::vector<std::uint8_t> m_bytes;
    std::vector<std::pair<std::string, std::vector<Json>>> m_arrays;
};

}  // namespace simflex
