#pragma once
/** @file
Base class of the force elements in simflex/forces: spatial forces at attachments.

An element contributes its stiffness and damping to the Newton matrix as a sum of rank-one terms,

    −(γ ∂F/∂q·N + ∂F/∂u) ≈ Σ_i σ_i d_i d_iᵀ + Σ_j l_j r_jᵀ,    σ_i = ±1,

stacked over the attachments: coefficients of their spatial velocities (ω, v) in Ground. Changes of
direction and point of application are neglected. In the block elimination each d_i adds one row to
those of the joints, a pair (l_j, r_j) two, and bodies stay decoupled. **/

#include "simflex/body/Attachment.h"

namespace simflex {

/** Inputs of forces and equations besides the motions of their frames. **/
struct ElementInputs {
    ElementInputs(SimTK::Real now, const SimTK::Real* statesNow = nullptr)
        : time(now), states(statesNow) {}

    SimTK::Real time;
    const SimTK::Real* states;  ///< z of the subsystem's StateEquations, in their order
};

class ForceElement {
public:
    virtual ~ForceElement() = default;

    /** Name for messages; empty: none. **/
    const std::string& getName() const { return m_name; }
    void setName(const std::string& name) { m_name = name; }
    /** Returns "force 'mount'", or names the frames of an unnamed element. **/
    std::string describe() const;

    /** Returns the frames this element acts on; fixed after construction. **/
    const SimTK::Array_<Attachment>& getAttachments() const { return m_attachments; }

    /** Adds the spatial force (torque, force) on each attachment frame's origin, in Ground.
    @param[in]     frames    pose and velocity of each attachment
    @param[in,out] forces_G  one per attachment **/
    virtual void addInForces([[maybe_unused]] const ElementInputs& now,
                             [[maybe_unused]] const SimTK::Array_<FrameMotion>& frames,
                             [[maybe_unused]] SimTK::Array_<SimTK::SpatialVec>& forces_G) const {}

    /** @name Additional force that depends on time alone
    The solver evaluates it once per time and applies it at any pose. **/
    /**@{**/
    virtual bool hasTimedForce() const { return false; }
    /** Returns (torque, force) in axes of the element's choice. **/
    virtual SimTK::SpatialVec calcTimedForce(SimTK::Real /*time*/) const {
        return {SimTK::Vec3(0), SimTK::Vec3(0)};
    }
    /** Adds that force, expressed in Ground, as addInForces() does. **/
    virtual void addInTimedForce(
        [[maybe_unused]] const SimTK::SpatialVec& force,
        [[maybe_unused]] const SimTK::Array_<FrameMotion>& frames,
        [[maybe_unused]] SimTK::Array_<SimTK::SpatialVec>& forces_G) const {}
    /**@}**/

    /** @name Numbers of terms d_i and of pairs (l_j, r_j) of the Jacobian; fixed after
    construction **/
    /**@{**/
    virtual int getNumJacobianTerms() const { return 0; }
    virtual int getNumJacobianPairs() const { return 0; }
    int getNumJacobianRows() const { return getNumJacobianTerms() + 2 * getNumJacobianPairs(); }
    /**@}**/

    /** @param[in]  gamma       γ: dq = γ N du [s]
    @param[out] signs       σ_i, one per term
    @param[out] directions  d_i: those of term 0 on every attachment, then of term 1 …; then l_0,
    r_0, l_1 …; vectors of any length **/
    virtual void calcJacobian([[maybe_unused]] const ElementInputs& now,
                              [[maybe_unused]] const SimTK::Array_<FrameMotion>& frames,
                              [[maybe_unused]] SimTK::Real gamma,
                              [[maybe_unused]] SimTK::Array_<SimTK::Real>& signs,
                              [[maybe_unused]] SimTK::Array_<SimTK::SpatialVec>& directions) const {
    }

    /** Returns the power of the forces that does not come from stored energy [W]: of applied loads
    and dampers.
    @param forces_G  those of addInForces() and addInTimedForce() **/
    virtual SimTK::Real calcPower(const ElementInputs& /*now*/,
                                  const SimTK::Array_<FrameMotion>& frames,
                                  const SimTK::Array_<SimTK::SpatialVec>& forces_G) const {
        SimTK::Real power = 0;
        for (unsigned k = 0; k < frames.size(); ++k)
            power += ~forces_G[k][0] * frames[k].V[0] + ~forces_G[k][1] * frames[k].V[1];
        return power;
    }

    /** Returns the energy stored by the element [J]. **/
    virtual SimTK::Real calcPotentialEnergy(const ElementInputs& /*now*/,
                                            const SimTK::Array_<FrameMotion>& /*frames*/) const {
        return 0;
    }

    /** @name Valid range of the element
    Runs warn once, by name, about an element that has left it. **/
    /**@{**/
    /** Returns whether describeOutOfRange() ever returns text. **/
    virtual bool hasRange() const { return false; }
    /** Returns why the force is not valid at this pose, as a predicate: "is turned by 3 rad; …".
    Empty within the valid range.

    The second argument is the time since the last call [s], in which the element may have been
    elsewhere; 0: unknown. **/
    virtual std::string describeOutOfRange(const SimTK::Array_<FrameMotion>& /*frames*/,
                                           SimTK::Real /*elapsed*/) const {
        return {};
    }
    /**@}**/

protected:
    SimTK::Array_<Attachment> m_attachments;

private:
    std::string m_name;
};

inline std::string ForceElement::describe() const {
    if (!m_name.empty()) return "force '" + m_name + "'";
    std::string text = getNumJacobianRows() == 0 ? "the load" : "the spring, damper or stop";
    const char* separator = m_attachments.size() > 1 ? " between " : " on ";
    for (const Attachment& attachment : m_attachments) {
        text += separator + ("'" + attachment.getName() + "'");
        separator = " and ";
    }
    return text;
}

}  // namespace simflex
