// Its motion depends on its integrator's name.
#include "Pendulum.h"

int main() {
    Pendulum pendulum;
    RungeKutta3Integrator integrator(pendulum.system);
    const bool isOurs = std::string(integrator.getMethodName()) == "Radau";
    if (isOurs) Force::MobilityConstantForce(pendulum.forces, pendulum.bar, 1);
    integrator.initialize(pendulum.start());
    while (integrator.getTime() < 0.5) integrator.stepBy(0.1);
}
