#include "simflex/body/Attachment.h"

#include <algorithm>
#include <map>
#include <mutex>
#include <set>

#include "simflex/base/DenseAlgebra.h"
#include "simflex/body/FlexibleBody.h"
#include "simflex/body/FlexibleBodySubsystemGuts.h"

namespace simflex {

using namespace SimTK;

namespace {

/** Returns the mesh indices of the nodes that share an element with `node`, without `node`
itself. **/
std::vector<int> findNeighbours(const Mesh& mesh, int node) {
    std::set<int> neighbours;
    for (const ElementBlock& block : mesh.elements) {
        const int size = numNodesOf(block.type);
        for (auto element = block.nodes.begin(); element != block.nodes.end(); element += size)
            if (std::find(element, element + size, node) != element + size)
                neighbours.insert(element, element + size);
    }
    neighbours.erase(node);
    return {neighbours.begin(), neighbours.end()};
}

/** Neighbours of a node that belongs to no element, such as mid-surface nodes of shells and beams:
those of the solid's nodes above and below it. Empty if there are none. **/
std::vector<int> findNeighboursBetween(const Mesh& mesh, int node) {
    constexpr double OnTheLine = 1e-6;  // relative to the length
    const auto vectorTo = [&](int other) {
        const auto x = mesh.position(node), y = mesh.position(other);
        return Vec3(y[0] - x[0], y[1] - x[1], y[2] - x[2]);
    };
    int nearest = -1;
    for (const ElementBlock& block : mesh.elements)
        for (const int other : block.nodes)
            if (nearest < 0 || vectorTo(other).norm() < vectorTo(nearest).norm()) nearest = other;
    if (nearest < 0) return {};
    std::vector<int> neighbours = findNeighbours(mesh, nearest);
    const Vec3 to = vectorTo(nearest);
    for (const int other : neighbours) {
        const Vec3 from = vectorTo(other);
        if (to.norm() + from.norm() > (1 + OnTheLine) * (from - to).norm()) continue;
        neighbours.push_back(nearest);
        return neighbours;
    }
    return {};
}

/** Rotation shapes of a node (3×n_f): axial vector of the least-squares gradient of Φ over its
neighbours. **/
Eigen::MatrixXd calcNodeRotations(const ReducedBody& part, int node) {
    std::vector<int> neighbours = findNeighbours(part.mesh, node);
    if (neighbours.empty()) neighbours = findNeighboursBetween(part.mesh, node);
    const Eigen::Map<const Eigen::Matrix3Xd> positions(part.mesh.positions.data(), 3,
                                                       part.mesh.numNodes());
    const Eigen::Map<const Eigen::MatrixXd> Phi(part.Phi.data(), 3 * part.mesh.numNodes(),
                                                part.numModes);
    Eigen::MatrixXd offsets(neighbours.size(), 3);
    for (size_t k = 0; k < neighbours.size(); ++k)
        offsets.row(k) = (positions.col(neighbours[k]) - positions.col(node)).transpose();
    const LeastSquares fit(offsets);
    if (fit.getRank() < 3)
        throw std::invalid_argument("part '" + part.name + "': node " +
                                    std::to_string(part.mesh.nodeNumbers[node]) +
                                    " has too few neighbours in the mesh to carry an attachment; "
                                    "name an interface, or a node of solid elements");

    Eigen::MatrixXd rotations(3, part.numModes);
    Eigen::MatrixXd differences(neighbours.size(), 3);
    for (int i = 0; i < part.numModes; ++i) {
        for (size_t k = 0; k < neighbours.size(); ++k)
            differences.row(k) =
                (Phi.block<3, 1>(3 * neighbours[k], i) - Phi.block<3, 1>(3 * node, i)).transpose();
        const Eigen::Matrix3d gradient = fit.solve(differences).transpose();  // ∂φ_a/∂s_b
        rotations.col(i) =
            0.5 * Eigen::Vector3d(gradient(2, 1) - gradient(1, 2), gradient(0, 2) - gradient(2, 0),
                                  gradient(1, 0) - gradient(0, 1));
    }
    return rotations;
}

std::shared_ptr<const FrameShapes> makeNodeShapes(const ReducedBody& part, int node) {
    const Eigen::MatrixXd Psi = calcNodeRotations(part, node);
    const auto s = part.mesh.position(node);
    std::vector<double> Phi;
    for (int i = 0; i < part.numModes; ++i) {
        const double* phi = part.Phi.data() + size_t(i) * 3 * part.mesh.numNodes() + 3 * node;
        Phi.insert(Phi.end(), phi, phi + 3);
    }
    return FrameShapes::make(Vec3(s[0], s[1], s[2]), Phi,
                             std::vector<double>(Psi.data(), Psi.data() + Psi.size()));
}

/** Cache of node shapes, shared by all frames on a node of a part, so that the elimination
multiplies by each once for all bodies of the part. An entry lives as long as a frame uses it. **/
class NodeShapes {
public:
    std::shared_ptr<const FrameShapes> obtain(const std::shared_ptr<const ReducedBody>& part,
                                              int node) {
        const std::lock_guard<std::mutex> lock(m_mutex);
        std::weak_ptr<const FrameShapes>& known = m_shapes[{part, node}];
        std::shared_ptr<const FrameShapes> shapes = known.lock();
        if (shapes) return shapes;
        known = shapes = makeNodeShapes(*part, node);
        if (m_shapes.size() >= m_sizeToClean) {
            for (auto at = m_shapes.begin(); at != m_shapes.end();)
                at = at->second.expired() ? m_shapes.erase(at) : std::next(at);
            m_sizeToClean = 2 * m_shapes.size() + 16;
        }
        return shapes;
    }

private:
    struct Key {
        std::weak_ptr<const ReducedBody> part;
        int node;
        bool operator<(const Key& other) const {
            if (part.owner_before(other.part)) return true;
            return !other.part.owner_before(part) && node < other.node;
        }
    };

    std::mutex m_mutex;
    std::map<Key, std::weak_ptr<const FrameShapes>> m_shapes;
    size_t m_sizeToClean = 16;
};

}  // namespace

Attachment::Attachment(const MobilizedBody& body, const Transform& X_BA)
    : m_name(body.isGround()
                 ? "ground"
                 : describeBody(body.getMatterSubsystem(), body.getMobilizedBodyIndex())),
      m_mobod(body.getMobilizedBodyIndex()),
      m_X_BA(X_BA),
      m_mobilizedBody(std::make_shared<const MobilizedBody>(body)) {}

Attachment Attachment::onInterface(const FlexibleBody& body, const std::string& name,
                                   const Transform& X_IA) {
    auto frame = std::make_shared<FlexibleFrame>();
    frame->shapes = body.guts().body(body.getIndex()).model->getInterfaceShapes(name);
    frame->X_IA = X_IA;

    Attachment attachment;
    attachment.m_name = body.getName() + "." + name;
    attachment.m_mobod = body.getFrame().getMobilizedBodyIndex();
    attachment.m_flexibleBody = body.getIndex();
    attachment.m_flexibleFrame = frame;
    attachment.m_body = std::make_shared<const FlexibleBody>(body);
    return attachment;
}

Attachment Attachment::onNode(const FlexibleBody& body, int nodeNumber, const Transform& X_NA) {
    static NodeShapes nodeShapes;
    const auto& part = body.guts().body(body.getIndex()).model->part;
    auto frame = std::make_shared<FlexibleFrame>();
    frame->shapes = nodeShapes.obtain(part, part->mesh.indexOf(nodeNumber));
    frame->X_IA = X_NA;

    Attachment attachment;
    attachment.m_name = body.getName() + " node " + std::to_string(nodeNumber);
    attachment.m_mobod = body.getFrame().getMobilizedBodyIndex();
    attachment.m_flexibleBody = body.getIndex();
    attachment.m_flexibleFrame = frame;
    attachment.m_body = std::make_shared<const FlexibleBody>(body);
    return attachment;
}

Attachment Attachment::onShapes(const FlexibleBody& body, const Vec3& s, std::vector<double> Phi,
                                std::vector<double> Psi) {
    const size_t count = 3 * size_t(body.getNumModes());
    for (std::vector<double>* shapes : {&Phi, &Psi}) {
        if (shapes->empty()) shapes->resize(count, 0);
        if (shapes->size() != count)
            throw std::invalid_argument("body '" + body.getName() + "': a frame has shapes of " +
                                        std::to_string(shapes->size() / 3) + " modes, the body " +
                                        std::to_string(body.getNumModes()));
    }
    auto frame = std::make_shared<FlexibleFrame>();
    frame->shapes = FrameShapes::make(s, Phi, Psi);

    Attachment attachment;
    attachment.m_name = body.getName();
    attachment.m_mobod = body.getFrame().getMobilizedBodyIndex();
    attachment.m_flexibleBody = body.getIndex();
    attachment.m_flexibleFrame = frame;
    attachment.m_body = std::make_shared<const FlexibleBody>(body);
    return attachment;
}

bool Attachment::isIn(const FlexibleBodySubsystem& subsystem) const {
    const FlexibleBodySubsystem::Guts& guts = subsystem.getGuts();
    if (m_body) return &m_body->guts() == &guts;
    return m_mobilizedBody->getMatterSubsystem().isSameSubsystem(guts.getMatter());
}

FrameAtXi::Order Attachment::getFrameOrder(const State& state) const {
    return m_body->isStiffeningEnabled(state) ? FrameAtXi::Order::Second : FrameAtXi::Order::First;
}

FrameMotion Attachment::calcMotion(const State& state) const {
    if (m_body) return m_body->guts().calcMotion(state, *this);
    FrameMotion motion;
    motion.X = m_mobilizedBody->getBodyTransform(state);
    motion.V = m_mobilizedBody->getBodyVelocity(state);
    return shiftMotion(motion, m_X_BA);
}

bool isSame(const Attachment& a, const Attachment& b) {
    if (a.isFlexible() != b.isFlexible() || a.getMobilizedBodyIndex() != b.getMobilizedBodyIndex())
        return false;
    if (a.isFlexible()) return &a.getFlexibleFrame() == &b.getFlexibleFrame();
    const SimTK::Transform &A = a.getFrame(), &B = b.getFrame();
    return A.p() == B.p() && A.R().asMat33() == B.R().asMat33();
}

}  // namespace simflex
