#pragma once
/** @file
The extremes of stress and displacement over a run: how much, where and when.

    auto* extremes = new StressExtremes(flexible, 1e-4);
    system.addEventReporter(extremes);           // the system owns it
    ...
    const StressExtremes::Extreme& worst = extremes->getExtremes(crank).vonMises;
    printf("%g Pa at node %d, t = %g s\n", worst.value, worst.nodeNumber, worst.time);
    extremes->write(std::cout);

A new run of the same system goes on with the extremes of the last; clear() forgets them. **/

#include <ostream>
#include <string>
#include <vector>

#include "simflex/body/StressRecovery.h"

namespace simflex {

class StressExtremes : public SimTK::PeriodicEventReporter {
public:
    struct Extreme {
        SimTK::Real value = SimTK::NaN;  ///< NaN: never looked at
        int nodeNumber = 0;              ///< in the deck
        SimTK::Vec3 position{
            SimTK::NaN};                ///< of the node, undeformed, in the deck's coordinates [m]
        SimTK::Real time = SimTK::NaN;  ///< [s]
    };

    /** Of one body; stress is NaN if its part was reduced without. **/
    struct Extremes {
        Extreme vonMises;          ///< largest [Pa]
        Extreme largestPrincipal;  ///< largest tension [Pa]
        Extreme leastPrincipal;    ///< largest compression: the least value [Pa]
        Extreme displacement;      ///< largest |Φξ| of a node [m]
    };

    /** Looks at all nodes of all bodies, those with stress for stress, at t = k·interval; each look
    costs O(nodes·n_f).
    @throws std::invalid_argument if the interval is not positive. **/
    StressExtremes(const FlexibleBodySubsystem& subsystem, SimTK::Real interval);

    const Extremes& getExtremes(const FlexibleBody& body) const;
    void clear() { m_extremes.clear(); }
    /** A table for people. **/
    void write(std::ostream& out) const;

    void handleEvent(const SimTK::State& state) const override;

private:
    struct Look {
        StressRecovery stress, displacement;
    };

    const FlexibleBodySubsystem& m_subsystem;
    mutable std::vector<Look> m_looks;
    mutable std::vector<Extremes> m_extremes;  ///< by body
    mutable SimTK::Vector m_vonMises;
    mutable SimTK::Array_<SimTK::Vec3> m_vectors;
};

}  // namespace simflex
