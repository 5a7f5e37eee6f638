#pragma once
/** @file
Base of the force elements in simflex/forces: spatial forces at attachments.

For the Newton matrix an element gives its stiffness and damping as a sum of terms of rank one,

    −(γ ∂F/∂q·N + ∂F/∂u) ≈ Σ_i σ_i d_i d_iᵀ + Σ_j l_j r_jᵀ,    σ_i = ±1,

all stacked over the attachments: factors of their twists (ω, v), in Ground. What turns a force or
moves its point is left out. In the block elimination every d_i is one row more beside those of the
joints, a pair (l_j, r_j) two, and bodies stay apart. **/

#include "simflex/body/Attachment.h"

namespace simflex {

/** What forces and equations know besides the motions of their frames. **/
struct ElementInputs {
    ElementInputs(SimTK::Real now, const SimTK::Real* statesNow = nullptr)
        : time(now), states(statesNow) {}

    SimTK::Real time;
    const SimTK::Real* states;  ///< z of the subsystem's StateEquations, in their order
};

class ForceElement {
public:
    virtual ~ForceElement() = default;

    /** For messages; empty: none. **/
    const std::string& getName() const { return m_name; }
    void setName(const std::string& name) { m_name = name; }
    /** "force 'mount'"; without a name by the frames it acts on. **/
    std::string describe() const;

    /** The frames this element acts on; fixed after construction. **/
    const SimTK::Array_<Attachment>& getAttachments() const { return m_attachments; }

    /** Adds the spatial force (torque, force) on each attachment frame's origin, in Ground.
    @param[in]     frames    pose and velocity of each attachment
    @param[in,out] forces_G  one per attachment **/
    virtual void addInForces([[maybe_unused]] const ElementInputs& now,
                             [[maybe_unused]] const SimTK::Array_<FrameMotion>& frames,
                             [[maybe_unused]] SimTK::Array_<SimTK::SpatialVec>& forces_G) const {}

    /** @name A force that depends on time alone, beside the others
    The solver asks for it once for every time, at whatever poses it is then applied. **/
    /**@{**/
    virtual bool hasTimedForce() const { return false; }
    /** (torque, force) in axes of the element's choice. **/
    virtual SimTK::SpatialVec calcTimedForce(SimTK::Real /*time*/) const {
        return {SimTK::Vec3(0), SimTK::Vec3(0)};
    }
    /** Adds it in Ground, as addInForces() does. **/
    virtual void addInTimedForce(
        [[maybe_unused]] const SimTK::SpatialVec& force,
        [[maybe_unused]] const SimTK::Array_<FrameMotion>& frames,
        [[maybe_unused]] SimTK::Array_<SimTK::SpatialVec>& forces_G) const {}
    /**@}**/

    /** @name Numbers of terms d_i and of pairs (l_j, r_j) of the Jacobian; fixed after construction
     * **/
    /**@{**/
    virtual int getNumJacobianTerms() const { return 0; }
    virtual int getNumJacobianPairs() const { return 0; }
    int getNumJacobianRows() const { return getNumJacobianTerms() + 2 * getNumJacobianPairs(); }
    /**@}**/

    /** @param[in]  gamma       γ: dq = γ N du [s]
    @param[out] signs       σ_i, one per term
    @param[out] directions  d_i: those of term 0 on every attachment, then of term 1 …; then those
    of l_0, r_0, l_1 …, each of whatever length **/
    virtual void calcJacobian([[maybe_unused]] const ElementInputs& now,
                              [[maybe_unused]] const SimTK::Array_<FrameMotion>& frames,
                              [[maybe_unused]] SimTK::Real gamma,
                              [[maybe_unused]] SimTK::Array_<SimTK::Real>& signs,
                              [[maybe_unused]] SimTK::Array_<SimTK::SpatialVec>& directions) const {
    }

    /** Power of the forces beyond what leaves the stored energy [W]: of applied loads and dampers.
    @param forces_G  of addInForces() and addInTimedForce() **/
    virtual SimTK::Real calcPower(const ElementInputs& /*now*/,
                                  const SimTK::Array_<FrameMotion>& frames,
                                  const SimTK::Array_<SimTK::SpatialVec>& forces_G) const {
        SimTK::Real power = 0;
        for (unsigned k = 0; k < frames.size(); ++k)
            power += ~forces_G[k][0] * frames[k].V[0] + ~forces_G[k][1] * frames[k].V[1];
        return power;
    }

    /** Energy stored by the element [J]. **/
    virtual SimTK::Real calcPotentialEnergy(const ElementInputs& /*now*/,
                                            const SimTK::Array_<FrameMotion>& /*frames*/) const {
        return 0;
    }

    /** @name Range in which the force means what the element promises
    Runs warn, once and by name, where an element has left it. **/
    /**@{**/
    /** Whether describeOutOfRange() ever says something. **/
    virtual bool hasRange() const { return false; }
    /** Why the force is not to be trusted where the frames are, after the element's name: "is
    turned by 3 rad; …"; empty: it is in its range.
    The time since it was asked last [s], in which it may have been elsewhere, comes with them; 0:
    nothing is known of it. **/
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
