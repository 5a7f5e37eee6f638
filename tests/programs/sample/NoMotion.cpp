// Has no integrator, although it mentions RungeKuttaMersonIntegrator.
#include "Pendulum.h"

int main() {
    Pendulum pendulum;
    pendulum.system.realize(pendulum.start(), Stage::Acceleration);
}
