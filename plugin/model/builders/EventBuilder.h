#pragma once
/** @file
Adds the events of a model file to its system: handlers that are triggered where a condition begins
to hold, and do what the file says. **/

#include "simflex/model/builders/SignalBuilder.h"

namespace simflex {
namespace model {

/** What laws and states know of an event by its name: how often it has happened. Before laws are
made. **/
void addEventCounts(const ModelValue& file, SignalBuilder& signals);

/** @param size  of the model as placed [m] **/
void addEvents(const ModelValue& file, SimTK::Real size, SignalBuilder& signals,
               ModelSystem& system);

}  // namespace model
}  // namespace simflex
