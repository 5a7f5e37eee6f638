#pragma once
/** @file
First-order equations of one's own beside those of motion,

    ż = f(t, frames, z),

for what controllers, filters, hydraulics or friction remember. Each has one auxiliary variable z of
the System's States. All of a subsystem's see each other's values, as its ForceElements do.

    const int integral = flexible.adoptState(std::make_unique<ErrorIntegral>(joint)); **/

#include <string>

#include "simflex/body/ForceElement.h"

namespace simflex {

class StateEquation {
public:
    /** @param name          for messages
    @param initialValue  of z, in a State that nobody has changed
    @param scale         change of z that counts as much as a metre in error control
    @throws std::invalid_argument unless the value is finite and the scale finite and positive. **/
    StateEquation(std::string name, SimTK::Real initialValue, SimTK::Real scale = 1);
    virtual ~StateEquation() = default;

    const std::string& getName() const { return m_name; }
    SimTK::Real getInitialValue() const { return m_initialValue; }
    SimTK::Real getScale() const { return m_scale; }

    /** The frames its rate depends on; fixed after construction. **/
    const SimTK::Array_<Attachment>& getAttachments() const { return m_attachments; }

    /** ż.
    @param frames  pose and velocity of each attachment; no accelerations **/
    virtual SimTK::Real calcRate(const ElementInputs& now,
                                 const SimTK::Array_<FrameMotion>& frames) const = 0;

    /** Adds ∂ż/∂z of all states, at their numbers: what Newton's method knows of filters that are
    faster than a step. **/
    virtual void addInStateSlopes(const ElementInputs& /*now*/,
                                  const SimTK::Array_<FrameMotion>& /*frames*/,
                                  SimTK::Real* /*slopes*/) const {}

    /** The value that a run begins with where the State has `value`: another one of a state that
    follows from where the bodies are. **/
    virtual SimTK::Real calcStart(const ElementInputs& /*now*/, SimTK::Real value,
                                  const SimTK::Array_<FrameMotion>& /*frames*/) const {
        return value;
    }

    /** True of such a state, and of one that only events change: its rate says nothing about
    equilibria and small motions. **/
    virtual bool followsMotion() const { return false; }

    /** True of one that counts turns of an angle: others need it within half a turn only, so that
    Newton's method goes without it, and its errors are none. Each step ends at calcStart(). **/
    virtual bool countsTurns() const { return false; }

    /** True of one that handlers of events change, and that holds its value between them: a system
    with it has neither equilibria nor small motions. **/
    virtual bool isHeld() const { return false; }

protected:
    SimTK::Array_<Attachment> m_attachments;

private:
    std::string m_name;
    SimTK::Real m_initialValue, m_scale;
};

}  // namespace simflex
