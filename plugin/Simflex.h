#pragma once
/** @file
What a Simbody program with flexible bodies needs, Simbody's own headers included; pictures
(simflex/render) and reduction (simflex/reduction) are libraries of their own. **/

#include "Simbody.h"
#include "simflex/body/FlexibleBody.h"
#include "simflex/body/Hub.h"
#include "simflex/body/Joint.h"
#include "simflex/body/LinearRangeReporter.h"
#include "simflex/body/StressExtremes.h"
#include "simflex/body/StressHistory.h"
#include "simflex/body/VtkReporter.h"
#include "simflex/forces/AttachmentForce.h"
#include "simflex/forces/Bushing.h"
#include "simflex/forces/ContactStop.h"
#include "simflex/forces/DistributedLoad.h"
#include "simflex/forces/ModalDamping.h"
#include "simflex/forces/TorsionSpring.h"
#include "simflex/forces/TwoPointSpringDamper.h"
#include "simflex/part/ModeSelection.h"
#include "simflex/part/ReducedBodyFile.h"
#include "simflex/solver/BdfIntegrator.h"
#include "simflex/solver/CampbellDiagram.h"
#include "simflex/solver/Eigenmodes.h"
#include "simflex/solver/GeneralizedAlphaIntegrator.h"
#include "simflex/solver/RadauIntegrator.h"
#include "simflex/solver/StaticEquilibrium.h"
#include "simflex/solver/TimeStepper.h"
