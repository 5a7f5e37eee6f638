// Has no integrator: RungeKuttaMersonIntegrator is only spoken of.
#include "Pendulum.h"

int main() {
    Pendulum pendulum;
    pendulum.system.realize(pendulum.start(), Stage::Acceleration);
}
