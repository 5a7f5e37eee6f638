#include "simflex/body/StateCopy.h"

namespace simflex {

using SimTK::CacheEntryIndex;
using SimTK::State;
using SimTK::SubsystemIndex;

void copyState(const State& from, State& to) {
    if (&from == &to) return;
    to = from;
    for (SubsystemIndex s(0); s < to.getNumSubsystems(); ++s)
        for (CacheEntryIndex c(0); to.hasCacheEntry({s, c}); ++c)
            if (to.getCacheEntryInfo({s, c}).getDependsOnStage() > to.getSubsystemStage(s))
                to.markCacheValueNotRealized(s, c);
}

State copyState(const State& state) {
    State copy;
    copyState(state, copy);
    return copy;
}

}  // namespace simflex
