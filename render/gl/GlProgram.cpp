#include "GlProgram.h"

#include <stdexcept>
#include <vector>

namespace simflex {

namespace {

GLuint compile(const GlFunctions& gl, GLenum kind, const std::string& text) {
    const char* source = text.c_str();
    const GLuint shader = gl.CreateShader(kind);
    gl.ShaderSource(shader, 1, &source, nullptr);
    gl.CompileShader(shader);
    GLint ok = 0;
    gl.GetShaderiv(shader, GL_COMPILE_STATUS, &ok);
    if (!ok) {
        std::vector<char> log(4096, '\0');
        gl.GetShaderInfoLog(shader, GLsizei(log.size() - 1), nullptr, log.data());
        gl.DeleteShader(shader);
        throw std::runtime_error(std::string("a shader does not compile: ") + log.data());
    }
    return shader;
}

}  // namespace

GlProgram::GlProgram(const GlFunctions& functions, const std::string& vertexSource,
                     const std::string& fragmentSource)
    : gl(functions) {
    const GLuint vertex = compile(gl, GL_VERTEX_SHADER, vertexSource);
    const GLuint fragment = compile(gl, GL_FRAGMENT_SHADER, fragmentSource);
    program = gl.CreateProgram();
    gl.AttachShader(program, vertex);
    gl.AttachShader(program, fragment);
    gl.LinkProgram(program);
    gl.DeleteShader(vertex);
    gl.DeleteShader(fragment);
    GLint ok = 0;
    gl.GetProgramiv(program, GL_LINK_STATUS, &ok);
    if (!ok) {
        std::vector<char> text(4096, '\0');
        gl.GetProgramInfoLog(program, GLsizei(text.size() - 1), nullptr, text.data());
        gl.DeleteProgram(program);
        throw std::runtime_error(std::string("a shader program does not link: ") + text.data());
    }
}

GlProgram::~GlProgram() {
    gl.DeleteProgram(program);
}

GLint GlProgram::find(const char* name) {
    const auto found = locations.find(name);
    if (found != locations.end()) return found->second;
    return locations[name] = gl.GetUniformLocation(program, name);
}

}  // namespace simflex
