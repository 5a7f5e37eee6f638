#pragma once
/** @file
GLSL sources of the renderer, in version 3.30 but for lists of fragments. Internal. **/

#include <initializer_list>
#include <string>

namespace simflex {
namespace shaders {

std::string compose(std::initializer_list<const char*> parts);

// Parts of sources: a version, functions, a main().
extern const char* const version330;
extern const char* const version430;           ///< with coverage after the depth test
extern const char* const lighting;             ///< what falls on a surface
extern const char* const baseColor;            ///< plain, or of the contour
extern const char* const surfaceShade;         ///< after both: light, contour, ghost
extern const char* const surfaceFragment;      ///< after surfaceShade
extern const char* const fragmentLists;        ///< of 4.30: what is transparent, by pixels
extern const char* const appendFragment;       ///< after it and surfaceShade: fills the lists
extern const char* const sortFragments;        ///< after fragmentLists: a list in order
extern const char* const layPixels;            ///< after sortFragments: lays lists over the picture
extern const char* const laySamples;           ///< the same for lists that differ within a pixel
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
extern const char* const textVertex;            ///< textured rectangle in space
extern const char* const textFragment;

}  // namespace shaders
}  // namespace simflex
