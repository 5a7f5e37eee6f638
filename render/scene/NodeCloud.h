#pragma once
/** @file
Parts without elements (matrices with a list of nodes): one dot per node. Internal to the
renderer. **/

#include "FrameStyle.h"
#include "Scene.h"

namespace simflex {

/** Appends a dot for each vertex of a geometry without triangles, in the item's colours. **/
void appendNodeCloud(const SurfaceItem& item, const FrameStyle& style, Scene& scene);

}  // namespace simflex
