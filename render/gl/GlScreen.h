#pragma once
/** @file
A triangle that covers the picture and a square, for shaders that need no other shape. Internal to
the renderer. **/

#include "GlFunctions.h"

namespace simflex {

class GlScreen {
public:
    explicit GlScreen(const GlFunctions& gl);
    ~GlScreen();
    GlScreen(const GlScreen&) = delete;
    GlScreen& operator=(const GlScreen&) = delete;

    /** Every pixel of the target; vertices are numbered, they have no attributes. **/
    void drawAll() const;

    /** Corners ±1, attribute 0. **/
    void drawSquare() const;

private:
    const GlFunctions& gl;
    GLuint emptyArray = 0, squareArray = 0, squareBuffer = 0;
};

}  // namespace simflex
