#include "simflex/body/FlexibleBody.h"

#include <algorithm>

#include "simflex/body/FlexibleBodySubsystemGuts.h"
#include "simflex/body/ModalMobilizer.h"

namespace simflex {

using namespace SimTK;

namespace {

Vec3 toVec3(const std::array<double, 3>& v) {
    return {v[0], v[1], v[2]};
}

void requireModes(const FlexibleBody& body, const Vector& values, const char* what) {
    if (values.size() != body.getNumModes())
        throw std::invalid_argument("FlexibleBody '" + body.getName() + "' has " +
                                    std::to_string(body.getNumModes()) + " modal " + what +
                                    ", not " + std::to_string(values.size()));
}

}  // namespace

FlexibleBody::FlexibleBody(FlexibleBodySubsystem& subsystem,
                           std::shared_ptr<const ReducedBody> part, const std::string& name)
    : m_system(&subsystem.getMultibodySystem()), m_subsystem(subsystem.getMySubsystemIndex()) {
    if (!part) throw std::invalid_argument("FlexibleBody '" + name + "': no part given");
    FlexibleBodySubsystem::Guts& guts = subsystem.updGuts();
    SimbodyMatterSubsystem& matter = guts.updMatter();

    FlexibleBodyRecord record;
    record.name = name.empty() ? part->name : name;
    record.model = guts.obtainModel(part);
    record.stiffened = guts.obtainStiffenedModel(part);
    record.rigid = guts.obtainRigidModel(part);
    const auto& I = part->inertia;
    const MassProperties properties(part->mass, Vec3(0),
                                    Inertia(I[0], I[1], I[2], I[3], I[4], I[5]));
    record.frame =
        MobilizedBody::Free(matter.Ground(), Body::Rigid(properties)).getMobilizedBodyIndex();
    for (int mode = 0; mode < part->numModes; mode += ModalMobilizer::MaxModes) {
        const int count = std::min(int(ModalMobilizer::MaxModes), part->numModes - mode);
        record.carriers.push_back(ModalMobilizer(matter, count).getMobilizedBodyIndex());
    }
    guts.makeUnique(record);
    m_index = guts.addBody(std::move(record));
}

const FlexibleBodySubsystem::Guts& FlexibleBody::guts() const {
    return dynamic_cast<const FlexibleBodySubsystem::Guts&>(
        m_system->getSubsystem(m_subsystem).getSubsystemGuts());
}

FlexibleBodySubsystem::Guts& FlexibleBody::updGuts() {
    // Like Simbody's handles, a const handle gives write access to its system.
    return const_cast<FlexibleBodySubsystem::Guts&>(guts());
}

void FlexibleBody::setStiffeningDisabledByDefault(bool isDisabled) {
    using Stiffening = FlexibleBodySubsystem::Guts::Stiffening;
    updGuts().setStiffeningByDefault(m_index, isDisabled ? Stiffening::Off : Stiffening::On);
}

void FlexibleBody::enableStiffening(State& state) const {
    guts().setStiffening(state, m_index, FlexibleBodySubsystem::Guts::Stiffening::On);
}

void FlexibleBody::disableStiffening(State& state) const {
    guts().setStiffening(state, m_index, FlexibleBodySubsystem::Guts::Stiffening::Off);
}

bool FlexibleBody::isStiffeningEnabled(const State& state) const {
    return guts().getStiffening(state, guts().body(m_index)) ==
           FlexibleBodySubsystem::Guts::Stiffening::On;
}

void FlexibleBody::setRigid(State& state) const {
    for (int k = 0; k < getNumModalMobilizers(); ++k) {
        const MobilizedBody& modes = getModalMobilizer(k);
        modes.lockAt(state, Vector(modes.getNumQ(state), Real(0)));
    }
}

void FlexibleBody::setFlexible(State& state) const {
    for (int k = 0; k < getNumModalMobilizers(); ++k) getModalMobilizer(k).unlock(state);
}

bool FlexibleBody::isRigid(const State& state) const {
    return guts().isRigid(state, guts().body(m_index));
}

void FlexibleBody::setRigidByDefault(bool isRigid) {
    FlexibleBodySubsystem::Guts& own = updGuts();
    for (MobilizedBodyIndex carrier : own.body(m_index).carriers)
        own.updMatter().updMobilizedBody(carrier).lockByDefault(isRigid ? Motion::Position
                                                                        : Motion::NoLevel);
}

bool FlexibleBody::isRigidByDefault() const {
    const FlexibleBodySubsystem::Guts& own = guts();
    const auto& carriers = own.body(m_index).carriers;
    return std::all_of(carriers.begin(), carriers.end(), [&](MobilizedBodyIndex carrier) {
        return own.getMatter().getMobilizedBody(carrier).getLockByDefaultLevel() ==
               Motion::Position;
    });
}

int FlexibleBody::findNearestNode(const Vec3& point) const {
    const Mesh& mesh = getPart().mesh;
    const int numPlaces = mesh.numNodes() - mesh.numInternalNodes;
    if (!point.isFinite() || numPlaces == 0)
        throw std::invalid_argument(
            "FlexibleBody '" + getName() +
            "': " + (numPlaces == 0 ? "its part has no nodes" : "the point is not finite"));
    const Vec3 s = point - toVec3(getPart().centerOfMass);
    int nearest = 0;
    Real least = Infinity;
    for (int node = 0; node < numPlaces; ++node) {
        const Real distance = (toVec3(mesh.position(node)) - s).normSqr();
        if (!(distance < least)) continue;
        least = distance;
        nearest = node;
    }
    return mesh.nodeNumbers[size_t(nearest)];
}

Vec3 FlexibleBody::getNodePosition(int nodeNumber) const {
    const ReducedBody& part = getPart();
    return toVec3(part.centerOfMass) + toVec3(part.mesh.position(part.mesh.indexOf(nodeNumber)));
}

const std::string& FlexibleBody::getName() const {
    return guts().body(m_index).name;
}

const std::shared_ptr<const ReducedBody>& FlexibleBody::getPartHandle() const {
    return guts().body(m_index).model->part;
}

const MobilizedBody& FlexibleBody::getFrame() const {
    return guts().getMatter().getMobilizedBody(guts().body(m_index).frame);
}

const MobilizedBody& FlexibleBody::getModalMobilizer(int k) const {
    return guts().getMatter().getMobilizedBody(guts().body(m_index).carriers.at(k));
}

int FlexibleBody::getNumModalMobilizers() const {
    return int(guts().body(m_index).carriers.size());
}

Transform FlexibleBody::getFramePose(const State& state) const {
    return getFrame().getBodyTransform(state);
}

SpatialVec FlexibleBody::getFrameVelocity(const State& state) const {
    return getFrame().getBodyVelocity(state);
}

Vector FlexibleBody::getModalCoordinates(const State& state) const {
    const Eigen::VectorXd xi = guts().getXi(state, guts().body(m_index));
    return Vector(int(xi.size()), xi.data());
}

Vector FlexibleBody::getModalSpeeds(const State& state) const {
    const Eigen::VectorXd xiDot = guts().getXiDot(state, guts().body(m_index));
    return Vector(int(xiDot.size()), xiDot.data());
}

void FlexibleBody::setFramePose(State& state, const Transform& X_GB) const {
    getFrame().setQToFitTransform(state, X_GB);
}

void FlexibleBody::setFrameVelocity(State& state, const SpatialVec& V_GB) const {
    getFrame().setUToFitVelocity(state, V_GB);
}

void FlexibleBody::setModalCoordinates(State& state, const Vector& xi) const {
    requireModes(*this, xi, "coordinates");
    for (int i = 0; i < xi.size(); ++i)
        getModalMobilizer(i / ModalMobilizer::MaxModes)
            .setOneQ(state, i % ModalMobilizer::MaxModes, xi[i]);
}

void FlexibleBody::setModalSpeeds(State& state, const Vector& xiDot) const {
    requireModes(*this, xiDot, "speeds");
    for (int i = 0; i < xiDot.size(); ++i)
        getModalMobilizer(i / ModalMobilizer::MaxModes)
            .setOneU(state, i % ModalMobilizer::MaxModes, xiDot[i]);
}

void FlexibleBody::setPoseByInterface(State& state, const std::string& name,
                                      const Transform& X_GI) const {
    const Vec3 s = toVec3(getPart().getInterface(name).position);
    setFramePose(state, X_GI * Transform(-s));
}

Real FlexibleBody::calcKineticEnergy(const State& state) const {
    const FlexibleBodyRecord& record = guts().body(m_index);
    const Eigen::VectorXd xi = guts().getXi(state, record), xiDot = guts().getXiDot(state, record);
    const BodyFrame frame = guts().getBodyFrame(state, record);
    const FlexibleBodyModel& model = guts().getModel(state, record);
    FlexibleBodyData data;
    data.resize(model);
    calcInertia(model, xi, xiDot, data);
    return simflex::calcKineticEnergy(model, data, toEigen(frame.omega_B), toEigen(frame.v_G),
                                      xiDot);
}

Real FlexibleBody::calcStrainEnergy(const State& state) const {
    const FlexibleBodyRecord& record = guts().body(m_index);
    const Eigen::VectorXd xi = guts().getXi(state, record);
    return 0.5 * xi.dot(record.model->omegaSquared.cwiseProduct(xi));
}

Vector FlexibleBody::calcModalStrainEnergies(const State& state) const {
    Vector energies = getModalCoordinates(state);
    for (int i = 0; i < energies.size(); ++i)
        energies[i] *= 0.5 * getPart().omegaSquared[size_t(i)] * energies[i];
    return energies;
}

SpatialVec FlexibleBody::calcMomentum(const State& state) const {
    const FlexibleBodyRecord& record = guts().body(m_index);
    const Eigen::VectorXd xi = guts().getXi(state, record), xiDot = guts().getXiDot(state, record);
    const BodyFrame frame = guts().getBodyFrame(state, record);
    const FlexibleBodyModel& model = guts().getModel(state, record);
    FlexibleBodyData data;
    data.resize(model);
    calcInertia(model, xi, xiDot, data);
    const Vec3 linear = model.mass * frame.v_G;
    const Vec3 spin = frame.R_GB * toSimTK(data.I * toEigen(frame.omega_B) + data.CXiDot);
    return {spin + frame.p_GB % linear, linear};
}

Vec3 FlexibleBody::calcNodeDisplacement(const State& state, int nodeNumber) const {
    const ReducedBody& part = getPart();
    const int node = part.mesh.indexOf(nodeNumber);
    const Eigen::VectorXd xi = guts().getXi(state, guts().body(m_index));
    return toSimTK(calcDisplacement(part, node, xi.data()));
}

Vec3 FlexibleBody::calcNodeLocation(const State& state, int nodeNumber) const {
    const Mesh& mesh = getPart().mesh;
    return getFramePose(state) * (toVec3(mesh.position(mesh.indexOf(nodeNumber))) +
                                  calcNodeDisplacement(state, nodeNumber));
}

Real FlexibleBody::calcLargestDisplacement(const State& state) const {
    const FlexibleBodyRecord& record = guts().body(m_index);
    return record.model->findLargestDisplacement(guts().getXi(state, record).data()).displacement;
}

}  // namespace simflex
