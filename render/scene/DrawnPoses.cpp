#include "DrawnPoses.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>

#include "simflex/body/FlexibleBody.h"
#include "simflex/body/Joint.h"
#include "simflex/body/JointEquations.h"

namespace simflex {

using SimTK::MobilizedBody;
using SimTK::SpatialVec;
using SimTK::State;
using SimTK::Transform;
using SimTK::Vec3;
using SimTK::Vector;

namespace {

constexpr double apart = 0.1;  // relative to the scale: true gap of a joint that has come apart
constexpr double groundWeight = 30;  // weight of errors at joints with Ground relative to others
constexpr double turnWeight = 1e-3;  // weight of errors in direction, times the scale, relative to
                                     // gaps
constexpr double leastDamping = 1e-13, firstDamping = 1e-9, mostDamping = 1e4;  // μ
constexpr double longestTurn = 0.5;                                             // per step [rad]
constexpr double shortestStep = 1e-11;                                          // relative to the
                                                                                // scale
constexpr int mostSteps = 100;

bool isFixed(const State& state, const MobilizedBody& body) {
    if (body.isGround()) return true;
    return body.getNumU(state) == 0 && isFixed(state, body.getParentMobilizedBody());
}

bool standsOnGround(const State& state, const SimTK::SimbodyMatterSubsystem& matter,
                    const Attachment& frame) {
    return !frame.isFlexible() &&
           isFixed(state, matter.getMobilizedBody(frame.getMobilizedBodyIndex()));
}

bool isSameSeat(const Attachment& a, const Attachment& b) {
    return a.isFlexible() && b.isFlexible() &&
           a.getFlexibleBodyIndex() == b.getFlexibleBodyIndex() &&
           a.getFlexibleFrame().shapes->s == b.getFlexibleFrame().shapes->s;
}

// Returns whether a joint holds the origins of its frames together, except for sliding.
bool holdsPlace(const std::string& kind) {
    for (const char* const one : {"Ball", "Pin", "Slider", "Weld", "Cylinder", "Universal",
                                  "Planar", "Screw", "PrescribedPosition", "PrescribedPose"})
        if (kind == one) return true;
    return false;
}

// Projection onto the axes about which a joint holds a frame, in that frame.
SimTK::Mat33 findHeldAxes(const std::string& kind) {
    if (kind == "Weld" || kind == "Slider" || kind == "PrescribedPose") return SimTK::Mat33(1);
    SimTK::Mat33 held(0);
    if (kind == "Pin" || kind == "Cylinder" || kind == "Screw" || kind == "Planar")
        held(0, 0) = held(1, 1) = 1;
    return held;
}

bool isDriven(const FlexibleBodySubsystem& flexible, const Attachment& seat) {
    for (int i = 0; i < flexible.getNumJoints(); ++i) {
        const Joint joint = flexible.getJoint(JointIndex(i));
        if (joint.getEquations().getKind() == std::string("PrescribedRotation") &&
            (isSameSeat(joint.getFrameF(), seat) || isSameSeat(joint.getFrameM(), seat)))
            return true;
    }
    return false;
}

}  // namespace

void DrawnPoses::findReferences() {
    references.clear();
    if (!flexible) return;
    for (const auto& [body, frame] : chosen)
        references.insert_or_assign(body, Reference{frame, SimTK::Mat33(1)});
    if (usesMeanAxes) return;
    for (const bool onGround : {true, false})
        for (int i = 0; i < flexible->getNumJoints(); ++i) {
            const Joint joint = flexible->getJoint(JointIndex(i));
            const std::string kind = joint.getEquations().getKind();
            if (joint.getEquations().isCoupler() || !holdsPlace(kind)) continue;
            for (const bool isF : {true, false}) {
                const Attachment &seat = isF ? joint.getFrameF() : joint.getFrameM(),
                                 &other = isF ? joint.getFrameM() : joint.getFrameF();
                if (!seat.isFlexible() || references.count(seat.getFlexibleBodyIndex())) continue;
                if (onGround && !standsOnGround(*given, *matter, other)) continue;
                const SimTK::Rotation& R_BA = seat.getFlexibleFrame().X_IA.R();
                const SimTK::Mat33 held =
                    isDriven(*flexible, seat)
                        ? SimTK::Mat33(1)
                        : SimTK::Mat33(R_BA.asMat33() * findHeldAxes(kind) * ~R_BA.asMat33());
                references.insert_or_assign(seat.getFlexibleBodyIndex(), Reference{seat, held});
            }
        }
}

ReferenceMotion DrawnPoses::calcReference(FlexibleBodyIndex body) const {
    const auto found = references.find(body);
    if (found == references.end()) return {};
    const FrameShapes& shapes = *found->second.frame.getFlexibleFrame().shapes;
    const Vector xi = flexible->getBody(body).getModalCoordinates(*given);
    const FrameSums atXi = multiplyShapes(shapes, xi.size() ? &xi[0] : nullptr);
    const Vec3 turn = found->second.held * atXi.rotation;
    return {atXi.translation - turn % shapes.s, turn};
}

std::string DrawnPoses::getReferenceName(FlexibleBodyIndex body) const {
    const auto found = references.find(body);
    return found == references.end() ? "" : found->second.frame.getName();
}

Transform DrawnPoses::calcPose(const Attachment& frame) const {
    const Transform X_GB =
        matter->getMobilizedBody(frame.getMobilizedBodyIndex()).getBodyTransform(getState());
    if (!frame.isFlexible()) return X_GB * frame.getFrame();
    const FlexibleFrame& seat = frame.getFlexibleFrame();
    const Vector xi =
        flexible->getBody(frame.getFlexibleBodyIndex()).getModalCoordinates(getState());
    const FrameSums atXi = multiplyShapes(*seat.shapes, xi.size() ? &xi[0] : nullptr);
    const FlexibleBodyIndex body = frame.getFlexibleBodyIndex();
    const double drawnFactor = bodies.empty() || bodies.count(body) ? factor : 1;
    const FlexibleFramePose pose =
        calcFramePose(seat, calcReference(body).exaggerate(atXi, seat.shapes->s, drawnFactor));
    return X_GB * Transform(pose.R_BA, pose.r);
}

/** Moves bodies until the joints are closed. **/
class DrawnPoses::Closing {
public:
    explicit Closing(DrawnPoses& drawn) : m_drawn(drawn), m_matter(*drawn.matter) {
        findScale();
        findJoints();
        findSpeeds();
    }

    void run() {
        if (m_joints.empty() || m_speeds.empty()) return;
        State& state = m_drawn.moved;
        Eigen::VectorXd errors = calcErrors();
        double damping = firstDamping;
        for (int step = 0; step < mostSteps; ++step) {
            const Eigen::SparseMatrix<double> J = calcJacobian();
            const Eigen::SparseMatrix<double> A = J.transpose() * J;
            const Eigen::VectorXd slope = J.transpose() * errors;
            const double mean = A.diagonal().cwiseQuotient(m_weights).mean();
            bool isTaken = false;
            double length = 0;
            for (; damping <= mostDamping && !isTaken; damping *= isTaken ? 1 : 10) {
                Eigen::SparseMatrix<double> damped = A;
                for (int k = 0; k < A.rows(); ++k)
                    damped.coeffRef(k, k) += damping * mean * m_weights[k];
                m_solver.compute(damped);
                Eigen::VectorXd speeds = -m_solver.solve(slope);
                length = 0;
                double turn = 0;
                for (int k = 0; k < speeds.size(); ++k) {
                    length = std::max(length, std::abs(speeds[k]) * std::sqrt(m_weights[k]));
                    turn = std::max(turn, std::abs(speeds[k]) * m_turns[std::size_t(k)]);
                }
                if (!std::isfinite(length)) continue;
                if (turn > longestTurn) speeds *= longestTurn / turn;
                const Vector before = state.getQ();
                move(speeds);
                Eigen::VectorXd next = calcErrors();
                isTaken = next.squaredNorm() < errors.squaredNorm();
                if (isTaken)
                    errors.swap(next);
                else
                    restore(before);
            }
            if (!isTaken || length < shortestStep * m_scale) break;
            damping = std::max(leastDamping, damping / 10);
        }
        findGap();
    }

private:
    struct ClosedJoint {
        Joint joint;
        JointEquations::Drive drive;
        Attachment F, M;
        Transform X_BF, X_BM;  ///< drawn poses on their bodies
        int firstRow, numRows;
        double weight;
        double trueErrors[JointEquations::MaxEquations];
        bool isLength[JointEquations::MaxEquations];
    };

    void findScale() {
        for (int i = 0; i < m_drawn.flexible->getNumBodies(); ++i)
            m_scale = std::max(
                m_scale,
                double(m_drawn.flexible->getBody(FlexibleBodyIndex(i)).getPart().calcRadius()));
    }

    const MobilizedBody& getMobod(const Attachment& frame) const {
        return m_matter.getMobilizedBody(frame.getMobilizedBodyIndex());
    }
    /** Returns the pose of a frame on its body in the given State, with the run's displacement
    order. **/
    Transform calcTruePlace(const Attachment& frame) const {
        if (!frame.isFlexible()) return frame.getFrame();
        const Vector xi = m_drawn.flexible->getBody(frame.getFlexibleBodyIndex())
                              .getModalCoordinates(*m_drawn.given);
        const FrameAtXi at(frame.getFlexibleFrame(), xi.size() ? &xi[0] : nullptr,
                           frame.getFrameOrder(*m_drawn.given));
        return {at.getPose().R_BA, at.getPose().r};
    }
    Transform calcDrawnPlace(const Attachment& frame) const {
        const Transform X_GB = getMobod(frame).getBodyTransform(m_drawn.getState());
        return ~X_GB * m_drawn.calcPose(frame);
    }

    void findJoints() {
        const FlexibleBodySubsystem& flexible = *m_drawn.flexible;
        const State& given = *m_drawn.given;
        for (int i = 0; i < flexible.getNumJoints(); ++i) {
            const Joint joint = flexible.getJoint(JointIndex(i));
            const JointEquations& equations = joint.getEquations();
            if (equations.isCoupler() ||
                m_matter.getConstraint(joint.getConstraintIndex()).isDisabled(given))
                continue;
            ClosedJoint closed{joint,
                               equations.calcDrive(given.getTime()),
                               joint.getFrameF(),
                               joint.getFrameM(),
                               calcDrawnPlace(joint.getFrameF()),
                               calcDrawnPlace(joint.getFrameM()),
                               m_numRows,
                               equations.getNumEquations(),
                               1,
                               {},
                               {}};
            FrameMotion F, M;
            F.X = getMobod(closed.F).getBodyTransform(given) * calcTruePlace(closed.F);
            M.X = getMobod(closed.M).getBodyTransform(given) * calcTruePlace(closed.M);
            const FrameMotion* const frames[] = {&F, &M};
            equations.calcErrors(closed.drive, frames, closed.trueErrors);
            equations.alignErrors(closed.drive, frames, closed.trueErrors);
            SpatialVec D[2 * JointEquations::MaxEquations];
            equations.calcJacobian(closed.drive, frames, D);
            double largest = 0;
            for (int k = 0; k < closed.numRows; ++k) {
                closed.isLength[k] = D[k][1].normSqr() + D[closed.numRows + k][1].normSqr() > 0;
                largest = std::max(
                    largest, std::abs(closed.trueErrors[k]) / (closed.isLength[k] ? m_scale : 1));
            }
            if (!(largest < apart)) continue;
            if (standsOnGround(given, m_matter, closed.F) ||
                standsOnGround(given, m_matter, closed.M))
                closed.weight = groundWeight;
            m_numRows += closed.numRows;
            m_joints.push_back(closed);
        }
    }

    Vec3 getPlace(const ClosedJoint& closed) const {
        return getMobod(closed.M).getBodyTransform(*m_drawn.given) * closed.X_BM.p();
    }

    // Speeds of bodies that joints hold, down to Ground, except prescribed ones.
    void findSpeeds() {
        const State& state = *m_drawn.given;
        // Rotating a body costs as much as moving the whole assembly: a chain with lengthened links
        // is thus extended instead of folded.
        Vec3 middle(0);
        double reach = m_scale;
        for (const ClosedJoint& closed : m_joints)
            middle += getPlace(closed) / double(m_joints.size());
        for (const ClosedJoint& closed : m_joints)
            reach = std::max(reach, double((getPlace(closed) - middle).norm()));
        m_column.assign(std::size_t(state.getNU()), -1);
        std::vector<double> weights;
        for (const ClosedJoint& closed : m_joints)
            for (const Attachment* const frame : {&closed.F, &closed.M})
                for (const MobilizedBody* body = &getMobod(*frame); !body->isGround();
                     body = &body->getParentMobilizedBody()) {
                    if (body->isLocked(state) || body->hasMotion()) continue;
                    for (int k = 0; k < body->getNumU(state); ++k) {
                        int& column = m_column[std::size_t(body->getFirstUIndex(state) + k)];
                        if (column >= 0) continue;
                        column = int(m_speeds.size());
                        m_speeds.push_back(int(body->getFirstUIndex(state)) + k);
                        const SpatialVec H = body->getHCol(state, SimTK::MobilizerUIndex(k));
                        m_turns.push_back(H[0].norm());
                        weights.push_back(H[1].normSqr() + 0.25 * reach * reach * H[0].normSqr());
                    }
                }
        m_weights = Eigen::Map<const Eigen::VectorXd>(weights.data(), Eigen::Index(weights.size()));
    }

    void calcFrames(const ClosedJoint& closed, FrameMotion& F, FrameMotion& M) const {
        F.X = getMobod(closed.F).getBodyTransform(m_drawn.moved) * closed.X_BF;
        M.X = getMobod(closed.M).getBodyTransform(m_drawn.moved) * closed.X_BM;
    }
    double getRowScale(const ClosedJoint& closed, int row) const {
        return closed.weight * (closed.isLength[row] ? 1 : turnWeight * m_scale);
    }

    Eigen::VectorXd calcErrors() const {
        Eigen::VectorXd errors(m_numRows);
        for (const ClosedJoint& closed : m_joints) {
            FrameMotion F, M;
            calcFrames(closed, F, M);
            const FrameMotion* const frames[] = {&F, &M};
            double* const own = &errors[closed.firstRow];
            closed.joint.getEquations().calcErrors(closed.drive, frames, own);
            closed.joint.getEquations().alignErrors(closed.drive, frames, own);
            for (int k = 0; k < closed.numRows; ++k)
                own[k] = getRowScale(closed, k) * (own[k] - closed.trueErrors[k]);
        }
        return errors;
    }

    Eigen::SparseMatrix<double> calcJacobian() const {
        std::vector<Eigen::Triplet<double>> entries;
        for (const ClosedJoint& closed : m_joints) {
            FrameMotion F, M;
            calcFrames(closed, F, M);
            const FrameMotion* const frames[] = {&F, &M};
            SpatialVec D[2 * JointEquations::MaxEquations];
            closed.joint.getEquations().calcJacobian(closed.drive, frames, D);
            closed.joint.getEquations().alignJacobian(closed.drive, frames, D);
            for (const bool isF : {true, false})
                appendColumns(closed, isF ? closed.F : closed.M, isF ? F.X.p() : M.X.p(),
                              isF ? D : D + closed.numRows, entries);
        }
        Eigen::SparseMatrix<double> J(m_numRows, Eigen::Index(m_speeds.size()));
        J.setFromTriplets(entries.begin(), entries.end());
        return J;
    }

    void appendColumns(const ClosedJoint& closed, const Attachment& frame, const Vec3& point_G,
                       const SpatialVec* D, std::vector<Eigen::Triplet<double>>& entries) const {
        const State& state = m_drawn.moved;
        for (const MobilizedBody* body = &getMobod(frame); !body->isGround();
             body = &body->getParentMobilizedBody())
            for (int k = 0; k < body->getNumU(state); ++k) {
                const int column = m_column[std::size_t(body->getFirstUIndex(state) + k)];
                if (column < 0) continue;
                const SpatialVec H = body->getHCol(state, SimTK::MobilizerUIndex(k));
                const Vec3 v = H[1] + H[0] % (point_G - body->getBodyTransform(state).p());
                for (int row = 0; row < closed.numRows; ++row)
                    entries.emplace_back(closed.firstRow + row, column,
                                         getRowScale(closed, row) * (SimTK::dot(D[row][0], H[0]) +
                                                                     SimTK::dot(D[row][1], v)));
            }
    }

    void move(const Eigen::VectorXd& speeds) {
        State& state = m_drawn.moved;
        Vector u(state.getNU(), 0.0), qDot(state.getNQ());
        for (std::size_t k = 0; k < m_speeds.size(); ++k) u[m_speeds[k]] = speeds[Eigen::Index(k)];
        m_matter.multiplyByN(state, false, u, qDot);
        restore(state.getQ() + qDot);
    }
    void restore(const Vector& q) {
        State& state = m_drawn.moved;
        state.updQ() = q;
        m_matter.getSystem().realize(state, SimTK::Stage::Position);
    }

    void findGap() {
        const Eigen::VectorXd errors = calcErrors();
        for (const ClosedJoint& closed : m_joints) {
            double sum = 0;
            for (int k = 0; k < closed.numRows; ++k)
                if (closed.isLength[k])
                    sum += std::pow(errors[closed.firstRow + k] / closed.weight, 2);
            if (std::sqrt(sum) > m_drawn.gap.distance)
                m_drawn.gap = {closed.joint.getName(), std::sqrt(sum)};
        }
    }

    DrawnPoses& m_drawn;
    const SimTK::SimbodyMatterSubsystem& m_matter;
    std::vector<ClosedJoint> m_joints;
    int m_numRows = 0;
    double m_scale = 0;           // radius of the largest part [m]
    std::vector<int> m_column;    // by system speed; −1: not moved
    std::vector<int> m_speeds;    // by column
    std::vector<double> m_turns;  // rotation caused by each speed [rad]
    Eigen::VectorXd m_weights;    // diagonal of W
    Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> m_solver;
};

void DrawnPoses::update(const SimTK::System& system, const State& state, double deformationFactor) {
    given = &state;
    factor = deformationFactor;
    isMoved = false;
    gap = {};
    matter = nullptr;
    if (SimTK::MultibodySystem::isInstanceOf(system)) {
        const auto& multibody = SimTK::MultibodySystem::downcast(system);
        if (multibody.hasMatterSubsystem()) matter = &multibody.getMatterSubsystem();
    }
    flexible = matter ? FlexibleBodySubsystem::find(system) : nullptr;
    findReferences();
    if (!flexible || factor == 1 || flexible->getNumBodies() == 0) return;
    moved = state;
    isMoved = true;
    system.realize(moved, SimTK::Stage::Position);
    Closing(*this).run();
}

}  // namespace simflex
