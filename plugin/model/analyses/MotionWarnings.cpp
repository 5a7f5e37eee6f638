#include "simflex/model/analyses/MotionWarnings.h"

#include <cmath>
#include <sstream>

namespace simflex {
namespace model {

MotionWarnings::MotionWarnings(const Model& model, const Probes& probes, Warn warn)
    : _warn(std::move(warn)),
      _linearRange(model.getFlexibleBodies(), 1,
                   [this](const std::string& message) {
                       _warn(_isAtStart ? message + ' ' + getAdviceAtStart() : message);
                   }),
      _isNotFinite(probes.getProbes().size(), false) {
    for (size_t k = 0; k < probes.getProbes().size(); ++k) {
        const Probe& probe = probes.getProbes()[k];
        for (const std::string& column : probe.columns) {
            _columns.push_back(probe.name + "'" + (column.empty() ? "" : "." + column));
            _probeOfColumn.push_back(int(k));
        }
    }
}

const char* MotionWarnings::getAdviceAtStart() {
    return "It is bent so from the start: if its joints do not meet as placed, place the bodies so "
           "that they do.";
}

void MotionWarnings::check(const SimTK::State& state, const std::vector<double>& values,
                           const TurnCounter& turns) {
    const std::vector<std::string>& springs = turns.getOverturnedSprings();
    for (; _numOverturned < springs.size(); ++_numOverturned) {
        std::ostringstream message;
        message << "torsion spring '" << springs[_numOverturned]
                << "' has been turned by more than "
                << "half a turn from where it is free, before t = " << state.getTime()
                << " s: it does not count turns, its moment has changed sign there; divide the "
                   "angle among several springs in a row";
        _warn(message.str());
    }
    _linearRange.handleEvent(state);
    checkFinite(state.getTime(), values);
    _isAtStart = false;
}

void MotionWarnings::checkFinite(double time, const std::vector<double>& values) {
    for (size_t k = 0; k < values.size(); ++k) {
        const size_t probe = size_t(_probeOfColumn[k]);
        if (std::isfinite(values[k]) || _isNotFinite[probe]) continue;
        _isNotFinite[probe] = true;
        std::ostringstream text;
        text << "probe '" << _columns[k] << " is " << values[k] << " at t = " << time
             << " s: its formula, or what it is made of, has no finite value there";
        _warn(text.str());
    }
}

std::vector<double> MotionWarnings::save() const {
    std::vector<double> saved{double(_isAtStart), double(_numOverturned)};
    for (const bool isTold : _isNotFinite) saved.push_back(isTold);
    for (const auto& [body, isRotation] : _linearRange.getWarned())
        saved.insert(saved.end(), {double(body), double(isRotation)});
    return saved;
}

void MotionWarnings::restore(const std::vector<double>& saved) {
    const size_t numProbes = _isNotFinite.size();
    if (saved.size() < 2 + numProbes || (saved.size() - numProbes) % 2 != 0)
        throw std::invalid_argument("its warnings are of another model");
    _isAtStart = saved[0] != 0;
    _numOverturned = size_t(saved[1]);
    for (size_t k = 0; k < numProbes; ++k) _isNotFinite[k] = saved[2 + k] != 0;
    std::set<std::pair<int, bool>> warned;
    for (size_t k = 2 + numProbes; k < saved.size(); k += 2)
        warned.emplace(int(saved[k]), saved[k + 1] != 0);
    _linearRange.setWarned(warned);
}

}  // namespace model
}  // namespace simflex
