#pragma once
/** @file
A joint in Simbody: a Constraint::Custom on the body frames and modal mobilizers (private
header). **/

#include "simflex/body/FlexibleBodySubsystemGuts.h"

namespace simflex {

SimTK::ConstraintIndex addJointConstraint(const FlexibleBodySubsystem::Guts& guts,
                                          SimTK::SimbodyMatterSubsystem& matter,
                                          const JointRecord& joint);

}  // namespace simflex
