#pragma once
/** @file
Extremes of stress and displacement over a run, with node and time.

    auto* extremes = new StressExtremes(flexible, 1e-4);
    system.addEventReporter(extremes);           // the system owns it
    ...
    const StressExtremes::Extreme& worst = extremes->getExtremes(crank).vonMises;
    printf("%g Pa at node %d, t = %g s\n", worst.value, worst.nodeNumber, worst.time);
    extremes->write(std::cout);

A further run of the same system updates the same extremes; clear() resets them. **/

#include <ostream>
#include <string>
#include <vector>

#include "simflex/body/StressRecovery.h"

namespace simflex {

class StressExtremes : public SimTK::PeriodicEventReporter {
public:
    struct Extreme {
        SimTK::Real value = SimTK::NaN;  ///< NaN: not evaluated yet
        int nodeNumber = 0;              ///< in the deck
        SimTK::Vec3 position{
            SimTK::NaN};                ///< of the node, undeformed, in the deck's coordinates [m]
        SimTK::Real time = SimTK::NaN;  ///< [s]
    };

    /** Extremes of one body; stress is NaN if its part was reduced without stress. **/
    struct Extremes {
        Extreme vonMises;          ///< largest [Pa]
        Extreme largestPrincipal;  ///< largest tension [Pa]
        Extreme leastPrincipal;    ///< largest compression: the smallest value [Pa]
        Extreme displacement;      ///< largest |Φξ| of a node [m]
    };

    /** Evaluates displacements at all nodes of all bodies, and stress at all nodes that have it, at
    t = k·interval. O(nodes·n_f) per evaluation.
    @throws std::invalid_argument if the interval is not positive. **/
    StressExtremes(const FlexibleBodySubsystem& subsystem, SimTK::Real interval);

    const Extremes& getExtremes(const FlexibleBody& body) const;
    void clear() { m_extremes.clear(); }
    /** Writes a human-readable table. **/
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
