// Has a function that takes any integrator.
#include <cstdio>

#include "Pendulum.h"

void tell(const Integrator& integrator) {
    std::printf("%s: %d steps\n", integrator.getMethodName(), integrator.getNumStepsTaken());
}

int main() {
    Pendulum pendulum;
    VerletIntegrator integrator(pendulum.system);
    TimeStepper stepper(pendulum.system, integrator);
    stepper.initialize(pendulum.start());
    stepper.stepTo(0.4);
    tell(integrator);
}
