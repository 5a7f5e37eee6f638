#pragma once
/** @file
Parts without elements, of which only nodes are known (matrices with a list of nodes): one dot a
node. Internal to the renderer. **/

#include "FrameStyle.h"
#include "Scene.h"

namespace simflex {

/** Appends a dot for each vertex of the item's geometry where that has no triangles, coloured like
the item. **/
void appendNodeCloud(const SurfaceItem& item, const FrameStyle& style, Scene& scene);

}  // namespace simflex
