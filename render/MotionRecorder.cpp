#include "simflex/render/MotionRecorder.h"

#include <algorithm>
#include <stdexcept>
#include <string>

#include "simflex/body/FlexibleBodySubsystem.h"

namespace simflex {

void MotionRecorder::record(const SimTK::State& recorded) {
    if (records.empty()) {
        state = recorded;
    } else if (recorded.getNQ() != state.getNQ() || recorded.getNU() != state.getNU() ||
               recorded.getNZ() != state.getNZ()) {
        const auto describe = [](const SimTK::State& s) {
            return std::to_string(s.getNQ()) + " q, " + std::to_string(s.getNU()) + " u and " +
                   std::to_string(s.getNZ()) + " z";
        };
        throw std::invalid_argument("MotionRecorder: a State with " + describe(recorded) +
                                    ", but the first one has " + describe(state));
    }
    Record record;
    record.time = recorded.getTime();
    record.stage = recorded.getSystemStage();
    const SimTK::Vector& y = recorded.getY();
    for (int i = 0; i < y.size(); ++i) record.variables.push_back(y[i]);
    if (const auto* flexible = FlexibleBodySubsystem::find(*system))
        record.holding = flexible->getHolding(recorded);
    records.push_back(std::move(record));
}

void MotionRecorder::clear() {
    records.clear();
}

const SimTK::State& MotionRecorder::getState(int i) const {
    const Record& record = records.at(std::size_t(i));
    if (const auto* flexible = FlexibleBodySubsystem::find(*system)) {
        const SimTK::Vector held = flexible->getHolding(state);
        if (held.size() > 0 && (held - record.holding).normInf() != 0) {
            flexible->setHolding(state, record.holding);
            system->realizeModel(state);
        }
    }
    state.setTime(record.time);
    SimTK::Vector& y = state.updY();
    for (int k = 0; k < y.size(); ++k) y[k] = record.variables[std::size_t(k)];
    system->realize(state, std::max(SimTK::Stage(SimTK::Stage::Position), record.stage));
    return state;
}

}  // namespace simflex
