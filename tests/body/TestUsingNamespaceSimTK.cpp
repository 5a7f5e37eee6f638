/** @file
Most Simbody programs start like this one: every public header must compile after it. **/

#include "Simbody.h"

using namespace SimTK;

#include "simflex/body/Attachment.h"
#include "simflex/body/FlexibleBody.h"
#include "simflex/body/FlexibleBodySubsystem.h"
#include "simflex/body/ForceElement.h"
#include "simflex/body/FrameMotion.h"
#include "simflex/body/InterfaceKinematics.h"
#include "simflex/body/Joint.h"
#include "simflex/body/JointEquations.h"
#include "simflex/body/ModalMobilizer.h"
#include "simflex/body/VtkReporter.h"
#include "simflex/forces/AttachmentForce.h"
#include "simflex/forces/ModalDamping.h"
#include "simflex/part/Mesh.h"
#include "simflex/part/ReducedBody.h"
#include "simflex/part/ReducedBodyFile.h"
#include "simflex/part/VtuFile.h"

#include <gtest/gtest.h>

#ifdef EIGEN_CORE_H
#error "a public header includes Eigen"
#endif
#ifdef EIGEN_WORLD_VERSION
#error "a public header includes Eigen"
#endif

#include "support/PointMassPart.h"

using namespace simflex;

TEST(PublicHeaders, WorkBesideUsingNamespaceSimTK) {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    FlexibleBodySubsystem flexible(system, matter);
    FlexibleBody crank(flexible, test::makePointMassPart().body);
    Joint::Pin shaft(flexible, matter.Ground(), crank.interface("A"));
    ModalDamping damping(flexible, crank, 0.01);
    AttachmentForce drive(flexible, crank.interface("B"),
                          [](Real t) { return SpatialVec(Vec3(0, 0, t), Vec3(0)); });
    State state = system.realizeTopology();
    system.realize(state, Stage::Dynamics);
    EXPECT_EQ(crank.getModalCoordinates(state).size(), crank.getNumModes());
}
