// Means of motion and constraint: custom and native mobilizers, constraints, contact, cables.

#include "programs/Program.h"

namespace simflex::test {
namespace {

using namespace SimTK;

/** A bead in the x-y plane under gravity. **/
struct Plane : Basics {
    explicit Plane(Model& model)
        : Basics(model), bead(matter.Ground(), Vec3(0), ball(1), Vec3(0)) {}
    Force::Gravity gravity{forces, matter, -YAxis, 9.81};
    MobilizedBody::Planar bead;  ///< q = (angle, x, y)
};

/** Constrains the bead to y = x²/2. **/
class Parabola : public Constraint::Custom::Implementation {
public:
    explicit Parabola(Plane& plane) : Implementation(plane.matter, 1, 0, 0) {
        m_bead = addConstrainedMobilizer(plane.bead);
    }
    Parabola* clone() const override { return new Parabola(*this); }
    void calcPositionErrors(const State& state, const Array_<Transform, ConstrainedBodyIndex>&,
                            const Array_<Real, ConstrainedQIndex>& q,
                            Array_<Real>& errors) const override {
        errors[0] = getOneQ(state, q, m_bead, y) - square(getOneQ(state, q, m_bead, x)) / 2;
    }
    void calcPositionDotErrors(const State& state, const Array_<SpatialVec, ConstrainedBodyIndex>&,
                               const Array_<Real, ConstrainedQIndex>& qDot,
                               Array_<Real>& errors) const override {
        errors[0] = getOneQDot(state, qDot, m_bead, y) -
                    getOneQFromState(state, m_bead, x) * getOneQDot(state, qDot, m_bead, x);
    }
    void calcPositionDotDotErrors(const State& state,
                                  const Array_<SpatialVec, ConstrainedBodyIndex>&,
                                  const Array_<Real, ConstrainedQIndex>& qDotDot,
                                  Array_<Real>& errors) const override {
        errors[0] = getOneQDotDot(state, qDotDot, m_bead, y) -
                    getOneQFromState(state, m_bead, x) * getOneQDotDot(state, qDotDot, m_bead, x) -
                    square(getOneQDotFromState(state, m_bead, x));
    }
    void addInPositionConstraintForces(const State& state, const Array_<Real>& multipliers,
                                       Array_<SpatialVec, ConstrainedBodyIndex>&,
                                       Array_<Real, ConstrainedQIndex>& forces) const override {
        addInOneQForce(state, m_bead, y, multipliers[0], forces);
        addInOneQForce(state, m_bead, x, -getOneQFromState(state, m_bead, x) * multipliers[0],
                       forces);
    }

private:
    const MobilizerQIndex x{1}, y{2};
    ConstrainedMobilizerIndex m_bead;
};

std::unique_ptr<Model> makeHolonomicConstraint() {
    auto model = std::make_unique<Model>();
    Plane& plane = model->make<Plane>();
    const Constraint::Custom parabola(new Parabola(plane));
    model->state = model->system.realizeTopology();
    model->observe = [parabola, &system = model->system](const State& state) {
        system.realize(state, Stage::Acceleration);
        return parabola.getMultipliersAsVector(state);
    };
    plane.bead.setOneQ(model->state, 1, 1);
    plane.bead.setOneQ(model->state, 2, 0.5);
    plane.bead.setOneU(model->state, 0, 2);
    return model;
}

/** A skate: no velocity across its blade. **/
class Blade : public Constraint::Custom::Implementation {
public:
    explicit Blade(Plane& plane) : Implementation(plane.matter, 0, 1, 0) {
        m_skate = addConstrainedMobilizer(plane.bead);
    }
    Blade* clone() const override { return new Blade(*this); }
    void calcVelocityErrors(const State& state, const Array_<SpatialVec, ConstrainedBodyIndex>&,
                            const Array_<Real, ConstrainedUIndex>& u,
                            Array_<Real>& errors) const override {
        const Real angle = getOneQFromState(state, m_skate, MobilizerQIndex(0));
        errors[0] = -std::sin(angle) * getOneU(state, u, m_skate, x) +
                    std::cos(angle) * getOneU(state, u, m_skate, y);
    }
    void calcVelocityDotErrors(const State& state, const Array_<SpatialVec, ConstrainedBodyIndex>&,
                               const Array_<Real, ConstrainedUIndex>& uDot,
                               Array_<Real>& errors) const override {
        const Real angle = getOneQFromState(state, m_skate, MobilizerQIndex(0));
        const Real rate = getOneUFromState(state, m_skate, MobilizerUIndex(0));
        errors[0] = -std::sin(angle) * getOneUDot(state, uDot, m_skate, x) +
                    std::cos(angle) * getOneUDot(state, uDot, m_skate, y) -
                    rate * (std::cos(angle) * getOneUFromState(state, m_skate, x) +
                            std::sin(angle) * getOneUFromState(state, m_skate, y));
    }
    void addInVelocityConstraintForces(const State& state, const Array_<Real>& multipliers,
                                       Array_<SpatialVec, ConstrainedBodyIndex>&,
                                       Array_<Real, ConstrainedUIndex>& forces) const override {
        const Real angle = getOneQFromState(state, m_skate, MobilizerQIndex(0));
        addInOneMobilityForce(state, m_skate, x, -std::sin(angle) * multipliers[0], forces);
        addInOneMobilityForce(state, m_skate, y, std::cos(angle) * multipliers[0], forces);
    }

private:
    const MobilizerUIndex x{1}, y{2};
    ConstrainedMobilizerIndex m_skate;
};

std::unique_ptr<Model> makeNonholonomicConstraint() {
    auto model = std::make_unique<Model>();
    Plane& plane = model->make<Plane>();
    Constraint::Custom(new Blade(plane));
    model->state = model->system.realizeTopology();
    plane.bead.setOneQ(model->state, 0, 0.4);
    plane.bead.setOneU(model->state, 0, 2);
    return model;
}

/** A bead whose fall depends on its sideways acceleration: ẍ = 1 − ÿ/2. **/
class TiedAccelerations : public Constraint::Custom::Implementation {
public:
    explicit TiedAccelerations(Plane& plane) : Implementation(plane.matter, 0, 0, 1) {
        m_bead = addConstrainedMobilizer(plane.bead);
    }
    TiedAccelerations* clone() const override { return new TiedAccelerations(*this); }
    void calcAccelerationErrors(const State& state, const Array_<SpatialVec, ConstrainedBodyIndex>&,
                                const Array_<Real, ConstrainedUIndex>& uDot,
                                Array_<Real>& errors) const override {
        errors[0] = getOneUDot(state, uDot, m_bead, x) + getOneUDot(state, uDot, m_bead, y) / 2 - 1;
    }
    void addInAccelerationConstraintForces(const State& state, const Array_<Real>& multipliers,
                                           Array_<SpatialVec, ConstrainedBodyIndex>&,
                                           Array_<Real, ConstrainedUIndex>& forces) const override {
        addInOneMobilityForce(state, m_bead, x, multipliers[0], forces);
        addInOneMobilityForce(state, m_bead, y, multipliers[0] / 2, forces);
    }

private:
    const MobilizerUIndex x{1}, y{2};
    ConstrainedMobilizerIndex m_bead;
};

std::unique_ptr<Model> makeAccelerationConstraint() {
    auto model = std::make_unique<Model>();
    Plane& plane = model->make<Plane>();
    Constraint::Custom(new TiedAccelerations(plane));
    Force::TwoPointLinearSpring(plane.forces, plane.matter.Ground(), Vec3(0, 1, 0), plane.bead,
                                Vec3(0), 30, 0.5);
    model->state = model->system.realizeTopology();
    plane.bead.setOneU(model->state, 0, 2);
    return model;
}

/** Initially one turn about z per 0.4 m along it, then steeper and steeper: p = 0.4 q/2π + 0.05
q². **/
class Thread : public MobilizedBody::Custom::Implementation {
public:
    explicit Thread(SimbodyMatterSubsystem& matter) : Implementation(matter, 1, 1, 1) {}
    Thread* clone() const override { return new Thread(*this); }
    Transform calcMobilizerTransformFromQ(const State&, int, const Real* q) const override {
        return Transform(Rotation(q[0], ZAxis), Vec3(0, 0, pitch * q[0] + 0.05 * square(q[0])));
    }
    SpatialVec multiplyByHMatrix(const State& state, int, const Real* u) const override {
        return SpatialVec(Vec3(0, 0, u[0]), Vec3(0, 0, getRise(state) * u[0]));
    }
    void multiplyByHTranspose(const State& state, const SpatialVec& F, int,
                              Real* f) const override {
        f[0] = F[0][2] + getRise(state) * F[1][2];
    }
    SpatialVec multiplyByHDotMatrix(const State& state, int, const Real* u) const override {
        return SpatialVec(Vec3(0), Vec3(0, 0, 0.1 * getU(state)[0] * u[0]));
    }
    void multiplyByHDotTranspose(const State& state, const SpatialVec& F, int,
                                 Real* f) const override {
        f[0] = 0.1 * getU(state)[0] * F[1][2];
    }

private:
    const Real pitch = 0.4 / (2 * Pi);
    Real getRise(const State& state) const { return pitch + 0.1 * getQ(state)[0]; }
};

std::unique_ptr<Model> makeCustomMobilizer() {
    auto model = std::make_unique<Model>();
    Basics& basics = model->make<Basics>();
    Force::Gravity(basics.forces, basics.matter, -ZAxis, 9.81);
    MobilizedBody::Custom nut(basics.matter.Ground(), new Thread(basics.matter),
                              Rotation(0.1, XAxis), ball(1), Vec3(0.3, 0, 0));
    MobilizedBody::Pin arm(nut, Transform(Rotation(Pi / 2, YAxis), Vec3(0.2, 0, 0)), ball(0.5),
                           Vec3(0, 0.3, 0));
    model->state = model->system.realizeTopology();
    nut.setOneQ(model->state, 0, 1.5);
    arm.setOneQ(model->state, 0, 0.4);
    return model;
}

// Two coordinates, with positions given by functions: an ellipse in an inclined plane.
std::unique_ptr<Model> makeFunctionBasedMobilizer() {
    auto model = std::make_unique<Model>();
    Basics& basics = model->make<Basics>();
    Force::Gravity(basics.forces, basics.matter, -YAxis, 9.81);
    Array_<const Function*> functions;
    Array_<Array_<int>> coordinates;
    const auto follow = [&](int coordinate, const Function* function) {
        functions.push_back(function);
        coordinates.push_back(Array_<int>(1, coordinate));
    };
    const auto rest = [&] {
        functions.push_back(new Function::Constant(0, 0));
        coordinates.push_back(Array_<int>());
    };
    rest();
    rest();
    follow(1, new Function::Linear(Vector(Vec2(1, 0))));
    follow(0, new Function::Sinusoid(0.5, 1, 0));
    follow(0, new Function::Sinusoid(0.3, 1, -Pi / 2));
    rest();
    MobilizedBody::FunctionBased ring(basics.matter.Ground(), Rotation(0.5, XAxis), ball(1),
                                      Vec3(0), 2, functions, coordinates);
    model->state = model->system.realizeTopology();
    ring.setOneQ(model->state, 0, 0.6);
    ring.setOneU(model->state, 1, 1);
    model->duration = 0.6;
    return model;
}

/** Two pinned bars with tips connected by a rod. **/
struct FourBar : Basics {
    explicit FourBar(Model& model)
        : Basics(model),
          left(matter.Ground(), Vec3(0), makeBar(), Vec3(0)),
          right(matter.Ground(), Vec3(1.2, 0, 0), makeBar(), Vec3(0)),
          rod(left, Vec3(0, -1, 0), right, Vec3(0, -1, 0), 1.4) {}
    static Body::Rigid makeBar() {
        return Body::Rigid(MassProperties(1, Vec3(0, -0.5, 0), Inertia(0.34, 0.01, 0.34)));
    }
    Force::Gravity gravity{forces, matter, -YAxis, 9.81};
    MobilizedBody::Pin left, right;
    Constraint::Rod rod;
};

// Neither positions nor speeds satisfy the rod: both are projected before the first step.
std::unique_ptr<Model> makeInconsistentStart() {
    auto model = std::make_unique<Model>();
    FourBar& bars = model->make<FourBar>();
    model->state = model->system.realizeTopology();
    bars.left.setAngle(model->state, 0.3);
    bars.right.setAngle(model->state, 0.9);
    bars.left.setRate(model->state, 5);
    return model;
}

// The same with bodies of which one is light and free, with a quaternion not of unit length.
std::unique_ptr<Model> makeInconsistentFreeBody() {
    auto model = std::make_unique<Model>();
    Basics& basics = model->make<Basics>();
    Force::Gravity(basics.forces, basics.matter, -YAxis, 9.81);
    MobilizedBody::Pin bar(basics.matter.Ground(), Vec3(0), FourBar::makeBar(), Vec3(0));
    MobilizedBody::Free load(basics.matter.Ground(), Vec3(0), ball(0.2), Vec3(0));
    Constraint::Ball(bar, Vec3(0, -1, 0), load, Vec3(0, 0.2, 0));
    model->state = model->system.realizeTopology();
    bar.setAngle(model->state, 0.5);
    load.setQ(model->state, Vec7(1, 0.1, 0.2, -0.1, 0.45, -1.1, 0.02));
    load.setU(model->state, Vec6(1, 2, 3, 0.5, 0, -0.5));
    model->duration = 1;
    return model;
}

// A motor driven by a Motion, with its speed coupled to a wheel that drives a bar through a rod.
std::unique_ptr<Model> makePrescribedMotion() {
    auto model = std::make_unique<Model>();
    FourBar& bars = model->make<FourBar>();
    MobilizedBody::Pin motor(bars.matter.Ground(), Vec3(0, 1, 0), ball(2), Vec3(0));
    MobilizedBody::Pin wheel(bars.matter.Ground(), Vec3(1, 1, 0), ball(1), Vec3(0));
    Motion::Sinusoid(motor, Motion::Position, 0.8, 3, 0.2);
    Constraint::SpeedCoupler(
        bars.matter, new Function::Linear(Vector(Vec3(1, -2, 0))),
        std::vector{motor.getMobilizedBodyIndex(), wheel.getMobilizedBodyIndex()},
        std::vector{MobilizerUIndex(0), MobilizerUIndex(0)});
    Force::TwoPointLinearSpring(bars.forces, wheel, Vec3(0.1, 0, 0), bars.right, Vec3(0, -0.5, 0),
                                40, 1);
    model->state = model->system.realizeTopology();
    bars.left.setAngle(model->state, 0.3);
    bars.right.setAngle(model->state, 0.5);
    return model;
}

// A ball falls on the floor with spin: elastic contact with friction, tracked by Simbody.
std::unique_ptr<Model> makeCompliantContact() {
    struct Contact : Basics {
        explicit Contact(Model& model)
            : Basics(model),
              tracker(model.keep<ContactTrackerSubsystem>(model.system)),
              contact(model.keep<CompliantContactSubsystem>(model.system, tracker)) {}
        ContactTrackerSubsystem& tracker;
        CompliantContactSubsystem& contact;
        Force::Gravity gravity{forces, matter, -YAxis, 9.81};
    };
    auto model = std::make_unique<Model>();
    Contact& contact = model->make<Contact>();
    const ContactMaterial rubber(1e4, 0.1, 0.8, 0.6, 0.5);
    contact.contact.setTransitionVelocity(0.05);
    contact.matter.Ground().updBody().addContactSurface(
        Rotation(-Pi / 2, ZAxis), ContactSurface(ContactGeometry::HalfSpace(), rubber));
    Body::Rigid body = ball(1);
    body.addContactSurface(Vec3(0), ContactSurface(ContactGeometry::Sphere(0.1), rubber));
    MobilizedBody::Free thrown(contact.matter.Ground(), Vec3(0), body, Vec3(0));
    model->state = model->system.realizeTopology();
    thrown.setQToFitTranslation(model->state, Vec3(0, 0.15, 0));
    thrown.setUToFitVelocity(model->state, SpatialVec(Vec3(0, 0, 10), Vec3(0.5, 0, 0)));
    model->duration = 0.5;
    return model;
}

// The same with Simbody's older contact subsystem.
std::unique_ptr<Model> makeHuntCrossleyContact() {
    struct Contact : Basics {
        explicit Contact(Model& model)
            : Basics(model), contacts(model.keep<GeneralContactSubsystem>(model.system)) {}
        GeneralContactSubsystem& contacts;
        Force::Gravity gravity{forces, matter, -YAxis, 9.81};
    };
    auto model = std::make_unique<Model>();
    Contact& contact = model->make<Contact>();
    MobilizedBody::Free thrown(contact.matter.Ground(), Vec3(0), ball(1), Vec3(0));
    const ContactSetIndex set = contact.contacts.createContactSet();
    contact.contacts.addBody(set, thrown, ContactGeometry::Sphere(0.1), Vec3(0));
    contact.contacts.addBody(set, contact.matter.updGround(), ContactGeometry::HalfSpace(),
                             Rotation(-Pi / 2, ZAxis));
    HuntCrossleyForce law(contact.forces, contact.contacts, set);
    for (const int surface : {0, 1})
        law.setBodyParameters(ContactSurfaceIndex(surface), 2e4, 0.1, 0.8, 0.6, 0.5);
    law.setTransitionVelocity(0.05);
    model->state = model->system.realizeTopology();
    thrown.setQToFitTranslation(model->state, Vec3(0, 0.15, 0));
    thrown.setUToFitVelocity(model->state, SpatialVec(Vec3(0, 0, 10), Vec3(0.5, 0, 0)));
    model->duration = 0.5;
    return model;
}

struct WithCables : Basics {
    explicit WithCables(Model& model)
        : Basics(model), cables(model.keep<CableTrackerSubsystem>(model.system)) {}
    CableTrackerSubsystem& cables;
    Force::Gravity gravity{forces, matter, -YAxis, 9.81};
};

// A weight swings on a cable over a drum.
std::unique_ptr<Model> makeCableOverADrum() {
    auto model = std::make_unique<Model>();
    WithCables& parts = model->make<WithCables>();
    MobilizedBody::Translation weight(parts.matter.Ground(), Vec3(0), ball(1), Vec3(0));
    CablePath path(parts.cables, parts.matter.Ground(), Vec3(-0.6, -0.5, 0), weight, Vec3(0));
    CableObstacle::Surface drum(path, parts.matter.Ground(), Transform(),
                                ContactGeometry::Cylinder(0.3));
    drum.setContactPointHints(Vec3(-0.25, 0.1, 0.001), Vec3(0.25, 0.1, 0.002));
    CableSpring(parts.forces, path, 200, 2.45, 0.1);
    model->state = model->system.realizeTopology();
    weight.setTranslation(model->state, Vec3(0.5, -1, 0.02));
    model->duration = 0.4;
    return model;
}

// A pendulum's cord swings against a ball, wraps around it, and leaves it again: the cable
// subsystem has its own events for that.
std::unique_ptr<Model> makeCableAgainstABall() {
    auto model = std::make_unique<Model>();
    WithCables& parts = model->make<WithCables>();
    MobilizedBody::Translation weight(parts.matter.Ground(), Vec3(0), ball(1), Vec3(0));
    CablePath path(parts.cables, parts.matter.Ground(), Vec3(0), weight, Vec3(0));
    CableObstacle::Surface peg(path, parts.matter.Ground(), Vec3(0.15, -0.5, 0.01),
                               ContactGeometry::Sphere(0.1));
    peg.setContactPointHints(Vec3(-0.1, 0.01, 0), Vec3(-0.1, -0.01, 0)).setDisabledByDefault(true);
    CableSpring(parts.forces, path, 300, 1, 0.2);
    model->state = model->system.realizeTopology();
    weight.setTranslation(model->state, Vec3(-0.3, -1, 0));
    weight.setOneU(model->state, 0, 1);
    model->duration = 1.2;
    return model;
}

// A cable over a ball and an ellipsoid.
std::unique_ptr<Model> makeWrapping() {
    auto model = std::make_unique<Model>();
    WithCables& parts = model->make<WithCables>();
    MobilizedBody::Translation weight(parts.matter.Ground(), Vec3(0), ball(1), Vec3(0));
    CablePath path(parts.cables, parts.matter.Ground(), Vec3(-0.6, 0.3, 0.1), weight, Vec3(0));
    CableObstacle::Surface first(path, parts.matter.Ground(), Vec3(-0.2, 0.25, 0.02),
                                 ContactGeometry::Sphere(0.15));
    first.setContactPointHints(Vec3(-0.05, 0.15, 0.02), Vec3(0.02, 0.15, 0.02));
    CableObstacle::Surface second(path, parts.matter.Ground(), Vec3(0.2, 0, 0),
                                  ContactGeometry::Ellipsoid(Vec3(0.2, 0.3, 0.25)));
    second.setContactPointHints(Vec3(0, 0.3, 0.02), Vec3(0.2, 0.05, 0.02));
    CableSpring(parts.forces, path, 150, 2.35, 0.2);
    model->state = model->system.realizeTopology();
    weight.setTranslation(model->state, Vec3(0.4, -1.2, 0));
    weight.setOneU(model->state, 2, 0.3);
    model->duration = 0.3;
    return model;
}

}  // namespace

std::vector<Program> getMechanismPrograms() {
    return {{"HolonomicConstraint", makeHolonomicConstraint},
            {"NonholonomicConstraint", makeNonholonomicConstraint},
            {"AccelerationConstraint", makeAccelerationConstraint},
            {"CustomMobilizer", makeCustomMobilizer},
            {"FunctionBasedMobilizer", makeFunctionBasedMobilizer},
            {"InconsistentStart", makeInconsistentStart},
            {"InconsistentFreeBody", makeInconsistentFreeBody},
            {"PrescribedMotion", makePrescribedMotion},
            {"CompliantContact", makeCompliantContact},
            {"HuntCrossleyContact", makeHuntCrossleyContact},
            {"CableOverADrum", makeCableOverADrum, 1e-7},
            {"CableAgainstABall", makeCableAgainstABall, 1e-7},
            {"Wrapping", makeWrapping, 1e-7}};
}

}  // namespace simflex::test
