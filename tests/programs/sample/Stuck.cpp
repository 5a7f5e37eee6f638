// Makes no step and does not end.
#include "Pendulum.h"

int main() {
    Pendulum pendulum;
    RungeKuttaMersonIntegrator integrator(pendulum.system);
    integrator.initialize(pendulum.start());
    for (volatile int i = 0;; i = i + 1) {
    }
}
