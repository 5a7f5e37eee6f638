// Ends with an exception under one of two integrators.
#include "Pendulum.h"

int main() {
    Pendulum pendulum;
    CPodesIntegrator integrator(pendulum.system, CPodes::BDF);
    if (std::string(integrator.getMethodName()) == "Radau") throw std::runtime_error("no such thing");
    TimeStepper stepper(pendulum.system, integrator);
    stepper.initialize(pendulum.start());
    stepper.stepTo(1);
}
