#pragma once
/** @file
What waits in a model for something to begin: events, relays. Each may set others off, at the same
time. **/

#include <functional>
#include <string>

#include "simflex/model/builders/ModelSystem.h"

namespace simflex {
namespace model {

class ModelTrigger : public SimTK::TriggeredEventHandler {
public:
    ModelTrigger(const ModelSystem& system, const std::string& name);

    const std::string& getName() const { return m_name; }
    /** Does what is to be done where its value rises above zero. **/
    virtual void act(SimTK::State& state, bool& shouldTerminate) const = 0;
    /** The same, and what it sets off. **/
    void handleEvent(SimTK::State& state, SimTK::Real, bool& shouldTerminate) const final;

protected:
    const ModelSystem& m_system;

private:
    std::string m_name;
};

/** Gives it to the system, which owns it then. **/
void addTrigger(const ModelTrigger* trigger, ModelSystem& system);

/** Makes a change at one time, and then what it sets off: triggers whose value was negative before
and is positive now, one after the other.
@param own  whose change it is: it may be set off again, whatever its value was
@throws std::runtime_error that names the last two if that has no end. **/
void changeWithTriggers(const ModelSystem& system, SimTK::State& state, bool& shouldTerminate,
                        const std::function<void()>& change, const ModelTrigger* own = nullptr);

}  // namespace model
}  // namespace simflex
