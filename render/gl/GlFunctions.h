#pragma once
/** @file
The OpenGL 3.3 core functions that the renderer uses, loaded from a context. Internal to the
renderer: nothing else in the library includes an OpenGL header, and none is linked. **/

#include <GL/glcorearb.h>

#include <functional>

// X(name as in glName, NAME as in PFNGLNAMEPROC)
#define SIMFLEX_GL_FUNCTIONS(X)                         \
    X(ActiveTexture, ACTIVETEXTURE)                     \
    X(AttachShader, ATTACHSHADER)                       \
    X(BeginQuery, BEGINQUERY)                           \
    X(BindBuffer, BINDBUFFER)                           \
    X(BindBufferBase, BINDBUFFERBASE)                   \
    X(BindFramebuffer, BINDFRAMEBUFFER)                 \
    X(BindRenderbuffer, BINDRENDERBUFFER)               \
    X(BindTexture, BINDTEXTURE)                         \
    X(BindVertexArray, BINDVERTEXARRAY)                 \
    X(BlendFunc, BLENDFUNC)                             \
    X(BlendFuncSeparate, BLENDFUNCSEPARATE)             \
    X(BlitFramebuffer, BLITFRAMEBUFFER)                 \
    X(BufferData, BUFFERDATA)                           \
    X(BufferSubData, BUFFERSUBDATA)                     \
    X(CheckFramebufferStatus, CHECKFRAMEBUFFERSTATUS)   \
    X(Clear, CLEAR)                                     \
    X(ClearColor, CLEARCOLOR)                           \
    X(ColorMask, COLORMASK)                             \
    X(CompileShader, COMPILESHADER)                     \
    X(CreateProgram, CREATEPROGRAM)                     \
    X(CreateShader, CREATESHADER)                       \
    X(CullFace, CULLFACE)                               \
    X(DeleteBuffers, DELETEBUFFERS)                     \
    X(DeleteFramebuffers, DELETEFRAMEBUFFERS)           \
    X(DeleteProgram, DELETEPROGRAM)                     \
    X(DeleteQueries, DELETEQUERIES)                     \
    X(DeleteRenderbuffers, DELETERENDERBUFFERS)         \
    X(DeleteShader, DELETESHADER)                       \
    X(DeleteTextures, DELETETEXTURES)                   \
    X(DeleteVertexArrays, DELETEVERTEXARRAYS)           \
    X(DepthFunc, DEPTHFUNC)                             \
    X(DepthMask, DEPTHMASK)                             \
    X(Disable, DISABLE)                                 \
    X(DrawArrays, DRAWARRAYS)                           \
    X(DrawArraysInstanced, DRAWARRAYSINSTANCED)         \
    X(DrawElements, DRAWELEMENTS)                       \
    X(Enable, ENABLE)                                   \
    X(EnableVertexAttribArray, ENABLEVERTEXATTRIBARRAY) \
    X(EndQuery, ENDQUERY)                               \
    X(FramebufferRenderbuffer, FRAMEBUFFERRENDERBUFFER) \
    X(FramebufferTexture2D, FRAMEBUFFERTEXTURE2D)       \
    X(GenBuffers, GENBUFFERS)                           \
    X(GenFramebuffers, GENFRAMEBUFFERS)                 \
    X(GenQueries, GENQUERIES)                           \
    X(GenRenderbuffers, GENRENDERBUFFERS)               \
    X(GenTextures, GENTEXTURES)                         \
    X(GenVertexArrays, GENVERTEXARRAYS)                 \
    X(GenerateMipmap, GENERATEMIPMAP)                   \
    X(GetBufferSubData, GETBUFFERSUBDATA)               \
    X(GetError, GETERROR)                               \
    X(GetFloatv, GETFLOATV)                             \
    X(GetIntegerv, GETINTEGERV)                         \
    X(GetMultisamplefv, GETMULTISAMPLEFV)               \
    X(GetProgramInfoLog, GETPROGRAMINFOLOG)             \
    X(GetProgramiv, GETPROGRAMIV)                       \
    X(GetQueryObjectuiv, GETQUERYOBJECTUIV)             \
    X(GetShaderInfoLog, GETSHADERINFOLOG)               \
    X(GetShaderiv, GETSHADERIV)                         \
    X(GetStringi, GETSTRINGI)                           \
    X(GetUniformLocation, GETUNIFORMLOCATION)           \
    X(LineWidth, LINEWIDTH)                             \
    X(LinkProgram, LINKPROGRAM)                         \
    X(PixelStorei, PIXELSTOREI)                         \
    X(PointSize, POINTSIZE)                             \
    X(ReadPixels, READPIXELS)                           \
    X(RenderbufferStorage, RENDERBUFFERSTORAGE)         \
    X(Scissor, SCISSOR)                                 \
    X(ShaderSource, SHADERSOURCE)                       \
    X(TexBuffer, TEXBUFFER)                             \
    X(TexImage2D, TEXIMAGE2D)                           \
    X(TexImage2DMultisample, TEXIMAGE2DMULTISAMPLE)     \
    X(TexParameteri, TEXPARAMETERI)                     \
    X(Uniform1f, UNIFORM1F)                             \
    X(Uniform1i, UNIFORM1I)                             \
    X(Uniform2f, UNIFORM2F)                             \
    X(Uniform3f, UNIFORM3F)                             \
    X(Uniform4f, UNIFORM4F)                             \
    X(Uniform4i, UNIFORM4I)                             \
    X(UniformMatrix3fv, UNIFORMMATRIX3FV)               \
    X(UniformMatrix4fv, UNIFORMMATRIX4FV)               \
    X(UseProgram, USEPROGRAM)                           \
    X(VertexAttribDivisor, VERTEXATTRIBDIVISOR)         \
    X(VertexAttribPointer, VERTEXATTRIBPOINTER)         \
    X(Viewport, VIEWPORT)

// Functions of later versions: null in older contexts.
#define SIMFLEX_GL_LATER_FUNCTIONS(X) X(MemoryBarrier, MEMORYBARRIER)

namespace simflex {

/** Function pointers, named as in OpenGL without prefix: `gl.Clear(...)`. **/
struct GlFunctions {
#define SIMFLEX_GL_MEMBER(name, NAME) PFNGL##NAME##PROC name = nullptr;
    SIMFLEX_GL_FUNCTIONS(SIMFLEX_GL_MEMBER)
    SIMFLEX_GL_LATER_FUNCTIONS(SIMFLEX_GL_MEMBER)
#undef SIMFLEX_GL_MEMBER

    using ProcAddress = void (*)();

    /** Loads all functions, those of later versions if available.
    @throws std::runtime_error naming the first function that the context lacks. **/
    void load(const std::function<ProcAddress(const char*)>& getProcAddress);
};

}  // namespace simflex
