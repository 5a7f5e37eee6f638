#include "validation/SpinUpBeam.h"

#include <cmath>

#include "simflex/body/Joint.h"
#include "validation/Beam.h"

namespace simflex::test {

using namespace SimTK;

namespace {

/** EA = 2.8e7 N, EI = 1.4e4 N m², ρA = 1.2 kg/m. **/
const std::shared_ptr<const ReducedBody>& getPart() {
    static const auto part = [] {
        BeamOptions options;
        options.length = SpinUpBeam::Length;
        options.height = options.width = std::sqrt(12 * 1.4e4 / 2.8e7);
        const double area = options.height * options.width;
        options.E = 2.8e7 / area;
        options.density = 1.2 / area;
        return makeBeam(options);
    }();
    return part;
}

}  // namespace

SpinUpBeam::SpinUpBeam() : beam(flexible, getPart()) {
    const Attachment root = beam.interface("root");
    Joint::Pin(flexible, matter.Ground(), root);
    Joint::PrescribedRotation(flexible, matter.Ground(), root, calcRootAngle);
}

Vec3 SpinUpBeam::calcRootAngle(Real t) {
    if (t >= RampTime) return {Speed * (t - RampTime / 2), Speed, 0};
    const Real a = Speed / RampTime, w = 2 * Pi / RampTime;
    return {a * (t * t / 2 + (std::cos(w * t) - 1) / (w * w)), a * (t - std::sin(w * t) / w),
            a * (1 - std::cos(w * t))};
}

State SpinUpBeam::makeState() {
    State state = system.realizeTopology();
    beam.setPoseByInterface(state, "root", Transform());
    return state;
}

Vec2 SpinUpBeam::calcTip(const State& state) const {
    system.realize(state, Stage::Velocity);
    const Rotation R(calcRootAngle(state.getTime())[0], ZAxis);
    const Vec3 tip = ~R * beam.interface("tip").calcMotion(state).X.p();
    return {tip[0] - Length, tip[1]};
}

}  // namespace simflex::test
