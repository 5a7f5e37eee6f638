#pragma once
/** @file
GLSL 3.30 sources of the renderer. Internal. **/

namespace simflex {
namespace shaders {

// Parts of sources that follow "#version 330 core": functions, then a main().
extern const char* const lighting;             ///< what falls on a surface
extern const char* const baseColor;            ///< plain, or of the contour
extern const char* const surfaceFragment;      ///< after both: light, contour, ghost
extern const char* const fineSurfaceVertex;    ///< after lighting: light found at vertices
extern const char* const fineSurfaceFragment;  ///< after baseColor: light of vertices

extern const char* const surfaceVertex;  ///< triangles and their edges, in camera frame
extern const char* const edgeVertex;
extern const char* const edgeFragment;  ///< one colour
extern const char* const lineVertex;    ///< lines of given width on screen, instanced
extern const char* const pointVertex;   ///< discs of given size on screen, instanced
extern const char* const pointFragment;
extern const char* const colorFragment;       ///< colour per vertex
extern const char* const backgroundVertex;    ///< one triangle that covers the picture
extern const char* const backgroundFragment;  ///< vertical gradient
extern const char* const layerFragment;       ///< mean of a multisampled layer
extern const char* const depthOnlyFragment;
extern const char* const peelFragment;    ///< next layer of what is transparent
extern const char* const sampleFragment;  ///< copy of a multisampled layer
extern const char* const depthFragment;
extern const char* const distanceFragment;       ///< ambient occlusion: distances at half size
extern const char* const occlusionFragment;      ///< light that is left
extern const char* const occlusionBlurFragment;  ///< one direction of its blur
extern const char* const darkenFragment;         ///< what is drawn times it
extern const char* const groundVertex;
extern const char* const groundFragment;        ///< grid, fading edge
extern const char* const groundShadowFragment;  ///< what a shadow leaves of the light
extern const char* const shadowVertex;          ///< projection along the light onto the ground
extern const char* const shadowFragment;
extern const char* const blurFragment;  ///< one direction of a Gaussian blur
extern const char* const textVertex;    ///< textured rectangle in space
extern const char* const textFragment;

}  // namespace shaders
}  // namespace simflex
