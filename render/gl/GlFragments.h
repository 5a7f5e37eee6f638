#pragma once
/** @file
What is transparent, gathered and sorted at each pixel.

All transparent surfaces are drawn once; their fragments are not blended but appended to a list of
their pixel, each with its depth as a plane and the samples that it covers (J. C. Yang et al.,
Real-time concurrent linked list construction on the GPU, EGSR 2010). Then each pixel, or each of
its samples where those differ, sorts them and lays them over each other. The cost grows with the
fragments, not with their square as that of peeling. Internal to the renderer. **/

#include <cstdint>
#include <functional>
#include <vector>

#include "GlProgram.h"
#include "GlScreen.h"
#include "GlView.h"

namespace simflex {

class GlFragments {
public:
    static constexpr int maxLayers = 32;  ///< the nearest that a sample shows
    static constexpr unsigned defaultMaxNumber = 5'000'000;

    /** Whether the context has what lists need: OpenGL 4.3, large texture buffers, coverage after
    the depth test. **/
    static bool isSupported(const GlFunctions& gl);

    GlFragments(const GlFunctions& gl, const GlScreen& screen);
    ~GlFragments();
    GlFragments(const GlFragments&) = delete;
    GlFragments& operator=(const GlFragments&) = delete;

    /** Lays what `drawItems` draws with useProgram() over a rectangle of the scene, which is bound.
    It may be called several times. **/
    void draw(const GlRectangle& rectangle, const std::function<void()>& drawItems);

    /** What draws the next item.
    @param rank  decides between fragments of the same depth: the lower is before **/
    GlProgram& useProgram(int rank);

    /** At most so many fragments, and lists, are held at a time; a picture with more is done in
    strips. **/
    void setMaxNumber(unsigned number);

private:
    enum Content { Lists, Fragments, Slopes };

    unsigned gather(const GlRectangle& strip, const std::function<void()>& drawItems);
    void reserve(unsigned number);

    const GlFunctions& gl;
    const GlScreen& screen;
    GlProgram appendProgram, layPixelsProgram, laySamplesProgram;
    GLuint buffers[3], textures[3];  // of each content; shaders read the textures
    unsigned capacity = 0, maxNumber = defaultMaxNumber;
    std::vector<std::uint32_t> zeros;
};

}  // namespace simflex
