#pragma once
/** @file
Warns when a flexible body leaves the range of linear modes, once per body and kind:

- a node is displaced by more than 10 % of the part's size (twice its radius about the centre of
  mass), the limit at which Adams warns,
- an interface is rotated by more than 0.2 rad relative to the body's frame,
- a body without geometric stiffening is compressed between two interfaces by more than 10 %, or
  stretched by more than 20 %, of its buckling load with hinged ends.

    system.addEventReporter(new LinearRangeReporter(flexible, 0.001));

    simflex: 'boom' at t = 0.132 s: node 118 is displaced by 0.21 m, 11 % of the part's size (1.9
**/

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
    /** Share of Euler's load with hinged ends. These loads change the bending frequency by 5 % and
    10 %. **/
    static constexpr SimTK::Real LargestCompression = 0.1, LargestTension = 0.2;

    enum class Kind { Displacement, Rotation, AxialLoad };

    using Warn = std::function<void(const std::string& message)>;

    /** @param interval  between checks [s]; a check costs O(n_f) for a body far within its range
    @param warn      receives the messages; default: writes a line to std::cerr
    @throws std::invalid_argument if the interval is not positive. **/
    LinearRangeReporter(const FlexibleBodySubsystem& subsystem, SimTK::Real interval,
                        Warn warn = {});

    void handleEvent(const SimTK::State& state) const override;

    /** Warnings already given (body index and kind), for runs that are continued later. **/
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

/** Returns whether assembly has deformed a flexible body beyond this range, or further if it was
outside. Stage::Model.
@param given      the State before assembly
@param assembled  the State after assembly
@returns the body, its deformation and the joint with the largest error in `given`, or "" **/
std::string describeForcedDeformation(const FlexibleBodySubsystem& subsystem,
                                      const SimTK::State& given, const SimTK::State& assembled);

/** @throws std::runtime_error with the result of describeForcedDeformation() unless it is
empty. **/
void requireUnforcedShapes(const FlexibleBodySubsystem& subsystem, const SimTK::State& given,
                           const SimTK::State& assembled);

/** Refuses an initial State that exceeds this range by a factor of five or more, as left by tools
that know no stiffness. Stage::Model.
@param where  the caller that was given the State
@throws std::invalid_argument naming the body, its deformation and a likely cause. **/
void requireLinearRange(const FlexibleBodySubsystem& subsystem, const SimTK::State& state,
                        const std::string& where);

}  // namespace simflex
