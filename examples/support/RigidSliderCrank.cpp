#include "support/RigidSliderCrank.h"

#include "support/InterfacePoint.h"

namespace simflex::examples {

using namespace SimTK;

namespace {

/** The part as a rigid body with its origin at an interface. `extraInertia` about z [kg m²] has no
mass. **/
Body::Rigid makeRigidBody(const ReducedBody& part, const std::string& interface,
                          double extraInertia = 0) {
    const Vec3 center = -positionOf(part, interface);
    const auto& I = part.inertia;
    const Inertia central(Vec3(I[0], I[1], I[2]), Vec3(I[3], I[4], I[5]));
    const Inertia extra(Vec3(extraInertia / 2, extraInertia / 2, extraInertia));
    return Body::Rigid(
        MassProperties(part.mass, center, central.shiftFromMassCenter(center, part.mass) + extra));
}

/** Prescribes the crank's angle, see SliderCrankOptions. **/
class CrankMotion : public Motion::Custom::Implementation {
public:
    explicit CrankMotion(const SliderCrankOptions& options) : m_options(options) {}
    Implementation* clone() const override { return new CrankMotion(*this); }
    Motion::Level getLevel(const State&) const override { return Motion::Position; }
    void calcPrescribedPosition(const State& state, int, Real* q) const override {
        q[0] = m_options.calcAngle(state.getTime())[0];
    }
    void calcPrescribedPositionDot(const State& state, int, Real* qDot) const override {
        qDot[0] = m_options.calcAngle(state.getTime())[1];
    }
    void calcPrescribedPositionDotDot(const State& state, int, Real* qDotDot) const override {
        qDotDot[0] = m_options.calcAngle(state.getTime())[2];
    }

private:
    SliderCrankOptions m_options;
};

/** Applies the crank's torque, see SliderCrankOptions. **/
class CrankTorque : public Force::Custom::Implementation {
public:
    CrankTorque(const SliderCrankOptions& options, const MobilizedBody& crank)
        : m_options(options), m_crank(crank) {}
    void calcForce(const State& state, Vector_<SpatialVec>&, Vector_<Vec3>&,
                   Vector& mobilityForces) const override {
        m_crank.applyOneMobilityForce(state, 0, m_options.calcTorque(state.getTime()),
                                      mobilityForces);
    }
    Real calcPotentialEnergy(const State&) const override { return 0; }
    bool dependsOnlyOnPositions() const override { return false; }

private:
    SliderCrankOptions m_options;
    MobilizedBody m_crank;
};

}  // namespace

std::vector<RigidSample> runRigidSliderCrank(const SliderCrankOptions& options,
                                             const ReducedBody& crankPart,
                                             const ReducedBody& rodPart,
                                             const std::vector<double>& times, double accuracy,
                                             const std::function<bool(double)>& keepGoing) {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    GeneralForceSubsystem forces(system);
    Force::Gravity gravity(forces, matter, -YAxis, options.gravity);
    const Vec3 toPin = positionOf(crankPart, "pin") - positionOf(crankPart, "shaft");
    const Vec3 toSmallEnd = positionOf(rodPart, "small_end") - positionOf(rodPart, "big_end");
    MobilizedBody::Pin crank(matter.Ground(), Transform(),
                             makeRigidBody(crankPart, "shaft", options.calcFlywheelInertia()),
                             Transform());
    MobilizedBody::Pin rod(crank, toPin, makeRigidBody(rodPart, "big_end"), Transform());
    MobilizedBody::Slider slider(
        matter.Ground(), Transform(),
        Body::Rigid(MassProperties(options.sliderMass, Vec3(0), UnitInertia(1))), Transform());
    Constraint::PointInPlane onLine(matter.Ground(), YAxis, 0, rod, toSmallEnd);
    Constraint::PointInPlane onSlider(slider, XAxis, 0, rod, toSmallEnd);
    if (options.drive == SliderCrankOptions::Drive::Speed)
        Motion::Custom(crank, new CrankMotion(options));
    else
        Force::Custom(forces, new CrankTorque(options, crank));

    State state = system.realizeTopology();
    slider.setOneQ(state, 0, toPin.norm() + toSmallEnd.norm());
    RungeKuttaMersonIntegrator integrator(system);
    integrator.setAccuracy(accuracy);
    TimeStepper stepper(system, integrator);
    stepper.initialize(state);

    std::vector<RigidSample> samples;
    for (double time : times) {
        stepper.stepTo(time);
        const State& now = stepper.getState();
        system.realize(now, Stage::Acceleration);
        const SpatialVec reaction = crank.findMobilizerReactionOnBodyAtMInGround(now);
        samples.push_back({slider.getOneQ(now, 0), reaction[1]});
        if (!keepGoing(time / times.back())) break;
    }
    return samples;
}

}  // namespace simflex::examples
