#pragma once
/** @file
Makes a Simbody program headless without changes to its source. Included after Simbody.h (or passed
to the compiler as `-include simflex/render/Headless.h`), it replaces `Visualizer` by
simflex::OffscreenVisualizer in the rest of the file, and thus `Visualizer::Reporter` by
FrameReporter. Not for use in headers. **/

#include "Simbody.h"
#include "simflex/base/SimbodyBuild.h"
#include "simflex/render/FrameController.h"
#include "simflex/render/FrameReporter.h"
#include "simflex/render/InputSilo.h"
#include "simflex/render/OffscreenVisualizer.h"

namespace SimTK {
using simflex::OffscreenVisualizer;
}

#define Visualizer OffscreenVisualizer
