#pragma once
/** @file
Warnings of a motion, each told once: flexible bodies that are bent beyond what modes describe, or
turn so fast or are so compressed that they want geometric stiffening and have none, probes without
a finite value, connectors that have left the range in which their force means something. What
`simflex run` and the prompt tell alike. **/

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

    /** Looks at a row of results. @pre Stage::Velocity. **/
    void check(const SimTK::State& state, const std::vector<double>& values);
    /** Warns of bodies whose stiffness turning would change by more than this part, as far as
    ω²/Ω₁² tells: of the lowest frequency, and of what is spread across the axis as it is at most.
    **/
    static constexpr double LargestStiffening = 0.03;
    void checkTurning(const SimTK::State& state);
    /** Connectors, at the ends of steps too; times may go back to a row's. @pre Stage::Velocity.
     * **/
    void checkElements(const SimTK::State& state);
    bool hasElementsWithRange() const;
    /** @param values  of all probes **/
    void checkFinite(double time, const std::vector<double>& values);

    /** For bodies that are bent too far before anything has moved. **/
    static const char* getAdviceAtStart();

    /** @name What has been told, as numbers **/
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
    std::set<int> m_outOfRange;       ///< force elements
    double m_lastLook = SimTK::NaN;   ///< at them [s]
    std::vector<bool> m_turnsFast;    ///< by body
    std::vector<bool> m_isNotFinite;  ///< by probe
    bool m_isAtStart = true;
};

}  // namespace model
}  // namespace simflex
