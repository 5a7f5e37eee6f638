#include "solver/SliderCrankModel.h"

#include <cmath>

#include "simflex/forces/AttachmentForce.h"
#include "simflex/forces/ModalDamping.h"
#include "simflex/part/ReducedBodyFile.h"

namespace simflex::test {

using namespace SimTK;

namespace {

constexpr Real Gravity = 9.81;

MassProperties sliderProperties() {
    return MassProperties(SliderMass, Vec3(0), SliderMass * UnitInertia::brick(0.02, 0.015, 0.015));
}

Real calcRodAngle(Real crankAngle) {
    return -std::asin(CrankLength / RodLength * std::sin(crankAngle));
}

Real calcSliderPosition(Real crankAngle) {
    return CrankLength * std::cos(crankAngle) + RodLength * std::cos(calcRodAngle(crankAngle));
}

/** Returns the mass properties of a part about its first interface, in deck axes. **/
MassProperties propertiesAbout(const ReducedBody& part, const std::string& interface) {
    const auto& s = part.getInterface(interface).position;
    const Vec3 toCenter(-s[0], -s[1], -s[2]);
    const auto& I = part.inertia;
    const Inertia central(I[0], I[1], I[2], I[3], I[4], I[5]);
    return MassProperties(part.mass, toCenter, central.shiftFromMassCenter(-toCenter, part.mass));
}

class CrankTorque : public Force::Custom::Implementation {
public:
    CrankTorque(const MobilizedBody& crank, Torque torque)
        : m_crank(crank), m_torque(std::move(torque)) {}
    void calcForce(const State& state, Vector_<SpatialVec>& bodyForces, Vector_<Vec3>&,
                   Vector&) const override {
        bodyForces[m_crank.getMobilizedBodyIndex()][0] += Vec3(0, 0, m_torque(state.getTime()));
    }
    Real calcPotentialEnergy(const State&) const override { return 0; }

private:
    const MobilizedBody& m_crank;
    Torque m_torque;
};

}  // namespace

Torque makeRampedTorque(Real value, Real ramp) {
    return [=](Real t) {
        const Real x = std::clamp(t / ramp, Real(0), Real(1));
        return value * x * x * x * x * (35 - 84 * x + 70 * x * x - 20 * x * x * x);
    };
}

std::shared_ptr<const ReducedBody> loadPart(const std::string& name, Real stiffnessFactor) {
    const ReducedBody part = readReducedBody(SIMFLEX_BINARY_DIR "/parts/" + name + ".h5");
    return std::make_shared<const ReducedBody>(part.withScaledStiffness(stiffnessFactor));
}

FlexibleSliderCrank::FlexibleSliderCrank(const SliderCrankOptions& options)
    : matter(system),
      forces(system),
      gravity(forces, matter, -YAxis, Gravity),
      flexible(system, matter),
      crank(flexible, loadPart("crank", options.stiffnessFactor)),
      rod(flexible, loadPart("rod", options.stiffnessFactor)),
      slider(matter.Ground(), Transform(), Body::Rigid(sliderProperties()), Transform()),
      mainBearing(flexible, matter.Ground(), crank.interface("shaft"), "main bearing"),
      crankPin(flexible, crank.interface("pin"), rod.interface("big_end"), "crank pin"),
      gudgeonPin(flexible, rod.interface("small_end"), slider, "gudgeon pin") {
    if (options.dampingRatio > 0) {
        ModalDamping(flexible, crank, options.dampingRatio);
        ModalDamping(flexible, rod, options.dampingRatio);
    }
    if (options.angle)
        Joint::PrescribedRotation(flexible, matter.Ground(), crank.interface("shaft"),
                                  options.angle, "drive");
    else
        AttachmentForce(flexible, crank.interface("shaft"), [torque = options.torque](Real t) {
            return SpatialVec(Vec3(0, 0, torque(t)), Vec3(0));
        });
    state = system.realizeTopology();
    const Rotation crankTurn(options.startAngle, ZAxis);
    crank.setPoseByInterface(state, "shaft", Transform(crankTurn));
    rod.setPoseByInterface(state, "big_end",
                           Transform(Rotation(calcRodAngle(options.startAngle), ZAxis),
                                     crankTurn * Vec3(CrankLength, 0, 0)));
    slider.setOneQ(state, 0, calcSliderPosition(options.startAngle));
}

RigidSliderCrank::RigidSliderCrank(const SliderCrankOptions& options)
    : matter(system),
      forces(system),
      gravity(forces, matter, -YAxis, Gravity),
      crank(matter.Ground(), Transform(), Body::Rigid(propertiesAbout(*loadPart("crank"), "shaft")),
            Transform()),
      rod(crank, Transform(Vec3(CrankLength, 0, 0)),
          Body::Rigid(propertiesAbout(*loadPart("rod"), "big_end")), Transform()),
      slider(matter.Ground(), Transform(), Body::Rigid(sliderProperties()), Transform()) {
    Constraint::PointInPlane(slider, UnitVec3(XAxis), 0, rod, Vec3(RodLength, 0, 0));
    Constraint::PointInPlane(slider, UnitVec3(YAxis), 0, rod, Vec3(RodLength, 0, 0));
    Force::Custom(forces, new CrankTorque(crank, options.torque));
    state = system.realizeTopology();
    crank.setOneQ(state, 0, options.startAngle);
    rod.setOneQ(state, 0, calcRodAngle(options.startAngle) - options.startAngle);
    slider.setOneQ(state, 0, calcSliderPosition(options.startAngle));
}

State RigidSliderCrank::integrate(Real time) const {
    RungeKuttaMersonIntegrator integrator(system);
    integrator.setAccuracy(1e-10);
    integrator.setConstraintTolerance(1e-12);
    TimeStepper stepper(system, integrator);
    stepper.initialize(state);
    stepper.stepTo(time);
    State end = stepper.getState();
    system.realize(end, Stage::Acceleration);
    return end;
}

}  // namespace simflex::test
