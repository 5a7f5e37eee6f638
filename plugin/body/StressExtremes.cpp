#include "simflex/body/StressExtremes.h"

#include <iomanip>
#include <stdexcept>

#include "simflex/body/ReportInterval.h"

namespace simflex {

using namespace SimTK;

namespace {

enum class Wanted { Largest, Least };

/** Updates an extreme if one of the values exceeds it. **/
template <class ValueAt>
void improve(const StressRecovery& nodes, Real time, Wanted wanted, const ValueAt& valueAt,
             StressExtremes::Extreme& extreme) {
    if (nodes.getNumNodes() == 0) return;
    const auto isBetter = [&](Real a, Real b) { return wanted == Wanted::Largest ? a > b : a < b; };
    int best = 0;
    for (int k = 1; k < nodes.getNumNodes(); ++k)
        if (isBetter(valueAt(k), valueAt(best))) best = k;
    if (!isNaN(extreme.value) && !isBetter(valueAt(best), extreme.value)) return;
    extreme = {valueAt(best), nodes.getNodeNumber(best), nodes.getNodePosition(best), time};
}

}  // namespace

StressExtremes::StressExtremes(const FlexibleBodySubsystem& subsystem, Real interval)
    : PeriodicEventReporter(checkReportInterval(interval, "StressExtremes")),
      m_subsystem(subsystem) {}

void StressExtremes::handleEvent(const State& state) const {
    const size_t numBodies = size_t(m_subsystem.getNumBodies());
    m_extremes.resize(numBodies);
    while (m_looks.size() < numBodies) {
        const FlexibleBody body = m_subsystem.getBody(FlexibleBodyIndex(int(m_looks.size())));
        m_looks.push_back({StressRecovery(body), StressRecovery::atAllNodes(body)});
    }
    const Real time = state.getTime();
    for (size_t b = 0; b < numBodies; ++b) {
        StressRecovery &stress = m_looks[b].stress, &all = m_looks[b].displacement;
        Extremes& extremes = m_extremes[b];
        all.calcDisplacement(state, m_vectors);
        improve(
            all, time, Wanted::Largest, [&](int k) { return m_vectors[unsigned(k)].norm(); },
            extremes.displacement);
        if (!stress.getBody().getPart().modalStress) continue;
        stress.calcVonMises(state, m_vonMises);
        improve(
            stress, time, Wanted::Largest, [&](int k) { return m_vonMises[k]; }, extremes.vonMises);
        stress.calcPrincipalStress(state, m_vectors);
        improve(
            stress, time, Wanted::Largest, [&](int k) { return m_vectors[unsigned(k)][0]; },
            extremes.largestPrincipal);
        improve(
            stress, time, Wanted::Least, [&](int k) { return m_vectors[unsigned(k)][2]; },
            extremes.leastPrincipal);
    }
}

const StressExtremes::Extremes& StressExtremes::getExtremes(const FlexibleBody& body) const {
    static const Extremes none;
    const size_t index = size_t(int(body.getIndex()));
    return index < m_extremes.size() ? m_extremes[index] : none;
}

void StressExtremes::write(std::ostream& out) const {
    std::ostringstream text;
    text.precision(6);
    text << "body, extreme, value, node, x y z in the deck [m], t [s]\n";
    for (size_t b = 0; b < m_extremes.size(); ++b) {
        const std::string name = m_subsystem.getBody(FlexibleBodyIndex(int(b))).getName();
        const auto line = [&](const char* what, const Extreme& extreme) {
            if (isNaN(extreme.value)) return;
            text << name << ", " << what << ", " << extreme.value << ", " << extreme.nodeNumber
                 << ", " << extreme.position[0] << ' ' << extreme.position[1] << ' '
                 << extreme.position[2] << ", " << extreme.time << '\n';
        };
        line("largest von Mises stress [Pa]", m_extremes[b].vonMises);
        line("largest principal stress [Pa]", m_extremes[b].largestPrincipal);
        line("least principal stress [Pa]", m_extremes[b].leastPrincipal);
        line("largest displacement [m]", m_extremes[b].displacement);
    }
    out << text.str();
}

}  // namespace simflex
