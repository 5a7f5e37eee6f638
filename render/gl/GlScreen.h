#pragma once
/** @file
A triangle that covers the picture and a square, for full-screen shaders. Internal to the
renderer. **/

#include "GlFunctions.h"

namespace simflex {

class GlScreen {
public:
    explicit GlScreen(const GlFunctions& gl);
    ~GlScreen();
    GlScreen(const GlScreen&) = delete;
    GlScreen& operator=(const GlScreen&) = delete;

    /** Draws every pixel of the target; vertices are numbered and have no attributes. **/
    void drawAll() const;

    /** Draws a square with corners ±1 in attribute 0. **/
    void drawSquare() const;

private:
    const GlFunctions& gl;
    GLuint emptyArray = 0, squareArray = 0, squareBuffer = 0;
};

}  // namespace simflex
