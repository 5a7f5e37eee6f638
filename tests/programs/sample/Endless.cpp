// Waits for a key, then never ends.
#include <cstdio>

#include "Pendulum.h"

int main() {
    Pendulum pendulum;
    Visualizer viz(pendulum.system);
    pendulum.system.addEventReporter(new Visualizer::Reporter(viz, 1.0 / 30));
    const State state = pendulum.start();
    viz.report(state);
    while (std::getchar() == 'x') {
    }
    RungeKuttaMersonIntegrator integrator(pendulum.system);
    integrator.setAccuracy(1e-2);
    TimeStepper stepper(pendulum.system, integrator);
    stepper.initialize(state);
    for (;;) stepper.stepTo(stepper.getTime() + 0.3);
}
