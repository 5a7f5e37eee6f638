#include "simflex/model/analyses/MotionWarnings.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "simflex/base/NumberText.h"
#include "simflex/body/StressRecovery.h"

namespace simflex {
namespace model {

MotionWarnings::MotionWarnings(const Model& model, const Probes& probes, Warn warn)
    : m_warn(std::move(warn)),
      m_linearRange(model.getFlexibleBodies(), 1,
                    [this](const std::string& message) {
                        m_warn(m_isAtStart ? message + ' ' + getAdviceAtStart() : message);
                    }),
      m_model(model),
      m_turnsFast(model.getBodies().size(), false),
      m_isNotFinite(probes.getProbes().size(), false) {
    for (size_t k = 0; k < probes.getProbes().size(); ++k) {
        const Probe& probe = probes.getProbes()[k];
        for (const std::string& column : probe.columns) {
            m_columns.push_back(probe.name + "'" + (column.empty() ? "" : "." + column));
            m_probeOfColumn.push_back(int(k));
        }
    }
}

const char* MotionWarnings::getAdviceAtStart() {
    return "It is deformed like this from the start: if its joints do not meet as placed, place "
           "the bodies so that they do.";
}

void MotionWarnings::check(const SimTK::State& state, const std::vector<double>& values) {
    m_linearRange.handleEvent(state);
    checkTurning(state);
    checkElements(state);
    checkFinite(state.getTime(), values);
    m_isAtStart = false;
}

void MotionWarnings::checkTurning(const SimTK::State& state) {
    for (size_t b = 0; b < m_turnsFast.size(); ++b) {
        const Model::BodyEntry& entry = m_model.getBodies()[b];
        if (m_turnsFast[b] || !entry.flexible || entry.flexible->getNumModes() == 0) continue;
        const FlexibleBody& body = *entry.flexible;
        const double least = LargestStiffening * body.getPart().omegaSquared[0];
        if (!(body.getFrameVelocity(state)[0].normSqr() > least)) continue;
        const SimTK::Vec3 omega = ~body.getFramePose(state).R() * body.getFrameVelocity(state)[0];
        const auto& I = body.getPart().inertia;
        const SimTK::Inertia inertia(I[0], I[1], I[2], I[3], I[4], I[5]);
        // Rotation of a shaft about its own axis stiffens it little.
        const double largest = calcPrincipalValues(inertia.asSymMat33())[0];
        const double stiffening =
            ~omega * (inertia * omega) / (largest * body.getPart().omegaSquared[0]);
        if (!(stiffening > LargestStiffening) || body.isStiffeningEnabled(state) ||
            body.isRigid(state))
            continue;
        m_turnsFast[b] = true;
        std::ostringstream text;
        text << "'" << entry.name << "' turns at " << writeGeneral(omega.norm(), 3)
             << " rad/s at t = " << writeGeneral(state.getTime(), 3)
             << " s without geometric stiffening, which would change the stiffness of its lowest "
                "mode by about "
             << writeGeneral(100 * stiffening, 2) << " %: "
             << (body.hasStiffening()
                     ? "set 'stiffening: true' of the body"
                     : "set 'stiffening: true' of its part, or 'simflex reduce --stiffening'");
        m_warn(text.str());
    }
}

bool MotionWarnings::hasElementsWithRange() const {
    return m_model.getFlexibleBodies().hasElementsWithRange();
}

void MotionWarnings::checkElements(const SimTK::State& state) {
    const double elapsed = std::max(0.0, state.getTime() - m_lastLook);  // 0 at the first call
    m_lastLook = std::fmax(m_lastLook, state.getTime());
    for (const auto& [element, text] :
         m_model.getFlexibleBodies().describeElementsOutOfRange(state, elapsed))
        if (m_outOfRange.insert(element).second)
            m_warn("at t = " + writeGeneral(state.getTime(), 4) + " s " + text);
}

void MotionWarnings::checkFinite(double time, const std::vector<double>& values) {
    for (size_t k = 0; k < values.size(); ++k) {
        const size_t probe = size_t(m_probeOfColumn[k]);
        if (std::isfinite(values[k]) || m_isNotFinite[probe]) continue;
        m_isNotFinite[probe] = true;
        std::ostringstream text;
        text << "probe '" << m_columns[k] << " is " << values[k] << " at t = " << time
             << " s: its formula, or what it is made of, has no finite value there";
        m_warn(text.str());
    }
}

std::vector<double> MotionWarnings::save() const {
    std::vector<double> saved{double(m_isAtStart), double(m_outOfRange.size())};
    saved.insert(saved.end(), m_outOfRange.begin(), m_outOfRange.end());
    for (const bool isTold : m_isNotFinite) saved.push_back(isTold);
    for (const bool isTold : m_turnsFast) saved.push_back(isTold);
    for (const auto& [body, kind] : m_linearRange.getWarned())
        saved.insert(saved.end(), {double(body), double(int(kind))});
    return saved;
}

void MotionWarnings::restore(const std::vector<double>& saved) {
    size_t at = 0;
    const auto take = [&] {
        if (at == saved.size()) throw std::invalid_argument("its warnings are of another model");
        return saved[at++];
    };
    m_isAtStart = take() != 0;
    m_outOfRange.clear();
    for (double rest = take(); rest > 0; --rest) m_outOfRange.insert(int(take()));
    for (size_t k = 0; k < m_isNotFinite.size(); ++k) m_isNotFinite[k] = take() != 0;
    for (size_t k = 0; k < m_turnsFast.size(); ++k) m_turnsFast[k] = take() != 0;
    std::set<std::pair<int, LinearRangeReporter::Kind>> warned;
    while (at < saved.size()) {
        const int body = int(take());
        warned.emplace(body, LinearRangeReporter::Kind(int(take())));
    }
    m_linearRange.setWarned(warned);
}

}  // namespace model
}  // namespace simflex
