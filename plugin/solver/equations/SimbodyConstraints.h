#pragma once
/** @file
Simbody's own constraints (Rod, Weld, NoSlip1D, CoordinateCoupler, Custom, …) in the equations of
motion (private header):

    holonomic       g(q, t) = 0      error ġ in the speed equations, g in projections
    nonholonomic    v(q, u, t) = 0   error v in the speed equations, none in projections
    acceleration    a(q, u, u̇, t) = 0

All are evaluated by Simbody's generic methods, on a State in which only these constraints are
enabled. A row of G consists of the forces of a unit multiplier, so that signs are those of
Simbody's M u̇ + Gᵀλ = f. Rows of one constraint are consecutive: holonomic, nonholonomic,
acceleration. **/

#include <string>
#include <utility>
#include <vector>

#include "Simbody.h"

namespace simflex {

/** Level of a constraint row or prescribed coordinate; Position implies the other two. **/
enum class MotionLevel { Position, Velocity, Acceleration };

class SimbodyConstraints {
public:
    /** Forces of one multiplier, at the origins of bodies and on speeds, as in Gᵀλ. **/
    struct RowForces {
        std::vector<std::pair<SimTK::MobilizedBodyIndex, SimTK::SpatialVec>> bodies;
        std::vector<std::pair<int, SimTK::Real>> speeds;  ///< by Simbody's index of u
    };

    SimbodyConstraints(const SimTK::SimbodyMatterSubsystem& matter,
                       std::vector<SimTK::ConstraintIndex> constraints, const SimTK::State& state);

    int numRows() const { return int(m_levels.size()); }
    MotionLevel getLevel(int row) const { return m_levels[size_t(row)]; }
    /** "Simbody constraint 3 (Rod) on bodies (2, 5)". **/
    const std::string& getName(int row) const { return m_constraints[m_owner[size_t(row)]].name; }
    bool hasAccelerationRows() const { return m_hasAccelerationRows; }

    /** First row of a constraint and its number of rows; {0, 0} if it is not among these. **/
    std::pair<int, int> findRows(SimTK::ConstraintIndex constraint) const;

    /** Mobilized bodies, Ground excluded, that a row acts on by a force or on their mobility. **/
    const std::vector<SimTK::MobilizedBodyIndex>& getBodies(int row) const {
        return m_constraints[m_owner[size_t(row)]].mobods;
    }

    /** @name State realized to Stage::Velocity **/
    /**@{**/
    /** Zero in rows that are not holonomic. **/
    void calcPositionErrors(const SimTK::State& state, double* g) const;
    /** Zero in acceleration rows. **/
    void calcVelocityErrors(const SimTK::State& state, double* gDot) const;
    /** g̈, v̇ and a for accelerations in Simbody's numbering; O(bodies of the system). **/
    void calcAccelerationErrors(const SimTK::State& state, const SimTK::Vector& uDot,
                                double* gDotDot) const;
    void calcRowForces(const SimTK::State& state, std::vector<RowForces>& rows) const;
    /** Adds the applied forces −Gᵀλ. **/
    void addInForces(const SimTK::State& state, const double* lambda,
                     SimTK::Vector_<SimTK::SpatialVec>& bodyForces,
                     SimTK::Vector& mobilityForces) const;
    /** Power of the forces −Gᵀλ [W]; zero except for working constraints. **/
    double calcPower(const SimTK::State& state, const double* lambda) const;
    /**@}**/

    /** A constraint's number, kind and bodies, for messages. **/
    static std::string describe(const SimTK::Constraint& constraint);

private:
    struct Entry {
        SimTK::ConstraintIndex index;
        std::string name;
        int firstRow = 0;
        int numPosition = 0, numVelocity = 0, numAcceleration = 0;
        std::vector<SimTK::MobilizedBodyIndex> mobods;
        std::vector<SimTK::MobilizedBodyIndex> bodies;  ///< by ConstrainedBodyIndex
        std::vector<int> speeds;                        ///< Simbody's u, by ConstrainedUIndex
        SimTK::MobilizedBodyIndex ancestor;

        int numRows() const { return numPosition + numVelocity + numAcceleration; }
    };

    /** Gᵀλ of one constraint: forces on its bodies in Ground and on its speeds. **/
    void calcForces(const SimTK::State& state, const Entry& entry, const SimTK::Vector& lambda,
                    SimTK::Vector_<SimTK::SpatialVec>& bodyForces,
                    SimTK::Vector& mobilityForces) const;

    const SimTK::SimbodyMatterSubsystem& m_matter;
    std::vector<Entry> m_constraints;
    std::vector<MotionLevel> m_levels;
    std::vector<size_t> m_owner;  ///< entry of each row
    bool m_hasAccelerationRows = false;
};

}  // namespace simflex
