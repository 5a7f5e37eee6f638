#pragma once
/** @file
Adds the events of a model file to its system, as handlers triggered when a condition becomes true.
**/

#include "simflex/model/builders/SignalBuilder.h"

namespace simflex {
namespace model {

/** Adds states that count how often each event has happened, for use in laws and states. Must be
called before laws are made. **/
void addEventCounts(const ModelValue& file, SignalBuilder& signals);

/** @param size  of the model as placed [m] **/
void addEvents(const ModelValue& file, SimTK::Real size, SignalBuilder& signals,
               ModelSystem& system);

}  // namespace model
}  // namespace simflex
