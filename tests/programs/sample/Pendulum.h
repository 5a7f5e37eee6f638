#pragma once
// Shared by the sample programs.
#include "Simbody.h"

using namespace SimTK;

struct Pendulum {
    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    GeneralForceSubsystem forces{system};
    Force::Gravity gravity{forces, matter, -YAxis, 9.81};
    MobilizedBody::Pin bar{matter.Ground(), Vec3(0),
                           Body::Rigid(MassProperties(1, Vec3(0, -1, 0), Inertia(1.1, 0.1, 1.1))),
                           Vec3(0)};
    State start() {
        State state = system.realizeTopology();
        bar.setAngle(state, 1);
        return state;
    }
};
