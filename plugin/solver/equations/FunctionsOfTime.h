#pragma once
/** @file
Motions and loads at one time (private header). Their functions may be formulas, tables or user
code: each is evaluated once per time, sequentially, whatever the number of evaluations and threads.
Values at recent times are cached, because step control requests them again.

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

    /** @name Indices in TimeValues
    Items without functions have constant values. **/
    /**@{**/
    /** @param held  value of a lock **/
    int add(const JointEquations& equations, SimTK::Real held = 0);
    int add(const ForceElement& element);
    /** @returns the index of the first scale **/
    int add(const std::vector<BodyLoad>& loads);
    /**@}**/

    /** Clamps times of evaluations to this interval from now on; infinite by default. **/
    void setSmoothSpan(double first, double last) {
        m_firstTime = first;
        m_lastTime = last;
    }
    double clampTime(double time) const { return std::clamp(time, m_firstTime, m_lastTime); }

    /** Passes on what a function throws; the time is then unchanged. **/
    void moveTo(double time);
    /** Values at the time moved to. **/
    const TimeValues& get() const { return m_values[m_current]; }
    /** Values at any time, valid until the next call. **/
    const TimeValues& calc(double time);

    /** Clears the cache, after changes that functions may depend on. **/
    void forget();

private:
    /** Cache size: at order 5 a step requests 5 old times and 5 new ones. **/
    static constexpr size_t Capacity = 16;

    void resize();
    size_t obtain(double time);

    std::vector<const JointEquations*> m_equations;  ///< null: drives without functions
    std::vector<SimTK::Real> m_held;                 ///< values of locks among these
    std::vector<const ForceElement*> m_elements;     ///< null: elements without functions
    std::vector<const BodyLoad*> m_loads;
    std::array<TimeValues, Capacity> m_values;
    std::array<long, Capacity> m_lastUse;
    long m_use;
    size_t m_current;
    double m_firstTime = -SimTK::Infinity, m_lastTime = SimTK::Infinity;
};

}  // namespace simflex
