// A controller with an integral term turns an arm to half a radian and holds it against its weight.
#include "Simbody.h"
#include "simflex/body/FlexibleBodySubsystem.h"
#include "simflex/forces/StateForces.h"
#include "simflex/solver/RadauIntegrator.h"
using namespace SimTK;
using namespace simflex;

/** constant + Σ c_i x_i, with its slopes. **/
Signal sum(const std::vector<Signal>& terms, const std::vector<Real>& factors, Real constant = 0) {
    return Signal::function(terms, [=](Real, const Real* x, Real* slopes) {
        Real value = constant;
        for (size_t i = 0; i < factors.size(); ++i) {
            value += factors[i] * x[i];
            if (slopes) slopes[i] = factors[i];
        }
        return value;
    });
}

int main() {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    GeneralForceSubsystem forces(system);
    FlexibleBodySubsystem flexible(system, matter);
    Force::Gravity(forces, matter, -YAxis, 9.81);
    const MobilizedBody::Free arm(matter.Ground(),
                                  Body::Rigid(MassProperties(2, Vec3(0), Inertia(0.1))));
    const Joint::Pin shoulder(flexible, matter.Ground(), Attachment(arm, Vec3(-0.3, 0, 0)));

    const Signal error = sum({Signal::turnedAngle(flexible, shoulder)}, {-1}, 0.5),
                 speed = Signal::coordinateRate(shoulder);
    const int integral =
        flexible.adoptState(std::make_unique<SignalState>("integral of the error", error));
    CoordinateForce(flexible, shoulder, 0,
                    sum({error, speed, Signal::state(integral)}, {200, -20, 300}));

    State state = system.realizeTopology();
    arm.setQToFitTranslation(state, Vec3(0.3, 0, 0));
    RadauIntegrator integrator(system);
    integrator.initialize(state);
    integrator.stepTo(6);
    const Real angle = shoulder.calcCoordinates(integrator.getState())[0];
    std::cout << angle << " rad; torque against the weight "
              << 300 * flexible.getStateValue(integrator.getState(), integral) << " N m\n";
    return std::abs(angle - 0.5) < 1e-3 ? 0 : 1;
}
