#pragma once
/** @file
Order-independent transparency by per-pixel fragment lists. Internal to the renderer.

All transparent surfaces are drawn once. Their fragments are not blended but appended to a list of
their pixel, each with its depth as a plane and the samples it covers (J. C. Yang et al., Real-time
concurrent linked list construction on the GPU, EGSR 2010). Each pixel, or each of its samples if
these differ, then sorts and blends them. The cost is linear in the number of fragments, not
quadratic as with depth peeling. **/

#include <cstdint>
#include <functional>
#include <vector>

#include "GlProgram.h"
#include "GlScreen.h"
#include "GlView.h"

namespace simflex {

class GlFragments {
public:
    static constexpr int maxLayers = 32;  ///< number of nearest layers shown per sample
    static constexpr unsigned defaultMaxNumber = 5'000'000;

    /** Returns whether the context supports fragment lists: OpenGL 4.3, large texture buffers,
    coverage after the depth test. **/
    static bool isSupported(const GlFunctions& gl);

    GlFragments(const GlFunctions& gl, const GlScreen& screen);
    ~GlFragments();
    GlFragments(const GlFragments&) = delete;
    GlFragments& operator=(const GlFragments&) = delete;

    /** Blends the items drawn by `drawItems` with useProgram() over a rectangle of the bound scene.
    `drawItems` may be called several times. **/
    void draw(const GlRectangle& rectangle, const std::function<void()>& drawItems);

    /** Returns the program for the next item.
    @param rank  order of fragments at equal depth: the lower is in front **/
    GlProgram& useProgram(int rank);

    /** Limits the fragments, and lists, held at a time; larger pictures are drawn in strips. **/
    void setMaxNumber(unsigned number);

private:
    enum Content { Lists, Fragments, Slopes };

    unsigned gather(const GlRectangle& strip, const std::function<void()>& drawItems);
    void reserve(unsigned number);

    const GlFunctions& gl;
    const GlScreen& screen;
    GlProgram appendProgram, layPixelsProgram, laySamplesProgram;
    GLuint buffers[3], textures[3];  // by Content; shaders read the textures
    unsigned capacity = 0, maxNumber = defaultMaxNumber;
    std::vector<std::uint32_t> zeros;
};

}  // namespace simflex
