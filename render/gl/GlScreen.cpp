#include "GlScreen.h"

namespace simflex {

GlScreen::GlScreen(const GlFunctions& functions) : gl(functions) {
    gl.GenVertexArrays(1, &emptyArray);
    gl.GenVertexArrays(1, &squareArray);
    gl.GenBuffers(1, &squareBuffer);
    const float corners[] = {-1, -1, 1, -1, -1, 1, 1, 1};
    gl.BindVertexArray(squareArray);
    gl.BindBuffer(GL_ARRAY_BUFFER, squareBuffer);
    gl.BufferData(GL_ARRAY_BUFFER, sizeof corners, corners, GL_STATIC_DRAW);
    gl.EnableVertexAttribArray(0);
    gl.VertexAttribPointer(0, 2, GL_FLOAT, GL_FALSE, 0, nullptr);
}

GlScreen::~GlScreen() {
    gl.DeleteVertexArrays(1, &emptyArray);
    gl.DeleteVertexArrays(1, &squareArray);
    gl.DeleteBuffers(1, &squareBuffer);
}

void GlScreen::drawAll() const {
    gl.BindVertexArray(emptyArray);
    gl.DrawArrays(GL_TRIANGLES, 0, 3);
}

void GlScreen::drawSquare() const {
    gl.BindVertexArray(squareArray);
    gl.DrawArrays(GL_TRIANGLE_STRIP, 0, 4);
}

}  // namespace simflex
