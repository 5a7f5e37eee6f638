// Linked to programs that compare_programs runs: of their pictures, only the first is drawn.

#include <atomic>

#include "simflex/render/OffscreenVisualizer.h"

namespace simflex {

// Called instead of the library's, by the library too.
void OffscreenVisualizer::report(const SimTK::State& state) const {
    static std::atomic<bool> isFirst{true};
    getSystem().realize(state, SimTK::Stage::Position);
    if (isFirst.exchange(false)) drawFrame(state);
}

}  // namespace simflex
