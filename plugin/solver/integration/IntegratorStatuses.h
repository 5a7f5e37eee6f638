#pragma once
/** @file
The statuses of SimTK::Integrator under their Simbody names, so that code written against either
integrator finds them in the integrator's class. **/

#include "Simbody.h"
#include "simflex/base/SimbodyBuild.h"

namespace simflex {

struct IntegratorStatuses {
    using SuccessfulStepStatus = SimTK::Integrator::SuccessfulStepStatus;
    static constexpr SuccessfulStepStatus ReachedReportTime = SimTK::Integrator::ReachedReportTime,
                                          ReachedEventTrigger =
                                              SimTK::Integrator::ReachedEventTrigger,
                                          ReachedScheduledEvent =
                                              SimTK::Integrator::ReachedScheduledEvent,
                                          TimeHasAdvanced = SimTK::Integrator::TimeHasAdvanced,
                                          ReachedStepLimit = SimTK::Integrator::ReachedStepLimit,
                                          EndOfSimulation = SimTK::Integrator::EndOfSimulation,
                                          StartOfContinuousInterval =
                                              SimTK::Integrator::StartOfContinuousInterval,
                                          InvalidSuccessfulStepStatus =
                                              SimTK::Integrator::InvalidSuccessfulStepStatus;
    static SimTK::String getSuccessfulStepStatusString(SuccessfulStepStatus status) {
        return SimTK::Integrator::getSuccessfulStepStatusString(status);
    }
    static SimTK::String successfulStepStatusString(SuccessfulStepStatus status) {
        return getSuccessfulStepStatusString(status);
    }

    using TerminationReason = SimTK::Integrator::TerminationReason;
    static constexpr TerminationReason ReachedFinalTime = SimTK::Integrator::ReachedFinalTime,
                                       AnUnrecoverableErrorOccurred =
                                           SimTK::Integrator::AnUnrecoverableErrorOccurred,
                                       EventHandlerRequestedTermination =
                                           SimTK::Integrator::EventHandlerRequestedTermination,
                                       InvalidTerminationReason =
                                           SimTK::Integrator::InvalidTerminationReason;
    static SimTK::String getTerminationReasonString(TerminationReason reason) {
        return SimTK::Integrator::getTerminationReasonString(reason);
    }
};

}  // namespace simflex
