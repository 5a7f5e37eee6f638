#pragma once
/** @file
A compiled and linked pair of shaders, with its uniforms by name. Internal to the renderer. **/

#include <array>
#include <map>
#include <string>

#include "GlFunctions.h"
#include "SimTKcommon.h"

namespace simflex {

class GlProgram {
public:
    /** @throws std::runtime_error with the compiler's message. **/
    GlProgram(const GlFunctions& gl, const std::string& vertexSource,
              const std::string& fragmentSource);
    ~GlProgram();
    GlProgram(const GlProgram&) = delete;
    GlProgram& operator=(const GlProgram&) = delete;

    void use() const { gl.UseProgram(program); }

    /** @name Uniforms. @pre the program is in use **/
    /**@{**/
    void set(const char* name, int value) { gl.Uniform1i(find(name), value); }
    void set(const char* name, bool value) { gl.Uniform1i(find(name), value ? 1 : 0); }
    void set(const char* name, double value) { gl.Uniform1f(find(name), float(value)); }
    void set(const char* name, double x, double y) { gl.Uniform2f(find(name), float(x), float(y)); }
    void set(const char* name, const SimTK::Vec2& v) {
        gl.Uniform2f(find(name), float(v[0]), float(v[1]));
    }
    void set(const char* name, const SimTK::Vec3& v) {
        gl.Uniform3f(find(name), float(v[0]), float(v[1]), float(v[2]));
    }
    void set(const char* name, double x, double y, double z, double w) {
        gl.Uniform4f(find(name), float(x), float(y), float(z), float(w));
    }
    void set(const char* name, int x, int y, int z, int w) { gl.Uniform4i(find(name), x, y, z, w); }
    void set(const char* name, const std::array<float, 9>& m) {
        gl.UniformMatrix3fv(find(name), 1, GL_FALSE, m.data());
    }
    void set(const char* name, const std::array<float, 16>& m) {
        gl.UniformMatrix4fv(find(name), 1, GL_FALSE, m.data());
    }
    /**@}**/

private:
    GLint find(const char* name);

    const GlFunctions& gl;
    GLuint program = 0;
    std::map<std::string, GLint, std::less<>> locations;
};

}  // namespace simflex
