#pragma once
/** @file
Says when a flexible body leaves the range in which modes describe it: a node displaced by more than
10 % of the part's size (twice its radius about the centre of mass), as Adams warns, an interface
turned by more than 0.2 rad against the body's frame, or a body without geometric stiffening pressed
together between two interfaces by more than 10 % of the load at which it would buckle on hinges
there, or pulled apart by more than that load. Once for each body and kind.

    system.addEventReporter(new LinearRangeReporter(flexible, 0.001));

    simflex: 'boom' at t = 0.132 s: node 118 is displaced by 0.21 m, 11 % of the part's size (1.9
m); modes describe deformations up to 10 % of it. … **/

#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>

#include "simflex/body/FlexibleBodySubsystem.h"

namespace simflex {

class PartColumns;
class ReducedBody;

class LinearRangeReporter : public SimTK::PeriodicEventReporter {
public:
    static constexpr SimTK::Real LargestShare = 0.1;     ///< of the part's size
    static constexpr SimTK::Real LargestRotation = 0.2;  ///< [rad]
    /** Of Euler's load on hinges: 5 % and 10 % of the frequency in bending. **/
    static constexpr SimTK::Real LargestCompression = 0.1, LargestTension = 0.2;

    enum class Kind { Displacement, Rotation, AxialLoad };

    using Warn = std::function<void(const std::string& message)>;

    /** @param interval  between looks at the State [s]; each costs O(n_f) for bodies that are far
    within it
    @param warn      takes the messages; default: a line on std::cerr
    @throws std::invalid_argument if the interval is not positive. **/
    LinearRangeReporter(const FlexibleBodySubsystem& subsystem, SimTK::Real interval,
                        Warn warn = {});

    void handleEvent(const SimTK::State& state) const override;

    /** What it has told already: number of the body, and of what kind; for runs that go on later.
     * **/
    const std::set<std::pair<int, Kind>>& getWarned() const { return m_warned; }
    void setWarned(const std::set<std::pair<int, Kind>>& warned) { m_warned = warned; }

private:
    void warnOnce(int body, Kind kind, const std::string& message) const;
    void checkAxialLoad(const SimTK::State& state, FlexibleBodyIndex index) const;

    const FlexibleBodySubsystem& m_subsystem;
    Warn m_warn;
    mutable std::set<std::pair<int, Kind>> m_warned;
    mutable std::map<const ReducedBody*, std::shared_ptr<PartColumns>> m_columns;
};

/** Whether an assembly has deformed a flexible body beyond this range, or one that was beyond it
further. Stage::Model.
@param given      the State before
@param assembled  the State that the assembly made of it
@returns the body, its deformation and the joint that was furthest from closed in `given`; empty:
none **/
std::string describeForcedDeformation(const FlexibleBodySubsystem& subsystem,
                                      const SimTK::State& given, const SimTK::State& assembled);

/** @throws std::runtime_error with that description, if there is one. **/
void requireUnforcedShapes(const FlexibleBodySubsystem& subsystem, const SimTK::State& given,
                           const SimTK::State& assembled);

/** Refuses a State to start from that is far outside of this range, by five times or more: it was
made by something that knows no stiffness. Stage::Model.
@param where  names who was given the State
@throws std::invalid_argument that names the body, its deformation and what may have caused it. **/
void requireLinearRange(const FlexibleBodySubsystem& subsystem, const SimTK::State& state,
                        const std::string& where);

}  // namespace simflex
