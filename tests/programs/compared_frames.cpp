// Linked to programs run by compare_programs: only their first picture is drawn.

#include <atomic>

#include "simflex/render/OffscreenVisualizer.h"

namespace simflex {

// Overrides the library's function, even for calls from the library.
void OffscreenVisualizer::report(const SimTK::State& state) const {
    static std::atomic<bool> isFirst{true};
    getSystem().realize(state, SimTK::Stage::Position);
    if (isFirst.exchange(false)) drawFrame(state);
}

}  // namespace simflex
