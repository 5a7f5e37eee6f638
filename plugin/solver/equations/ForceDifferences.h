#pragma once
/** @file
Stiffness and damping of Simbody's force elements, by differences (private header).

With f the generalized force of an element, in Simbody's speeds u_j that it depends on,

    A = −(γ ∂f/∂q·N + ∂f/∂u),    ½(A + Aᵀ) = Σ_i σ_i d_i d_iᵀ,    σ_i = ±1

column j by one central difference along q += h·N e_j, u += h/γ·e_j. Within one rigid block the
Newton matrix uses all of A. Elsewhere it uses rank-one terms (see ForceElement), which cannot
represent the antisymmetric part of follower forces and friction. **/

#include <Eigen/Dense>
#include <vector>

#include "Simbody.h"
#include "simflex/solver/equations/StateImage.h"

namespace simflex {

// SimTK declares a class Eigen, which makes the name ambiguous for clang after
// `using namespace SimTK`.
namespace Eigen = ::Eigen;

/** A force element to differentiate, or all of Simbody's. **/
struct ForceSelection {
    SimTK::Force force;  ///< empty handle: all force elements and contact subsystems together
    /** Bodies that it acts on and depends on; empty: found by probing. **/
    std::vector<SimTK::MobilizedBodyIndex> bodies;

    /** "force element 3 (MyForce)" **/
    std::string describe() const;
};

class ForceDifferences {
public:
    /** One of Simbody's speeds, and the displacement per unit. **/
    struct Speed {
        SimTK::MobilizedBodyIndex body;
        int u = 0;           ///< Simbody's index
        double metres = 1;   ///< largest displacement per unit
        double step = 1e-6;  ///< of the quasi-coordinate
    };

    /** @param candidates  speeds of all bodies
    @param state  variables other than q, u and z are kept
    @throws std::invalid_argument if the element is another system's or a body does not exist. **/
    ForceDifferences(const SimTK::MultibodySystem& system, const ForceSelection& selection,
                     const std::vector<Speed>& candidates, const SimTK::State& state);

    const std::vector<Speed>& getSpeeds() const { return m_speeds; }
    int getNumTerms() const { return m_numTerms; }

    void takeVariables(const std::vector<SimTK::DiscreteVarKey>& keys, const SimTK::State& from) {
        for (SimTK::State* state : {&m_moved, &m_without}) copyVariables(keys, from, *state);
    }

    /** Differences about `state`'s q, u and time.
    @throws std::runtime_error naming element and body where a force is not a finite number. **/
    void calcTerms(const SimTK::State& state, double gamma);
    /** The same without rank-one terms: all of A, by getSpeeds(). **/
    const Eigen::MatrixXd& calcMatrix(const SimTK::State& state, double gamma);
    double getSign(int term) const { return m_signs[term]; }
    /** d_i, by getSpeeds(). **/
    double getDirection(int term, int speed) const { return m_directions(speed, term); }

private:
    void findSpeeds(const std::vector<Speed>& candidates);
    /** Generalized force at m_moved's q and u.
    @throws std::runtime_error naming the element that threw **/
    const SimTK::Vector& calcForce();
    /** Moves one coordinate from its value in `state`. **/
    void move(const SimTK::State& state, const Speed& speed, double dq, double du);

    const SimTK::MultibodySystem& m_system;
    ForceSelection m_selection;
    std::vector<Speed> m_speeds;
    int m_numTerms = 0;
    SimTK::State m_moved;
    /** State in which only contact subsystems act, if one element is differentiated. **/
    SimTK::State m_without;
    SimTK::Vector_<SimTK::SpatialVec> m_bodyForces;
    SimTK::Vector m_mobilityForces, m_force, m_unit, m_qDot;
    Eigen::MatrixXd m_matrix, m_directions;
    Eigen::VectorXd m_signs;
};

}  // namespace simflex
