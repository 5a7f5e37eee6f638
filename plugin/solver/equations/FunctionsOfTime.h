#pragma once
/** @file
What motions and loads are at one time (private header). Their functions may be formulas, tables or
a user's own: each is asked once for every time, one after another, whatever the number of
evaluations and threads. The values of the last times are kept: step control asks for them again.

    const int drive = functions.add(*joint.equations);
    functions.moveTo(time);
    equations.calcErrors(functions.get().drives[drive], …); **/

#include <algorithm>
#include <array>
#include <vector>

#include "simflex/body/BodyLoad.h"
#include "simflex/body/ForceElement.h"
#include "simflex/body/JointEquations.h"

namespace simflex {

struct TimeValues {
    double time = SimTK::NaN;
    std::vector<JointEquations::Drive> drives;
    std::vector<SimTK::SpatialVec> forces;
    std::vector<SimTK::Real> scales;  ///< of loads on whole bodies
};

class FunctionsOfTime {
public:
    FunctionsOfTime() { forget(); }

    /** @name Where the values will stand in TimeValues
    What has no functions has values that never change. **/
    /**@{**/
    /** @param held  of a lock **/
    int add(const JointEquations& equations, SimTK::Real held = 0);
    int add(const ForceElement& element);
    /** @returns the place of the first one's scale **/
    int add(const std::vector<BodyLoad>& loads);
    /**@}**/

    /** From now on functions are to be evaluated at times within these only, the nearest ones;
    infinite unless told. **/
    void setSmoothSpan(double first, double last) {
        m_firstTime = first;
        m_lastTime = last;
    }
    double clampTime(double time) const { return std::clamp(time, m_firstTime, m_lastTime); }

    /** Throws what a function throws; the time is that of before then. **/
    void moveTo(double time);
    /** Values at the time moved to. **/
    const TimeValues& get() const { return m_values[m_current]; }
    /** Values at any time, good until the next call. **/
    const TimeValues& calc(double time);

    /** Asks anew from now on: what a function depends on may have changed. **/
    void forget();

private:
    /** In a long run of order 5 a step asks for 5 old times and 5 new ones. **/
    static constexpr size_t Capacity = 16;

    void resize();
    size_t obtain(double time);

    std::vector<const JointEquations*> m_equations;  ///< null: the drive of those without functions
    std::vector<SimTK::Real> m_held;                 ///< by locks among these
    std::vector<const ForceElement*> m_elements;     ///< null: those without
    std::vector<const BodyLoad*> m_loads;
    std::array<TimeValues, Capacity> m_values;
    std::array<long, Capacity> m_lastUse;
    long m_use;
    size_t m_current;
    double m_firstTime = -SimTK::Infinity, m_lastTime = SimTK::Infinity;
};

}  // namespace simflex
