#include "support/SliderCrankModel.h"

#include "simflex/forces/AttachmentForce.h"
#include "simflex/forces/ModalDamping.h"
#include "support/InterfacePoint.h"

namespace simflex::examples {

using namespace SimTK;

namespace {

double halfThickness(const ReducedBody& part) {
    double half = 0;
    for (int k = 0; k < part.mesh.numNodes(); ++k)
        half = std::max(half, std::abs(part.mesh.position(k)[2]));
    return half;
}

/** Radius of the bore that the interface holds; 2.5 mm for a seat in solid material. **/
double pinRadius(const ReducedBody& part, const std::string& interface) {
    const ReducedBody::Interface& seat = part.getInterface(interface);
    double bore = Infinity;
    for (int node : seat.nodes) {
        const auto s = part.mesh.position(node);
        bore = std::min(bore, std::hypot(s[0] - seat.position[0], s[1] - seat.position[1]));
    }
    return bore > 0.0025 ? bore : 0.0025;
}

const Vec3 bronze(0.72, 0.55, 0.36);

/** A cylinder along z. **/
DecorativeCylinder makePin(double radius, double back, double front, const Vec3& shift = Vec3(0)) {
    DecorativeCylinder pin(radius, (front - back) / 2);
    const Vec3 middle(0, 0, (front + back) / 2);
    pin.setTransform(Transform(Rotation(Pi / 2, XAxis), shift + middle)).setColor(bronze);
    return pin;
}

double lengthBetween(const ReducedBody& part, const std::string& first, const std::string& second) {
    return (positionOf(part, second) - positionOf(part, first)).norm();
}

}  // namespace

Vec3 SliderCrankOptions::calcAngle(double t) const {
    if (t >= runUp) return {speed * (t - runUp / 2), speed, 0};
    const double k = 2 * Pi / runUp;
    return {speed / runUp * (t * t / 2 + (std::cos(k * t) - 1) / (k * k)),
            speed / runUp * (t - std::sin(k * t) / k), speed / runUp * (1 - std::cos(k * t))};
}

double SliderCrankOptions::calcTorque(double t) const {
    return t >= runUp ? torque : torque * 0.5 * (1 - std::cos(Pi * t / runUp));
}

double SliderCrankOptions::calcFlywheelInertia() const {
    return drive == Drive::Torque ? 0.5 * flywheelMass * flywheelRadius * flywheelRadius : 0;
}

SliderCrankModel::SliderCrankModel(const SliderCrankOptions& options,
                                   std::shared_ptr<const ReducedBody> crankPart,
                                   std::shared_ptr<const ReducedBody> rodPart)
    : m_options(options),
      m_crankLength(lengthBetween(*crankPart, "shaft", "pin")),
      m_rodLength(lengthBetween(*rodPart, "big_end", "small_end")),
      m_offset(halfThickness(*crankPart) + halfThickness(*rodPart) + 0.001),
      matter(system),
      forces(system),
      gravity(forces, matter, -YAxis, options.gravity),
      flexible(system, matter),
      crank(flexible, crankPart, "crank"),
      rod(flexible, rodPart, "rod"),
      slider(
          matter.Ground(), Transform(),
          Body::Rigid(MassProperties(options.sliderMass, Vec3(0),
                                     options.sliderMass * UnitInertia::brick(0.022, 0.014, 0.008))),
          Transform()),
      mainBearing(flexible, matter.Ground(), crank.interface("shaft"), "main bearing"),
      crankPin(flexible, crank.interface("pin"), rod.interface("big_end"), "crank pin"),
      gudgeonPin(flexible, rod.interface("small_end"), slider, "gudgeon pin") {
    addDrive();
    if (options.damping > 0) {
        ModalDamping(flexible, crank, options.damping);
        ModalDamping(flexible, rod, options.damping);
    }

    const Mesh& mesh = rodPart->mesh;
    const Vec3 middle = (positionOf(*rodPart, "big_end") + positionOf(*rodPart, "small_end")) / 2;
    int nearest = 0;
    double distance = Infinity;
    for (int k = 0; k < mesh.numNodes(); ++k) {
        const auto s = mesh.position(k);
        const double d = (Vec3(s[0], s[1], s[2]) - middle).norm();
        if (d < distance) {
            distance = d;
            nearest = k;
            m_rodMiddlePosition = Vec3(s[0], s[1], s[2]);
        }
    }
    m_rodMiddle = mesh.nodeNumbers[nearest];
    addDecorations();
}

void SliderCrankModel::addDrive() {
    const SliderCrankOptions options = m_options;
    if (options.drive == SliderCrankOptions::Drive::Speed) {
        Joint::PrescribedRotation(
            flexible, matter.Ground(), crank.interface("shaft"),
            [options](Real t) { return options.calcAngle(t); }, "drive");
        return;
    }
    // The flywheel takes up the slider's energy at each dead centre, since the crank is light. It
    // has a bearing of its own, and turns with the shaft.
    const double halfThickness = 0.006;
    const UnitInertia disc = UnitInertia::cylinderAlongZ(options.flywheelRadius, halfThickness);
    MobilizedBody::Pin flywheel(
        matter.Ground(), Transform(Vec3(0, 0, -0.05)),
        Body::Rigid(MassProperties(options.flywheelMass, Vec3(0), options.flywheelMass * disc)),
        Transform());
    DecorativeCylinder shape(options.flywheelRadius, halfThickness);
    shape.setTransform(Rotation(Pi / 2, XAxis)).setColor(Vec3(0.55, 0.58, 0.63)).setResolution(3);
    flywheel.addBodyDecoration(Transform(), shape);
    Joint::PrescribedRotation(
        flexible, flywheel, crank.interface("shaft"), [](Real) { return Vec3(0); }, "flywheel");
    AttachmentForce(flexible, crank.interface("shaft"), [options](Real t) {
        return SpatialVec(Vec3(0, 0, options.calcTorque(t)), Vec3(0));
    });
}

State SliderCrankModel::makeInitialState() {
    State state = system.realizeTopology();
    system.realizeModel(state);
    crank.setPoseByInterface(state, "shaft", Transform());
    rod.setPoseByInterface(state, "big_end", Vec3(m_crankLength, 0, 0));
    slider.setOneQ(state, 0, m_crankLength + m_rodLength);
    return state;
}

double SliderCrankModel::calcCrankAngle(const State& state, double guess) const {
    const Rotation R = mainBearing.getFrameM().calcMotion(state).X.R();
    const double angle = std::atan2(R.x()[1], R.x()[0]);
    return angle + 2 * Pi * std::round((guess - angle) / (2 * Pi));
}

double SliderCrankModel::calcRodDeflection(const State& state) const {
    const Vec3 bigEnd = crankPin.getFrameM().calcMotion(state).X.p();
    const Vec3 smallEnd = gudgeonPin.getFrameF().calcMotion(state).X.p();
    const UnitVec3 along(smallEnd - bigEnd);
    const UnitVec3 across(Vec3(0, 0, 1) % along);
    const Vec3 undeformed = m_rodMiddlePosition - positionOf(rod.getPart(), "big_end");
    return ~across * (rod.calcNodeLocation(state, m_rodMiddle) - bigEnd) - undeformed[1];
}

double SliderCrankModel::calcCrankDeflection(const State& state) const {
    const Transform X_GS = mainBearing.getFrameM().calcMotion(state).X;
    const ReducedBody::Interface& pin = crank.getPart().getInterface("pin");
    const Vector xi = crank.getModalCoordinates(state);
    Vec3 pin_B(pin.position[0], pin.position[1], pin.position[2]);
    for (int i = 0; i < crank.getNumModes(); ++i)
        for (int axis = 0; axis < 3; ++axis) pin_B[axis] += pin.Phi[3 * i + axis] * xi[i];
    return (~X_GS * (crank.getFramePose(state) * pin_B))[1];
}

DecorativeCylinder SliderCrankModel::makeCrankPin() const {
    const double back = halfThickness(crank.getPart());
    const double front = m_offset + halfThickness(rod.getPart()) + 0.003;
    return makePin(pinRadius(rod.getPart(), "big_end"), back, front, Vec3(0));
}

State SliderCrankModel::calcPictureState(const State& original) const {
    system.realize(original, Stage::Velocity);  // copies of States are not realized
    State state = original;
    const Transform X_GB = rod.getFramePose(original);
    rod.setFramePose(state, Transform(X_GB.R(), X_GB.p() + Vec3(0, 0, m_offset)));
    system.realize(state, Stage::Position);
    return state;
}

void SliderCrankModel::addDecorations() {
    matter.setShowDefaultGeometry(false);
    const Vec3 steel(0.66, 0.69, 0.74), iron(0.44, 0.48, 0.54);
    const auto brick = [](const Vec3& lower, const Vec3& upper, const Vec3& color) {
        DecorativeBrick shape((upper - lower) / 2);
        shape.setTransform((upper + lower) / 2).setColor(color);
        return shape;
    };
    const double crankBack = -halfThickness(crank.getPart());
    const double rodBack = -halfThickness(rod.getPart()), rodFront = -rodBack;

    // The slider is a block behind the rod's small end, with its pin.
    const double front = m_offset + rodBack - 0.001, back = front - 0.016;
    const double rodFace = m_offset + rodFront;
    slider.addBodyDecoration(Transform(),
                             brick(Vec3(-0.022, -0.014, back), Vec3(0.022, 0.014, front), steel));
    slider.addBodyDecoration(
        Transform(), makePin(pinRadius(rod.getPart(), "small_end"), front, rodFace + 0.003));

    // Two rails that guide it, a pedestal for the shaft, and a bed.
    auto& ground = matter.updGround();
    const double first = m_rodLength - m_crankLength - 0.034,
                 last = m_rodLength + m_crankLength + 0.034;
    const double bed = -m_crankLength - 0.028;
    const auto add = [&](const Vec3& lower, const Vec3& upper) {
        ground.addBodyDecoration(Transform(), brick(lower, upper, iron));
    };
    add(Vec3(first, -0.021, back), Vec3(last, -0.0145, front));
    add(Vec3(first, 0.0145, back), Vec3(last, 0.021, front));
    add(Vec3(first, -0.021, back - 0.006), Vec3(last, 0.021, back));
    add(Vec3(first, bed, back - 0.006), Vec3(first + 0.014, -0.021, front));
    add(Vec3(last - 0.014, bed, back - 0.006), Vec3(last, -0.021, front));
    add(Vec3(-0.014, bed, crankBack - 0.026), Vec3(0.014, 0.014, crankBack - 0.006));
    add(Vec3(-0.075, bed - 0.006, crankBack - 0.04), Vec3(last, bed, rodFace + 0.02));
    ground.addBodyDecoration(Transform(), makePin(0.004, crankBack - 0.03, 0.003 - crankBack));
}

}  // namespace simflex::examples
