#pragma once
/** @file
GLSL sources of the renderer, version 3.30 except for fragment lists. Internal. **/

#include <initializer_list>
#include <string>

namespace simflex {
namespace shaders {

std::string compose(std::initializer_list<const char*> parts);

// Parts of sources: version, functions, main().
extern const char* const version330;
extern const char* const version430;           ///< with coverage after the depth test
extern const char* const lighting;             ///< light on a surface
extern const char* const baseColor;            ///< plain or contour colour
extern const char* const surfaceShade;         ///< after both: lighting, contour, ghost
extern const char* const surfaceFragment;      ///< after surfaceShade
extern const char* const fragmentLists;        ///< 4.30: transparent fragments by pixel
extern const char* const appendFragment;       ///< after fragmentLists and surfaceShade: fills the
                                               ///< lists
extern const char* const sortFragments;        ///< after fragmentLists: sorts a list
extern const char* const layPixels;            ///< after sortFragments: blends lists over the
                                               ///< picture
extern const char* const laySamples;           ///< the same for lists that differ within a pixel
extern const char* const fineSurfaceVertex;    ///< after lighting: per-vertex lighting
extern const char* const fineSurfaceFragment;  ///< after baseColor: per-vertex lighting

extern const char* const surfaceVertex;  ///< triangles and their edges, in camera frame
extern const char* const edgeVertex;
extern const char* const edgeFragment;  ///< single colour
extern const char* const lineVertex;    ///< lines of given width on screen, instanced
extern const char* const pointVertex;   ///< discs of given size on screen, instanced
extern const char* const pointFragment;
extern const char* const colorFragment;       ///< per-vertex colour
extern const char* const backgroundVertex;    ///< one triangle that covers the picture
extern const char* const backgroundFragment;  ///< vertical gradient
extern const char* const layerFragment;       ///< mean of a multisampled layer
extern const char* const depthOnlyFragment;
extern const char* const peelFragment;    ///< next layer of transparent surfaces
extern const char* const sampleFragment;  ///< copy of a multisampled layer
extern const char* const depthFragment;
extern const char* const distanceFragment;       ///< ambient occlusion: distances at half size
extern const char* const occlusionFragment;      ///< remaining light
extern const char* const occlusionBlurFragment;  ///< blur in one direction
extern const char* const darkenFragment;         ///< multiplies the picture by the light
extern const char* const groundVertex;
extern const char* const groundFragment;        ///< grid, faded edge
extern const char* const groundShadowFragment;  ///< light remaining in a shadow
extern const char* const textVertex;            ///< textured rectangle in space
extern const char* const textFragment;

}  // namespace shaders
}  // namespace simflex
