#pragma once
/** @file
User-defined first-order equations in addition to the equations of motion,

    ż = f(t, frames, z),

for controllers, filters, hydraulics or friction with memory. Each equation has one auxiliary
variable z of the System's States. All equations and ForceElements of a subsystem can read all
values z.

    const int integral = flexible.adoptState(std::make_unique<ErrorIntegral>(joint));  **/

#include <string>

#include "simflex/body/ForceElement.h"

namespace simflex {

class StateEquation {
public:
    /** @param name          for messages
    @param initialValue  of z in a new State
    @param scale         change of z that counts as a metre in error control
    @throws std::invalid_argument unless the value is finite and the scale finite and positive. **/
    StateEquation(std::string name, SimTK::Real initialValue, SimTK::Real scale = 1);
    virtual ~StateEquation() = default;

    const std::string& getName() const { return m_name; }
    SimTK::Real getInitialValue() const { return m_initialValue; }
    SimTK::Real getScale() const { return m_scale; }

    /** Returns the frames that the rate depends on; fixed after construction. **/
    const SimTK::Array_<Attachment>& getAttachments() const { return m_attachments; }

    /** Returns ż.
    @param frames  pose and velocity of each attachment; no accelerations **/
    virtual SimTK::Real calcRate(const ElementInputs& now,
                                 const SimTK::Array_<FrameMotion>& frames) const = 0;

    /** Adds ∂ż/∂z for all states, by index. Newton's method needs it for filters faster than a
    step. **/
    virtual void addInStateSlopes(const ElementInputs& /*now*/,
                                  const SimTK::Array_<FrameMotion>& /*frames*/,
                                  SimTK::Real* /*slopes*/) const {}

    /** Returns the initial value for a run from a State with `value`; differs from it if z follows
    from positions. **/
    virtual SimTK::Real calcStart(const ElementInputs& /*now*/, SimTK::Real value,
                                  const SimTK::Array_<FrameMotion>& /*frames*/) const {
        return value;
    }

    /** Returns whether z follows from positions or is changed by events only. Its rate is then
    ignored in equilibria and linearisation. **/
    virtual bool followsMotion() const { return false; }

    /** Returns whether z counts turns of an angle. Only half a turn of accuracy is needed, so
    Newton's method and error control omit z, and each step ends with calcStart(). **/
    virtual bool countsTurns() const { return false; }

    /** Returns whether z is constant between events that change it. Systems with such a state have
    neither equilibria nor a linearisation. **/
    virtual bool isHeld() const { return false; }

protected:
    SimTK::Array_<Attachment> m_attachments;

private:
    std::string m_name;
    SimTK::Real m_initialValue, m_scale;
};

}  // namespace simflex
