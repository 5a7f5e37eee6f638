#include "support/StatorModel.h"

#include "simflex/forces/AttachmentForce.h"
#include "simflex/forces/ModalDamping.h"

namespace simflex::examples {

using namespace SimTK;

namespace {

/** Position of an interface of the undeformed engine in Ground [m]. **/
Vec3 placeOf(const ReducedBody& part, const std::string& interface) {
    const auto& s = part.getInterface(interface).position;
    const auto& c = part.centerOfMass;
    return Vec3(s[0], s[1], s[2]) + Vec3(c[0], c[1], c[2]);
}

Attachment groundAt(SimbodyMatterSubsystem& matter, const ReducedBody& part,
                    const std::string& interface) {
    return Attachment(matter.Ground(), Transform(placeOf(part, interface)));
}

}  // namespace

Vec3 StatorOptions::calcAngle(double t) const {
    const double omega = 2 * Pi * speed;
    if (t >= runUp) return {omega * (t - runUp / 2), omega, 0};
    const double k = 2 * Pi / runUp;
    return {omega / runUp * (t * t / 2 + (std::cos(k * t) - 1) / (k * k)),
            omega / runUp * (t - std::sin(k * t) / k), omega / runUp * (1 - std::cos(k * t))};
}

const std::array<const char*, StatorModel::NumParts>& StatorModel::getPartNames() {
    static const std::array<const char*, NumParts> names{"stator_connector", "stator_compressor",
                                                         "stator_chamber", "stator_turbine",
                                                         "stator_nozzle"};
    return names;
}

StatorModel::StatorModel(const StatorOptions& options,
                         const std::vector<std::shared_ptr<const ReducedBody>>& parts)
    : m_options(options),
      matter(system),
      forces(system),
      gravity(forces, matter, -YAxis, options.gravity),
      flexible(system, matter),
      connector(flexible, parts.at(0), "connector"),
      compressor(flexible, parts.at(1), "compressor casing"),
      chamber(flexible, parts.at(2), "combustion chamber"),
      turbine(flexible, parts.at(3), "turbine casing"),
      nozzle(flexible, parts.at(4), "nozzle"),
      leftHinge(flexible, groundAt(matter, *parts[0], "left"), connector.interface("left"),
                "left hinge"),
      rightHinge(flexible, groundAt(matter, *parts[0], "right"), connector.interface("right"),
                 "right hinge"),
      rearHinge(flexible, groundAt(matter, *parts[4], "mount"), nozzle.interface("mount"),
                "rear hinge"),
      compressorFlange(flexible, connector.interface("rear"), compressor.interface("front"),
                       "compressor flange"),
      chamberFlange(flexible, compressor.interface("rear"), chamber.interface("front"),
                    "chamber flange"),
      turbineFlange(flexible, chamber.interface("rear"), turbine.interface("front"),
                    "turbine flange"),
      nozzleFlange(flexible, turbine.interface("rear"), nozzle.interface("front"),
                   "nozzle flange") {
    if (options.damping > 0)
        for (const FlexibleBody& body : getBodies()) ModalDamping(flexible, body, options.damping);
    for (const Bearing bearing : {FrontBearing, RearBearing})
        AttachmentForce(flexible, getBearing(bearing), [this, bearing](Real t) {
            return SpatialVec(Vec3(0), calcUnbalanceForce(bearing, t));
        });
    addStand();
}

Attachment StatorModel::getBearing(Bearing bearing) const {
    return (bearing == FrontBearing ? compressor : turbine).interface("bearing");
}

Vec3 StatorModel::calcUnbalanceForce(Bearing bearing, double time) const {
    const Vec3 rotor = m_options.calcAngle(time);
    const bool isFront = bearing == FrontBearing;
    const double angle = isFront ? rotor[0] : rotor[0] - Pi / 2;
    const Vec3 radial(0, std::cos(angle), std::sin(angle));
    const Vec3 tangential(0, -std::sin(angle), std::cos(angle));
    return (isFront ? m_options.frontUnbalance : m_options.rearUnbalance) *
           (square(rotor[1]) * radial - rotor[2] * tangential);
}

Transform StatorModel::getUndeformedPose(const FlexibleBody& body) const {
    const auto& c = body.getPart().centerOfMass;
    return Transform(Vec3(c[0], c[1], c[2]));
}

State StatorModel::makeUndeformedState() {
    State state = system.realizeTopology();
    system.realizeModel(state);
    for (const FlexibleBody& body : getBodies()) body.setFramePose(state, getUndeformedPose(body));
    return state;
}

LinearModel StatorModel::makeLinearModel() {
    return LinearModel(system, matter, getBodies(), makeUndeformedState(), m_options.damping);
}

State StatorModel::makeInitialState() {
    const LinearModel linear = makeLinearModel();
    return linear.calcDisplacedState(
        linear.calcStaticDisplacement(linear.calcGravityForce(Vec3(0, -m_options.gravity, 0))));
}

Vec3 StatorModel::calcBearingDisplacement(const State& state, Bearing bearing) const {
    const FlexibleBody& body = bearing == FrontBearing ? compressor : turbine;
    return getBearing(bearing).calcMotion(state).X.p() - placeOf(body.getPart(), "bearing");
}

Vec2 StatorModel::calcSteadyAmplitude(const LinearModel& linear, Bearing bearing,
                                      double speed) const {
    using Complex = std::complex<double>;
    const double omega = 2 * Pi * speed;
    const Matrix front = linear.calcTranslationMap(compressor, "bearing");
    const Matrix rear = linear.calcTranslationMap(turbine, "bearing");
    // e_r = (0, cos, sin) = Re (0, 1, −i) e^{iωt}; a quarter turn behind is a factor −i.
    const Complex i(0, 1), atFront = m_options.frontUnbalance * omega * omega,
                           atRear = -i * (m_options.rearUnbalance * omega * omega);
    Vector_<Complex> f(front.ncol(), Complex(0));
    for (int k = 0; k < f.size(); ++k)
        f[k] = atFront * (front(1, k) - i * front(2, k)) + atRear * (rear(1, k) - i * rear(2, k));
    const Vector_<Complex> v = linear.calcResponse(f, omega);
    const Matrix& map = bearing == FrontBearing ? front : rear;
    Complex y = 0, z = 0;
    for (int k = 0; k < v.size(); ++k) {
        y += map(1, k) * v[k];
        z += map(2, k) * v[k];
    }
    return {std::abs(y), std::abs(z)};
}

std::shared_ptr<const ReducedBody> StatorModel::makePicturePart(const FlexibleBody& body) const {
    const ReducedBody& part = body.getPart();
    auto picture = std::make_shared<ReducedBody>();
    picture->name = part.name;
    picture->mass = part.mass;
    picture->centerOfMass = part.centerOfMass;
    picture->inertia = part.inertia;
    picture->mesh = part.mesh;
    picture->numModes = part.numModes + 6;
    picture->Phi = part.Phi;
    const int numNodes = part.mesh.numNodes();
    for (int mode = 0; mode < 6; ++mode)
        for (int k = 0; k < numNodes; ++k) {
            const auto s = part.mesh.position(k);
            const Vec3 axis(mode % 3 == 0, mode % 3 == 1, mode % 3 == 2);
            const Vec3 shape = mode < 3 ? axis : axis % Vec3(s[0], s[1], s[2]);
            for (int row = 0; row < 3; ++row) picture->Phi.push_back(shape[row]);
        }
    return picture;
}

Vector StatorModel::calcPictureCoordinates(const FlexibleBody& body, const State& state) const {
    const int n = body.getNumModes();
    system.realize(state, Stage::Position);
    const Transform X_GB = body.getFramePose(state);
    const Vec3 shift = X_GB.p() - getUndeformedPose(body).p();
    const Vec4 turn = X_GB.R().convertRotationToAngleAxis();
    Vector coordinates(n + 6);
    coordinates(0, n) = body.getModalCoordinates(state);
    for (int axis = 0; axis < 3; ++axis) {
        coordinates[n + axis] = shift[axis];
        coordinates[n + 3 + axis] = turn[0] * turn[1 + axis];
    }
    return coordinates;
}

void StatorModel::addStand() {
    matter.setShowDefaultGeometry(false);
    const Vec3 iron(0.44, 0.48, 0.54), bronze(0.72, 0.55, 0.36);
    auto& ground = matter.updGround();
    const double floor = -0.60;
    const auto add = [&](const Vec3& lower, const Vec3& upper) {
        DecorativeBrick shape((upper - lower) / 2);
        shape.setTransform((upper + lower) / 2).setColor(iron);
        ground.addBodyDecoration(Transform(), shape);
    };
    add(Vec3(-0.08, floor - 0.04, -0.56), Vec3(2.28, floor, 0.56));

    // Each lug is held in a fork by a pin.
    const auto addFork = [&](const Vec3& eye, double halfWidth) {
        for (double side : {-1.0, 1.0}) {
            const double inner = eye[0] + side * 0.020, outer = eye[0] + side * 0.038;
            add(Vec3(std::min(inner, outer), floor, eye[2] - halfWidth),
                Vec3(std::max(inner, outer), eye[1] + 0.045, eye[2] + halfWidth));
        }
        add(Vec3(eye[0] - 0.06, floor, eye[2] - halfWidth - 0.03),
            Vec3(eye[0] + 0.06, floor + 0.03, eye[2] + halfWidth + 0.03));
        DecorativeCylinder pin(0.0215, 0.048);
        pin.setTransform(Transform(Rotation(Pi / 2, ZAxis), eye)).setColor(bronze);
        ground.addBodyDecoration(Transform(), pin);
    };
    addFork(placeOf(connector.getPart(), "left"), 0.045);
    addFork(placeOf(connector.getPart(), "right"), 0.045);
    addFork(placeOf(nozzle.getPart(), "mount"), 0.06);
}

void StatorModel::addRotorDecorations(double angle, Array_<DecorativeGeometry>& geometry) const {
    const Vec3 steel(0.62, 0.65, 0.70), red(0.80, 0.18, 0.12);
    const double front = placeOf(compressor.getPart(), "bearing")[0];
    const double rear = placeOf(turbine.getPart(), "bearing")[0];
    const auto add = [&](DecorativeGeometry shape, const Transform& X_GS, const Vec3& color) {
        geometry.push_back(shape.setTransform(X_GS).setColor(color));
    };
    const Rotation alongX(Pi / 2, ZAxis);
    add(DecorativeCylinder(0.065, (rear - front) / 2 + 0.06),
        Transform(alongX, Vec3((front + rear) / 2, 0, 0)), steel);
    const double hub = front - 0.14;  // of the fan
    add(DecorativeCylinder(0.075, 0.05), Transform(alongX, Vec3(hub + 0.02, 0, 0)), steel);
    add(DecorativeEllipsoid(Vec3(0.13, 0.075, 0.075)), Vec3(hub - 0.03, 0, 0), steel);
    const int numBlades = 7;
    for (int k = 0; k < numBlades; ++k) {
        const bool isBroken = k == 0;  // opposite to e_r
        const double length = isBroken ? 0.15 : 0.25;
        const Rotation turn =
            Rotation(angle + Pi + 2 * Pi * k / numBlades, XAxis) * Rotation(0.6, YAxis);
        add(DecorativeBrick(Vec3(0.05, length / 2, 0.004)),
            Transform(turn, Vec3(hub, 0, 0) + turn * Vec3(0, 0.065 + length / 2, 0)),
            isBroken ? red : steel);
    }
}

}  // namespace simflex::examples
