#pragma once
/** @file
A joint as Simbody sees it: a Constraint::Custom on the body frames and modal mobilizers (private
header). **/

#include "simflex/body/FlexibleBodySubsystemGuts.h"

namespace simflex {

/** Adds the constraint to the matter subsystem and returns its index. **/
SimTK::ConstraintIndex addJointConstraint(const FlexibleBodySubsystem::Guts& guts,
                                          SimTK::SimbodyMatterSubsystem& matter,
                                          const JointRecord& joint);

}  // namespace simflex
