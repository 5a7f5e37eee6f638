#pragma once
/** @file
Warnings about a motion, each given once: flexible bodies bent beyond the linear range, or turning
so fast or so compressed that they need geometric stiffening but lack it; probes without a finite
value; connectors outside the valid range of their force law. Shared by `simflex run` and the
prompt. **/

#include <functional>
#include <set>
#include <string>
#include <vector>

#include "simflex/body/LinearRangeReporter.h"
#include "simflex/model/probes/Probe.h"

namespace simflex {
namespace model {

class MotionWarnings {
public:
    using Warn = std::function<void(const std::string&)>;
    /** Refers to the model. **/
    MotionWarnings(const Model& model, const Probes& probes, Warn warn);
    MotionWarnings(const MotionWarnings&) = delete;
    MotionWarnings& operator=(const MotionWarnings&) = delete;

    /** Checks a row of results.
    @pre Stage::Velocity. **/
    void check(const SimTK::State& state, const std::vector<double>& values);
    /** Warns of bodies whose stiffness rotation would change by more than this fraction: ω²/Ω₁² of
    the lowest frequency, times the inertia about the axis over the largest principal one. **/
    static constexpr double LargestStiffening = 0.03;
    void checkTurning(const SimTK::State& state);
    /** Checks connectors, also at the ends of steps; times may go back to that of a row.
    @pre Stage::Velocity. **/
    void checkElements(const SimTK::State& state);
    bool hasElementsWithRange() const;
    /** @param values  of all probes **/
    void checkFinite(double time, const std::vector<double>& values);

    /** Advice for bodies bent too far before the motion starts. **/
    static const char* getAdviceAtStart();

    /** @name Warnings already given, as numbers **/
    /**@{**/
    std::vector<double> save() const;
    void restore(const std::vector<double>& saved);
    /**@}**/

private:
    Warn m_warn;
    std::vector<std::string> m_columns;  ///< of all probes: "tip.x"
    std::vector<int> m_probeOfColumn;
    LinearRangeReporter m_linearRange;
    const Model& m_model;
    std::set<int> m_outOfRange;       ///< force elements reported
    double m_lastLook = SimTK::NaN;   ///< last check of them [s]
    std::vector<bool> m_turnsFast;    ///< by body
    std::vector<bool> m_isNotFinite;  ///< by probe
    bool m_isAtStart = true;
};

}  // namespace model
}  // namespace simflex
