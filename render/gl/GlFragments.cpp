#include "GlFragments.h"

#include <algorithm>
#include <cstring>

#include "Shaders.h"

namespace simflex {

bool GlFragments::isSupported(const GlFunctions& gl) {
    GLint major = 0, minor = 0, maxTexels = 0, numExtensions = 0;
    gl.GetIntegerv(GL_MAJOR_VERSION, &major);
    gl.GetIntegerv(GL_MINOR_VERSION, &minor);
    if (10 * major + minor < 43 || !gl.MemoryBarrier) return false;
    gl.GetIntegerv(GL_MAX_TEXTURE_BUFFER_SIZE, &maxTexels);
    if (maxTexels <= GLint(defaultMaxNumber)) return false;
    gl.GetIntegerv(GL_NUM_EXTENSIONS, &numExtensions);
    for (GLint i = 0; i < numExtensions; ++i) {
        const GLubyte* name = gl.GetStringi(GL_EXTENSIONS, GLuint(i));
        if (!std::strcmp(reinterpret_cast<const char*>(name), "GL_ARB_post_depth_coverage"))
            return true;
    }
    return false;
}

GlFragments::GlFragments(const GlFunctions& functions, const GlScreen& sharedScreen)
    : gl(functions),
      screen(sharedScreen),
      appendProgram(
          gl, shaders::surfaceVertex,
          shaders::compose({shaders::version430, shaders::fragmentLists, shaders::lighting,
                            shaders::baseColor, shaders::surfaceShade, shaders::appendFragment})),
      layPixelsProgram(gl, shaders::backgroundVertex,
                       shaders::compose({shaders::version430, shaders::fragmentLists,
                                         shaders::sortFragments, shaders::layPixels})),
      laySamplesProgram(gl, shaders::backgroundVertex,
                        shaders::compose({shaders::version430, shaders::fragmentLists,
                                          shaders::sortFragments, shaders::laySamples})) {
    gl.GenBuffers(3, buffers);
    gl.GenTextures(3, textures);
    for (int i = 0; i < 3; ++i) {
        gl.BindBuffer(GL_TEXTURE_BUFFER, buffers[i]);
        gl.BindTexture(GL_TEXTURE_BUFFER, textures[i]);
        const GLenum formats[] = {GL_R32UI, GL_RGBA32UI, GL_RG32F};
        gl.TexBuffer(GL_TEXTURE_BUFFER, formats[i], buffers[i]);
    }
}

GlFragments::~GlFragments() {
    gl.DeleteTextures(3, textures);
    gl.DeleteBuffers(3, buffers);
}

void GlFragments::setMaxNumber(unsigned number) {
    maxNumber = number;
    if (capacity > maxNumber) capacity = 0;
}

void GlFragments::reserve(unsigned number) {
    if (number <= capacity) return;
    capacity = number;
    const auto allocate = [&](Content content, std::size_t bytes) {
        gl.BindBuffer(GL_SHADER_STORAGE_BUFFER, buffers[content]);
        gl.BufferData(GL_SHADER_STORAGE_BUFFER, GLsizeiptr(bytes * capacity), nullptr,
                      GL_DYNAMIC_COPY);
    };
    allocate(Fragments, 16);
    allocate(Slopes, 8);
}

GlProgram& GlFragments::useProgram(int rank) {
    appendProgram.use();
    appendProgram.set("rank", rank);
    return appendProgram;
}

unsigned GlFragments::gather(const GlRectangle& strip, const std::function<void()>& drawItems) {
    zeros.assign(1 + std::size_t(strip.right - strip.left) * (strip.top - strip.bottom), 0);
    for (const Content content : {Fragments, Slopes, Lists})
        gl.BindBufferBase(GL_SHADER_STORAGE_BUFFER, content, buffers[content]);
    gl.BufferData(GL_SHADER_STORAGE_BUFFER, GLsizeiptr(zeros.size() * sizeof zeros[0]),
                  zeros.data(), GL_DYNAMIC_COPY);
    constexpr int border = 2;  // Mesa omits the outermost samples
    gl.Scissor(strip.left - border, strip.bottom - border, strip.right - strip.left + 2 * border,
               strip.top - strip.bottom + 2 * border);
    gl.ColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
    appendProgram.use();
    appendProgram.set("area", strip.left, strip.bottom, strip.right, strip.top);
    appendProgram.set("capacity", int(capacity));
    drawItems();
    gl.ColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    gl.MemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT | GL_BUFFER_UPDATE_BARRIER_BIT);
    GLuint number = 0;
    gl.BindBuffer(GL_SHADER_STORAGE_BUFFER, buffers[Lists]);
    gl.GetBufferSubData(GL_SHADER_STORAGE_BUFFER, 0, sizeof number, &number);
    return number;
}

void GlFragments::draw(const GlRectangle& rectangle, const std::function<void()>& drawItems) {
    const int width = rectangle.right - rectangle.left;
    int rows = std::min(rectangle.top - rectangle.bottom, std::max(1, int(maxNumber) / width));
    reserve(std::min(maxNumber, 4 * unsigned(width) * unsigned(rows)));
    gl.Enable(GL_SCISSOR_TEST);
    GlRectangle strip = rectangle;
    while (strip.bottom < rectangle.top) {
        strip.top = std::min(rectangle.top, strip.bottom + rows);
        const unsigned number = gather(strip, drawItems);
        if (number > capacity) {
            if (number <= maxNumber) {
                reserve(std::min(maxNumber, number + number / 4));
                continue;
            }
            reserve(maxNumber);
            if (rows > 1) {
                rows = std::max(1, int(0.8 * (strip.top - strip.bottom) * maxNumber / number));
                continue;
            }
        }
        gl.Disable(GL_DEPTH_TEST);
        gl.BlendFunc(GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
        for (int i = 0; i < 3; ++i) {
            gl.ActiveTexture(GLenum(GL_TEXTURE0 + i));
            gl.BindTexture(GL_TEXTURE_BUFFER, textures[i]);
        }
        for (GlProgram* program : {&layPixelsProgram, &laySamplesProgram}) {
            program->use();
            program->set("area", strip.left, strip.bottom, strip.right, strip.top);
            program->set("listTexels", int(Lists));
            program->set("fragmentTexels", int(Fragments));
            program->set("slopeTexels", int(Slopes));
            screen.drawAll();
            gl.MemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT);
        }
        gl.Enable(GL_DEPTH_TEST);
        strip.bottom = strip.top;
    }
    gl.Disable(GL_SCISSOR_TEST);
    gl.BlendFuncSeparate(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
}

}  // namespace simflex
