#pragma once
/** @file
Events and relays of a model. A trigger may set off others at the same time. **/

#include <functional>
#include <string>

#include "simflex/model/builders/ModelSystem.h"

namespace simflex {
namespace model {

class ModelTrigger : public SimTK::TriggeredEventHandler {
public:
    ModelTrigger(const ModelSystem& system, const std::string& name);

    const std::string& getName() const { return m_name; }
    /** Performs the action, when the value rises above zero. **/
    virtual void act(SimTK::State& state, bool& shouldTerminate) const = 0;
    /** Performs the action, and all that it sets off. **/
    void handleEvent(SimTK::State& state, SimTK::Real, bool& shouldTerminate) const final;

protected:
    const ModelSystem& m_system;

private:
    std::string m_name;
};

/** Adds a trigger to the system, which takes ownership. **/
void addTrigger(const ModelTrigger* trigger, ModelSystem& system);

/** Makes a change, then runs all triggers that it sets off, one after another: those whose value
was negative before and is positive now.
@param own  the trigger that makes the change; it may be set off again, whatever its value was
@throws std::runtime_error naming the last two if this does not end. **/
void changeWithTriggers(const ModelSystem& system, SimTK::State& state, bool& shouldTerminate,
                        const std::function<void()>& change, const ModelTrigger* own = nullptr);

}  // namespace model
}  // namespace simflex
