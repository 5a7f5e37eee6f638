#pragma once
/** @file
Draws lines and points of given screen size. Internal to the renderer. **/

#include <vector>

#include "GlProgram.h"
#include "GlView.h"
#include "simflex/render/scene/Scene.h"

namespace simflex {

class GlMarks {
public:
    explicit GlMarks(const GlFunctions& gl);
    ~GlMarks();
    GlMarks(const GlMarks&) = delete;
    GlMarks& operator=(const GlMarks&) = delete;

    /** Opaque marks hide objects behind them that are drawn later. **/
    void draw(const Scene& scene, const GlView& view);

private:
    void drawLines(const Scene& scene, const GlView& view, bool isOpaque);
    void drawPoints(const Scene& scene, const GlView& view, bool isOpaque);
    void drawInstances(const std::vector<int>& sizes);

    const GlFunctions& gl;
    GlProgram lineProgram, pointProgram;
    GLuint array = 0, buffer = 0;
    std::vector<float> data;
};

}  // namespace simflex
