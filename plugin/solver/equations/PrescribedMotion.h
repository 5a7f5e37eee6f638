#pragma once
/** @file
Locked mobilizers and Simbody's Motions in the equations of motion (private header).

A prescribed speed is not an unknown: u_i and u̇_i are set before Newton's iteration, row and column
i of J become those of the identity, and row i of Gᵀ and r_i zero. A prescribed coordinate q_i is
set after q is integrated. Values of `lock()` and Motion::Steady are constant and stored here; those
of other Motions are evaluated by Simbody, once per time if they depend on nothing else (all
position-level and Sinusoid ones), otherwise in every evaluation. The generalized force that moves
the coordinate is the residual of its row. **/

#include <vector>

#include "simflex/body/FlexibleBodySubsystemGuts.h"
#include "simflex/solver/NewtonSystem.h"
#include "simflex/solver/equations/SimbodyConstraints.h"

namespace simflex {

class Checkpoint;

class PrescribedMotion {
public:
    /** Indices of a mobilizer's coordinates in the solver's vectors. **/
    struct Mobilizer {
        SimTK::MobilizedBodyIndex body;
        bool isFlexibleFrame = false;  ///< solver's q, u: quaternion, p_GB; ω_B, v_G
        int q0 = 0, nq = 0, u0 = 0, nu = 0;
    };

    /** True if the mobilizer is locked or moved by a Motion in this State, at any level. **/
    static bool isPrescribed(const SimTK::MobilizedBody& mobod, const SimTK::State& state);
    /** True if it is to be moved by Motion::Fast. **/
    static bool isUnsupported(const SimTK::MobilizedBody& mobod, const SimTK::State& state);
    /** True if a Motion moves it and no lock overrides it. **/
    static bool hasActiveMotion(const SimTK::MobilizedBody& mobod, const SimTK::State& state);

    /** @param mobilizers  prescribed ones
    @param state  realized to Stage::Velocity; locked values are taken from it **/
    PrescribedMotion(const SimTK::SimbodyMatterSubsystem& matter,
                     const std::vector<Mobilizer>& mobilizers, int numU, const SimTK::State& state);

    bool isEmpty() const { return m_entries.empty(); }
    bool hasMotions() const { return m_hasMotions; }
    bool hasAccelerationMotions() const { return m_hasAccelerationMotions; }
    /** True if a Motion's values may depend on q or u. **/
    bool dependsOnState() const { return m_dependsOnState; }
    /** True if nonzero speeds are prescribed. **/
    bool canWork() const { return m_canWork; }

    /** Takes the Motions' q and u at the time and free coordinates of `state`, and sets them there.
    On return the State is realized to Stage::Position (Stage::Dynamics if accelerations are
    prescribed, which are read then). **/
    void updateFromSimbody(SimTK::State& state);
    /** Takes the Motions' u̇. @pre state realized to Stage::Dynamics. **/
    void updateAccelerations(const SimTK::State& state);

    /** Writes the known q and u. With `uHist`, prescribed accelerations give u_hist + γu̇. **/
    void apply(double gamma, const double* uHist, double* q, double* u) const;
    /** Writes the known u̇. **/
    void applyAccelerations(const double* q, double* uDot) const;

    /** Writes −factor·u̇ where a Motion prescribes u̇ only. **/
    void subtractAccelerations(double factor, const double* q, double* r) const;

    /** Sets r_i of all prescribed speeds to zero. **/
    void clearResidual(double* r) const;
    /** Power of the forces that move the coordinates, from the residual before it is cleared. **/
    double calcPower(const double* r, const double* u) const;
    /** Zeroes exactly known entries in errors of q and u. **/
    void clearErrors(double* errorQ, double* errorU) const;

    /** Turns prescribed rows and columns of a block with its own columns into those of the
    identity; a held mode of an arrow keeps its entry of the part's diagonal, since its row of r is
    zero.
    @param level  at Position, only speeds with prescribed q **/
    void mask(MotionLevel level, int firstU, NewtonSystem::Block& block) const;
    bool touches(int firstU, int numU) const;
    /** True if this speed is prescribed at this level or a deeper one. **/
    bool isKnown(MotionLevel level, size_t u) const;

    /** Values at the current time. **/
    void visit(Checkpoint& checkpoint);

private:
    struct Entry {
        Mobilizer mobilizer;
        MotionLevel level;
        bool isMotion;
        int stateQ0, stateU0;         ///< in Simbody's vectors
        std::vector<double> q;        ///< the solver's
        std::vector<double> u, uDot;  ///< Simbody's
    };

    void putSpeeds(const Entry& entry, const std::vector<double>& simbody, const double* q,
                   double* solver) const;

    const SimTK::SimbodyMatterSubsystem& m_matter;
    std::vector<Entry> m_entries;
    std::vector<char> m_levelOfU;  ///< 0: free; 1 acceleration, 2 velocity, 3 position
    bool m_hasMotions = false, m_hasAccelerationMotions = false, m_canWork = false;
    bool m_dependsOnState = false;
};

}  // namespace simflex
