#pragma once
/** @file
Makes a Simbody program headless without touching its source: included after Simbody.h (or given
to the compiler as `-include simflex/render/Headless.h`), it lets `Visualizer` stand for
simflex::OffscreenVisualizer in the rest of the file, and so `Visualizer::Reporter` for
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
