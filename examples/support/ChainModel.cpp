#include "support/ChainModel.h"

#include "simflex/forces/ModalDamping.h"
#include "support/InterfacePoint.h"

namespace simflex::examples {

using namespace SimTK;

namespace {

int checkNumLinks(int numLinks) {
    if (numLinks < 1)
        throw std::invalid_argument("a chain has at least 1 link, not " + std::to_string(numLinks));
    return numLinks;
}

/** Half the extent along z of the nodes about an interface's master point [m]. **/
double halfWidth(const ReducedBody& part, const std::string& interface) {
    double half = 0;
    for (int node : part.getInterface(interface).nodes)
        half = std::max(half, std::abs(part.mesh.position(node)[2]));
    return half;
}

}  // namespace

ChainModel::ChainModel(const ChainOptions& options, std::shared_ptr<const ReducedBody> part)
    : m_options(options),
      m_pitch((positionOf(*part, "eye") - positionOf(*part, "fork")).norm()),
      matter(system),
      forces(system),
      gravity(forces, matter, -YAxis, options.gravity),
      flexible(system, matter) {
    links.reserve(size_t(checkNumLinks(options.numLinks)));
    for (int k = 0; k < options.numLinks; ++k)
        links.emplace_back(flexible, part, "link " + std::to_string(k + 1));
    if (options.damping > 0)
        for (const FlexibleBody& link : links) ModalDamping(flexible, link, options.damping);
    addJoints(*part);
    addDecorations(*part);
}

void ChainModel::addJoints(const ReducedBody& part) {
    if (m_options.joints == ChainOptions::Joints::FrameBall) {
        const Vec3 fork = positionOf(part, "fork"), eye = positionOf(part, "eye");
        Constraint::Ball(matter.Ground(), Vec3(0), matter.updMobilizedBody(links[0].getFrame()),
                         fork);
        for (size_t k = 1; k < links.size(); ++k)
            Constraint::Ball(matter.updMobilizedBody(links[k - 1].getFrame()), eye,
                             matter.updMobilizedBody(links[k].getFrame()), fork);
        return;
    }
    joints.reserve(links.size());
    for (size_t k = 0; k < links.size(); ++k) {
        const Attachment before =
            k == 0 ? Attachment(matter.Ground()) : links[k - 1].interface("eye");
        const Attachment fork = links[k].interface("fork");
        const std::string name = "joint " + std::to_string(k + 1);
        if (k == 0 && m_options.speed != 0) {
            const double speed = m_options.speed;
            joints.push_back(Joint::Pin(flexible, before, fork, name));
            Joint::PrescribedRotation(
                flexible, before, fork, [speed](Real t) { return Vec3(speed * t, speed, 0); },
                "drive");
        } else if (m_options.joints == ChainOptions::Joints::Pin)
            joints.push_back(Joint::Pin(flexible, before, fork, name));
        else if (m_options.joints == ChainOptions::Joints::Weld)
            joints.push_back(Joint::Weld(flexible, before, fork, name));
        else
            joints.push_back(Joint::Ball(flexible, before, fork, name));
    }
}

State ChainModel::makeInitialState() {
    State state = system.realizeTopology();
    system.realizeModel(state);
    for (size_t k = 0; k < links.size(); ++k)
        links[k].setPoseByInterface(state, "fork", Vec3(double(k) * m_pitch, 0, 0));
    return state;
}

Vec3 ChainModel::calcPoint(const FlexibleBody& link, const State& state,
                           const std::string& interface, double factor) const {
    const ReducedBody::Interface& seat = link.getPart().getInterface(interface);
    const Vector xi = link.getModalCoordinates(state);
    Vec3 point(seat.position[0], seat.position[1], seat.position[2]);
    for (int i = 0; i < link.getNumModes(); ++i)
        for (int axis = 0; axis < 3; ++axis)
            point[axis] += factor * seat.Phi[size_t(3 * i + axis)] * xi[i];
    return point;
}

Vec3 ChainModel::calcTip(const State& state) const {
    const FlexibleBody& last = links.back();
    return last.getFramePose(state) * calcPoint(last, state, "eye", 1);
}

void ChainModel::addDecorations(const ReducedBody& part) {
    matter.setShowDefaultGeometry(false);
    // The pin of the first fork, and a plate behind that carries it.
    const Vec3 iron(0.44, 0.48, 0.54);
    const double front = 1.2 * halfWidth(part, "fork"), back = 0.35 * m_pitch;
    DecorativeCylinder pin(0.05 * m_pitch, (front + back) / 2);
    pin.setTransform(Transform(Rotation(Pi / 2, XAxis), Vec3(0, 0, (front - back) / 2)));
    DecorativeBrick plate(Vec3(0.5 * m_pitch, 0.4 * m_pitch, 0.06 * m_pitch));
    plate.setTransform(Vec3(0, 0, -back));
    matter.updGround().addBodyDecoration(Transform(), pin.setColor(iron).setResolution(3));
    matter.updGround().addBodyDecoration(Transform(), plate.setColor(iron));
}

}  // namespace simflex::examples
