#pragma once
/** @file
One block of the Newton system: a flexible body or a tree of rigid bodies (private header).

A block has `numQ` coordinates and `numU` speeds in its own numbering; pointers passed to its
methods point at the block's part of the solver's vectors. Each evaluation calls realize() first.
**/

#include <Eigen/Dense>
#include <string>
#include <vector>

#include "simflex/body/FrameMotion.h"
#include "simflex/solver/NewtonSystem.h"
#include "simflex/solver/equations/NewtonFactors.h"
#include "simflex/solver/equations/UnusablePoint.h"

namespace simflex {

class Checkpoint;
struct TimeValues;

// SimTK declares a class Eigen, which makes the name ambiguous for clang after
// `using namespace SimTK`.
namespace Eigen = ::Eigen;

/** Gravity of Simbody's Force::Gravity elements, summed for each mobilized body [m/s²]. **/
struct GravityField {
    std::vector<SimTK::Vec3> atBody;  ///< by MobilizedBodyIndex
};

/** Linear forces on mobilities, summed by Simbody's index of the speed:
f = constant − damping·u − stiffness·q, where q is the coordinate of the same index in its
mobilizer. **/
struct MobilityForces {
    std::vector<double> constant, damping, stiffness;

    double calcForce(int speed, double q, double u) const {
        const size_t i = size_t(speed);
        return constant[i] - damping[i] * u - stiffness[i] * q;
    }
};

/** Data shared by all blocks of a system in one evaluation. **/
struct EvaluationContext {
    const GravityField* gravity = nullptr;
    const MobilityForces* mobilities = nullptr;  ///< null: none
    /** Private State with the current q and u, realized to Stage::Velocity; null if no block needs
    Simbody. **/
    const SimTK::State* state = nullptr;
    const TimeValues* timeValues = nullptr;
    double loadFraction = 1;  ///< scales the loads on whole blocks
};

/** Terms in J of a block, and its storage. **/
enum class BlockDerivatives {
    Constant,  ///< elastic forces and damping: an arrow, or M/mass of a rigid tree
    Dense,     ///< everything in calcResidual() except loads, as a matrix
    ByBodies   ///< the same; for a long tree stored by bodies
};

class Block {
public:
    virtual ~Block() = default;

    std::string name;
    int numQ = 0, numU = 0;
    int firstQ = 0, firstU = 0;  ///< where the block's part starts in the solver's vectors

    /** Motions of this block's frames at the current state, in the order of addFrame(). **/
    std::vector<FrameMotion> frames;

    /** "mode 3 (34.2 Hz) of 'boom'": a speed or coordinate of the block in messages. **/
    virtual std::string describeSpeed(int speed) const = 0;
    virtual std::string describeCoordinate(int coordinate) const = 0;

    /** Computes position and velocity of the block and its frames. **/
    virtual void realize(const EvaluationContext& context, const double* q, const double* u) = 0;

    /** r ← M u̇ + b − f_internal − f_gravity. **/
    virtual void calcResidual(const EvaluationContext& context, const double* q, const double* u,
                              const double* uDot, double* r) = 0;

    /** r −= Jᵀ F for a spatial force F_G at a frame's origin. **/
    virtual void subtractForce(int frame, const SimTK::SpatialVec& F_G, double* r) const = 0;

    /** Whether the block has loads of its own, which calcResidual() includes. **/
    virtual bool hasLoads() const { return false; }
    /** r −= these loads at q, as in calcResidual(). @pre realize() at this q. **/
    virtual void subtractLoads(const EvaluationContext&, const double* /*q*/, double* /*r*/) {}

    /** r −= forces accumulated by Simbody on the block's bodies and mobilities. **/
    virtual void subtractSimbodyForces(const SimTK::Vector_<SimTK::SpatialVec>& bodyForces,
                                       const SimTK::Vector& mobilityForces, double* r) = 0;

    /** row += Jᵀ d: coefficients of the speeds in `d·(ω, v)` of a frame. **/
    virtual void addInRow(int frame, const SimTK::SpatialVec& d, double* row) const = 0;

    /** Acceleration of a frame for the given u̇ (zero u̇: the bias). **/
    virtual SimTK::SpatialVec calcFrameAcceleration(int frame, const double* u,
                                                    const double* uDot) const = 0;

    /** Writes J of NewtonFactors.h. **/
    virtual void formNewtonBlock(const NewtonFactors& factors, BlockDerivatives derivatives,
                                 const EvaluationContext& context, const double* q, const double* u,
                                 const double* uDot, NewtonSystem::Block& block) = 0;

    /** Writes J = M. **/
    virtual void formMassBlock(NewtonSystem::Block& block) = 0;

    /** q ← solution of q = q_hist + γ N(q) u. **/
    virtual void integrateQ(const EvaluationContext& context, const double* qHist, double gamma,
                            const double* u, double* q) const = 0;

    /** q̇ = N(q) u. **/
    virtual void calcQDot(const EvaluationContext& context, const double* q, const double* u,
                          double* qDot) const = 0;

    /** Moves q by the quasi-displacement δ = N⁻¹ Δq; quaternions stay normalised. **/
    virtual void displaceQ(const EvaluationContext& context, const double* delta,
                           double* q) const = 0;

    /** The same for a finite δ, exact to second order: exp for quaternions, N(q) at the midpoint
    for angles. **/
    virtual void moveQ(const EvaluationContext& context, const double* delta, double* q) const {
        displaceQ(context, delta, q);
    }

    /** Updates the weights of displacements for the pose of the last realize(). **/
    virtual void followPose() {}
    virtual void visit(Checkpoint&) {}

    /** Rotates speeds, or forces on them, with a body from one pose to another, where their axes
    are not body-fixed. **/
    virtual void turnAlong(const double* /*fromQ*/, const double* /*toQ*/, double* /*u*/) const {}

    /** False where the block cannot be evaluated, see UnusablePoint.h. **/
    virtual bool isUsable(const double* q, const double* u) const {
        return areUsable(q, numQ) && areUsable(u, numU);
    }

    /** Normalises quaternions. **/
    virtual void normalizeQ(double* q) const = 0;

    /** Gives quaternions of `q` the sign nearer to `reference`. **/
    virtual void alignQ(const double* reference, double* q) const = 0;

    /** Displacement caused by a quasi-displacement δ at worst, as the root of the sum of squares
    [m]. **/
    virtual double calcDisplacement(const double* delta) const = 0;
    /** Writes the displacement per unit of each speed [m]; numU. **/
    virtual void getDisplacements(double* ofSpeeds) const = 0;

    /** The same for a difference of coordinates q. **/
    virtual double calcQDisplacement(const double* deltaQ) const = 0;

    /** The same for a difference of speeds, times the time during which it acts: h, or 1/Ω of a
    faster mode. **/
    virtual double calcUDisplacement(const double* deltaU, double h) const = 0;

    /** Power of damping forces [W], zero or negative. **/
    virtual double calcDampingPower(const double* u) const = 0;

    /** Power of loads on the whole block [W]. **/
    virtual double calcLoadPower(const EvaluationContext&, const double* /*q*/,
                                 const double* /*u*/) {
        return 0;
    }

    /** Coordinates and speeds from and to a Simbody State; for reading, it is realized to
    Stage::Velocity. **/
    virtual void getFromState(const SimTK::State& state, double* q, double* u) const = 0;
    virtual void putIntoState(const double* q, const double* u, SimTK::State& state) const = 0;
    /** Writes the block's u̇ in Simbody's numbering. **/
    virtual void putUDot(const double* q, const double* uDot, SimTK::Vector& simbodyUDot) const = 0;
};

/** Returns `q⊗(0, ω)` (ω in the body) or `(0, ω)⊗q` (ω in the base) for q = (w, x, y, z). **/
Eigen::Vector4d multiplyQuaternion(const Eigen::Vector4d& q, const Eigen::Vector3d& omega,
                                   bool inBody);

/** Closed-form solution of q = q_hist + ½γ Ω(ω) q: (1 + aΩ) q_hist/(1 + a²|ω|²), a = γ/2. **/
Eigen::Vector4d integrateQuaternion(const Eigen::Vector4d& qHist, double gamma,
                                    const Eigen::Vector3d& omega, bool inBody);

/** q rotated by the rotation vector δ, normalised. **/
Eigen::Vector4d displaceQuaternion(const Eigen::Vector4d& q, const Eigen::Vector3d& delta,
                                   bool inBody);

/** Replaces q by −q if that is nearer to the reference. **/
void alignQuaternion(const double* reference, double* q);

/** Rotation of a quaternion of any length. **/
SimTK::Rotation rotationOf(const double* quaternion);

}  // namespace simflex
