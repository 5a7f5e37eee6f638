#include "simflex/solver/equilibrium/SteadyMotion.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <sstream>

#include "simflex/base/DenseAlgebra.h"
#include "simflex/solver/equilibrium/TangentElimination.h"

namespace simflex {

using namespace SimTK;
using Eigen::Map;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

/** Rate below which a system is at rest [rad/s]. **/
constexpr double SlowestRate = 1e-8;
/** Step of differences along the motion [rad]. **/
constexpr double TurnStep = 5e-3;
/** Cost of a rotation, relative to a translation by as much of a body's size, in closing loops. **/
constexpr double TurnCost = 1e4;
/** Constraint error allowed at given speeds, relative to 1 plus the fastest. **/
constexpr double SmallError = 1e-7;
/** The same for constant twists. **/
constexpr double TwistError = 1e-9;
constexpr double ClosureRank = 1e-10, ClosedLoop = 1e-15;
constexpr int NumClosings = 12, NumFlowPieces = 16;
/** Displacements for testing whether loops need closing [m], and the error allowed there, relative
to the displacement times the motion's rate. **/
constexpr double TrialStep = 1e-4, TrialError = 1e-5;
constexpr int NumTrials = 3;

double measure(const std::vector<double>& speeds) {
    double largest = 0;
    for (const double speed : speeds) largest = std::max(largest, std::abs(speed));
    return largest;
}

/** (ω, v) of the point at Ground's origin from that of the point at p, and back. **/
SpatialVec toOrigin(const SpatialVec& V, const Vec3& p) {
    return {V[0], V[1] - V[0] % p};
}
SpatialVec fromOrigin(const SpatialVec& twist, const Vec3& p) {
    return {twist[0], twist[1] + twist[0] % p};
}

/** Displacement after a duration of a constant twist, about the origin. **/
Transform calcExponential(const SpatialVec& twist, Real duration) {
    const Vec3 w = duration * twist[0], v = duration * twist[1], wv = w % v;
    const Real angle = w.norm();
    if (angle < 1e-6) return {angle > 0 ? Rotation(angle, UnitVec3(w)) : Rotation(), v + 0.5 * wv};
    return {Rotation(angle, UnitVec3(w)), v + (1 - std::cos(angle)) / square(angle) * wv +
                                              (angle - std::sin(angle)) / cube(angle) * (w % wv)};
}

/** The rotation vector of R. **/
Vec3 calcTurn(const Rotation& R) {
    const Vec4 turn = R.convertRotationToAngleAxis();
    return turn[0] * turn.getSubVec<3>(1);
}

}  // namespace

SteadyMotion::SteadyMotion(Evaluation& equations, const State& state, double t,
                           const std::vector<double>& given, const std::vector<double>& u,
                           const std::vector<double>& q)
    : m_equations(&equations),
      m_t(t),
      m_u(u),
      m_errors(size_t(equations.getTopology().numMultipliers), 0) {
    for (int b = 0; b < equations.getTopology().numFlexible; ++b) {
        const Block& block = equations.getBlock(b);
        std::fill_n(m_u.begin() + block.firstU + 6, block.numU - 6, 0.0);
    }
    const bool isDriven = findDriven(q);
    if (!isDriven && std::all_of(m_u.begin(), m_u.end(), [](double speed) { return speed == 0; }))
        return;
    findRoots(state);
    putTwists(calcTwists(given, m_u), q, m_u);
    equations.realize(t, q.data(), m_u.data());
    m_links = listLinks(equations);
    const auto calcLargestError = [&] {
        equations.realize(t, q.data(), m_u.data());
        equations.calcVelocityErrors(m_errors.data());
        const double fastest = measure(m_u);
        return measure(m_errors) / (1 + fastest);
    };
    if (isDriven) {
        const std::vector<double> before = m_u;
        followJoints(q);
        if (calcLargestError() > SmallError) {
            m_u = before;
            m_equations->realize(t, q.data(), m_u.data());
            followMotions(q);
        }
    }
    if (calcLargestError() <= SmallError) {
        const std::vector<double> before = m_u, errors = m_errors;
        if (!isDriven) followJoints(q);
        if (calcLargestError() <= TwistError) {
            takeTwists(q);
            m_hasConstantTwists = isAtRest() || canKeepTwists(q);
        }
        m_errors = errors;
        if (m_hasConstantTwists) {
            m_reaches.clear();
            return;
        }
        m_u = before;
    }
    if (!m_errors.empty()) {
        prepareClosing(q);
        closeLoops(q, m_u);
    }
    takeTwists(q);
    if (!isAtRest() && m_closing.size() > 0 && keepsConstraints(q)) m_closing.resize(0, 0);
}

void SteadyMotion::takeTwists(const std::vector<double>& q) {
    m_equations->realize(m_t, q.data(), m_u.data());
    m_twists = calcTwists(q, m_u);
    findReaches();
    m_rate = 0;
    Real fastest = 0;
    for (size_t r = 0; r < m_roots.size(); ++r) {
        m_rate = std::max(m_rate, m_twists[r][0].norm());
        fastest = std::max(fastest, m_twists[r][1].norm());
        std::fill_n(m_u.begin() + m_roots[r].u0, 6, 0.0);
    }
    for (const double speed : m_u) m_rate = std::max(m_rate, std::abs(speed));
    if (m_rate == 0) m_rate = fastest;
    if (m_rate < SlowestRate) m_rate = 0;
}

bool SteadyMotion::canKeepTwists(const std::vector<double>& q) const {
    Evaluation& equations = *m_equations;
    SteadyMotion constant = *this;
    constant.m_reaches.clear();
    std::vector<double> u, byJoints;
    constant.calcX(q, u);
    const CoordinateScales scales(equations.getBlocks());
    const std::vector<double> none(std::max(u.size(), m_errors.size()), 0);
    VectorXd r(Eigen::Index(u.size()));
    equations.realize(m_t, q.data(), u.data());
    equations.calcResidual(q.data(), u.data(), none.data(), none.data(), r.data());
    const BlockGraph graph(equations, BlockGraph::Links::OfJoints);
    const BlockMass mass(equations);
    const Eigen::Index n = r.size();
    VectorXd sizes = VectorXd::Zero(n);
    for (const int i : listFreeSpeeds(equations)) sizes[i] = 1 / scales.metres[size_t(i)];
    BlockMatrix<double> ofSizes(graph);
    for (size_t b = 0; b < graph.sizes.size(); ++b)
        for (Eigen::Index i = 0; i < graph.sizes[b]; ++i) {
            const double size = sizes[graph.firstU[b] + i];
            ofSizes.at(int(b), int(b))(i, i) = size > 0 ? 1 / square(size) : 1;
        }
    TangentElimination<double> elimination(graph, mass);
    elimination.factor(ofSizes, sizes, TangentElimination<double>::Symmetry::Symmetric);
    MatrixXd displaced(n, NumTrials);
    for (int trial = 0; trial < NumTrials; ++trial)
        for (Eigen::Index i = 0; i < n; ++i)
            displaced(i, trial) = sizes[i] * std::cos((1.3 + 0.2 * trial) * double(i) + trial);
    elimination.close(displaced);
    for (int trial = 0; trial < NumTrials; ++trial) {
        const double size = equations.getBlocks().calcDisplacement(displaced.col(trial).data());
        if (!(size > 0)) continue;
        const VectorXd delta = TrialStep / size * displaced.col(trial);
        VectorXd errors[2];
        for (const int side : {0, 1}) {
            if (equations.getTopology().needsSimbody) equations.realize(m_t, q.data(), m_u.data());
            const VectorXd own = side == 0 ? VectorXd(-delta) : delta;
            std::vector<double> moved = q;
            equations.getBlocks().moveQ(own.data(), moved.data());
            constant.calcX(moved, u);
            equations.realize(m_t, moved.data(), u.data());
            errors[side].resize(mass.numMultipliers);
            equations.calcVelocityErrors(errors[side].data());
            calcX(moved, byJoints);
            for (size_t i = 0; i < u.size(); ++i)
                if (std::abs(byJoints[i] - u[i]) * scales.metres[i] >
                    TrialError * TrialStep * m_rate)
                    return false;
        }
        if (mass.numMultipliers > 0 &&
            (errors[1] - errors[0]).lpNorm<Eigen::Infinity>() > TrialError * TrialStep * m_rate)
            return false;
    }
    return true;
}

bool SteadyMotion::keepsConstraints(const std::vector<double>& q) const {
    SteadyMotion open = *this;
    open.m_closing.resize(0, 0);
    const CoordinateScales scales(m_equations->getBlocks());
    const Eigen::Index n = m_G.cols();
    VectorXd sizes = VectorXd::Zero(n);
    for (const int i : listFreeSpeeds(*m_equations)) sizes[i] = 1 / scales.metres[size_t(i)];
    const TangentSpace space(m_G * sizes.asDiagonal());
    std::vector<double> u;
    for (int trial = 0; trial < NumTrials; ++trial) {
        VectorXd y(space.getBasis().cols());
        for (Eigen::Index i = 0; i < y.size(); ++i)
            y[i] = std::cos((1.3 + 0.2 * trial) * double(i) + trial);
        const VectorXd delta =
            TrialStep / std::max(1.0, y.norm()) * sizes.cwiseProduct(space.getBasis() * y);
        VectorXd errors[2];
        for (const int side : {0, 1}) {
            if (m_equations->getTopology().needsSimbody)
                m_equations->realize(m_t, q.data(), m_u.data());
            const VectorXd own = side == 0 ? VectorXd(-delta) : delta;
            std::vector<double> moved = q;
            m_equations->getBlocks().moveQ(own.data(), moved.data());
            open.calcX(moved, u);
            m_equations->realize(m_t, moved.data(), u.data());
            errors[side].resize(m_G.rows());
            m_equations->calcVelocityErrors(errors[side].data());
        }
        if ((errors[1] - errors[0]).lpNorm<Eigen::Infinity>() > TrialError * TrialStep * m_rate)
            return false;
    }
    return true;
}

void SteadyMotion::findRoots(const State& state) {
    const Evaluation& equations = *m_equations;
    for (int b = 0; b < equations.getTopology().numFlexible; ++b) {
        const Block& block = equations.getBlock(b);
        m_roots.push_back({b, true, block.firstQ, block.firstQ + 4, block.firstU, {}});
    }
    const SimbodyMatterSubsystem& matter = equations.getTopology().system->getMatterSubsystem();
    for (MobilizedBodyIndex i(1); i < matter.getNumBodies(); ++i) {
        const MobilizedBody& mobod = matter.getMobilizedBody(i);
        Root root{equations.getTopology().findBlock(i), false, 0, 0, 0, {}};
        int nq;
        if (!equations.getBlocks().findRigidSlots(equations.getTopology(), i, root.q0, nq,
                                                  root.u0) ||
            !MobilizedBody::Free::isInstanceOf(mobod) ||
            mobod.getParentMobilizedBody().getMobilizedBodyIndex() != GroundIndex)
            continue;
        root.p0 = root.q0 + nq - 3;
        root.X_GF = mobod.getInboardFrame(state);
        m_roots.push_back(root);
    }
    m_rootOf.assign(size_t(equations.getTopology().numBlocks()), -1);
    for (size_t r = m_roots.size(); r-- > 0;) m_rootOf[size_t(m_roots[r].block)] = int(r);
}

Rotation SteadyMotion::calcAxes(const Root& root, const std::vector<double>& q) const {
    return root.isFlexible ? rotationOf(q.data() + root.q0) : root.X_GF.R();
}

Vec3 SteadyMotion::calcPlace(const Root& root, const std::vector<double>& q) const {
    return root.X_GF * Vec3::getAs(q.data() + root.p0);
}

SteadyMotion::Twists SteadyMotion::calcTwists(const std::vector<double>& q,
                                              const std::vector<double>& u) const {
    Twists twists;
    for (const Root& root : m_roots) {
        const Vec3 omega = calcAxes(root, q) * Vec3::getAs(u.data() + root.u0);
        const Vec3 v = root.X_GF.R() * Vec3::getAs(u.data() + root.u0 + 3);
        twists.push_back(toOrigin({omega, v}, calcPlace(root, q)));
    }
    return twists;
}

void SteadyMotion::putTwists(const Twists& twists, const std::vector<double>& q,
                             std::vector<double>& u) const {
    for (size_t r = 0; r < m_roots.size(); ++r) {
        const Root& root = m_roots[r];
        const SpatialVec V = fromOrigin(twists[r], calcPlace(root, q));
        Vec3::updAs(u.data() + root.u0) = ~calcAxes(root, q) * V[0];
        Vec3::updAs(u.data() + root.u0 + 3) = ~root.X_GF.R() * V[1];
    }
}

SpatialVec SteadyMotion::calcTwist(const Link& link, int side, const Twists& twists) const {
    const FrameMotion& frame = *link.motions[side];
    const SpatialVec own = toOrigin(frame.V, frame.X.p());
    const int root = findRoot(link.blocks[side]);
    return root < 0 ? own : own + twists[size_t(root)];
}

void SteadyMotion::findReaches() {
    m_reaches.clear();
    std::stable_sort(m_links.begin(), m_links.end(),
                     [](const auto& a, const auto& b) { return a.numEquations > b.numEquations; });
    const Twists none(m_roots.size(), SpatialVec(Vec3(0), Vec3(0)));
    std::vector<char> isReached(m_roots.size(), 0);
    const auto isKnown = [&](int block) {
        const int root = findRoot(block);
        return root < 0 || isReached[size_t(root)];
    };
    std::vector<std::vector<int>> linksOf(m_roots.size());
    std::set<int> open;  // links with exactly one side reached
    const auto look = [&](int link) {
        const Link& it = m_links[size_t(link)];
        if (isKnown(it.blocks[0]) != isKnown(it.blocks[1]))
            open.insert(link);
        else
            open.erase(link);
    };
    for (int link = 0; link < int(m_links.size()); ++link) {
        for (const int block : m_links[size_t(link)].blocks)
            if (findRoot(block) >= 0) linksOf[size_t(findRoot(block))].push_back(link);
        look(link);
    }
    size_t next = 0;  // all roots before it are reached
    for (size_t count = 0; count < m_roots.size(); ++count) {
        int root = -1;
        if (open.empty()) {
            while (isReached[next]) ++next;
            root = int(next);
        } else {
            Reach reach;
            reach.link = *open.begin();
            const Link& link = m_links[size_t(reach.link)];
            reach.inboard = isKnown(link.blocks[0]) ? 0 : 1;
            root = reach.root = findRoot(link.blocks[1 - reach.inboard]);
            const Transform& X_GF = link.motions[reach.inboard]->X;
            const SpatialVec S = fromOrigin(
                calcTwist(link, 1 - reach.inboard, none) - calcTwist(link, reach.inboard, none),
                X_GF.p());
            reach.S = {~X_GF.R() * S[0], ~X_GF.R() * S[1]};
            m_reaches.push_back(reach);
        }
        isReached[size_t(root)] = 1;
        for (const int link : linksOf[size_t(root)]) look(link);
    }
}

bool SteadyMotion::findDriven(const std::vector<double>& q) const {
    std::vector<double> errors(m_errors.size(), 0), driven = m_u;
    for (size_t i = 0; i < driven.size(); ++i)
        if (!m_equations->getTopology().isPrescribed[i]) driven[i] = 0;
    m_equations->realize(m_t, q.data(), driven.data());
    m_equations->calcVelocityErrors(errors.data());
    return measure(errors) > 0;
}

void SteadyMotion::followJoints(const std::vector<double>& q) {
    const Topology& topology = m_equations->getTopology();
    const JointTerms& terms = m_equations->getJoints();
    takeTwists(q);
    m_equations->realize(m_t, q.data(), m_u.data());
    std::vector<int> order(m_roots.size(), -1);
    for (size_t k = 0; k < m_reaches.size(); ++k) order[size_t(m_reaches[k].root)] = int(k);
    const auto findOrder = [&](int block) {
        const int root = findRoot(block);
        return root < 0 ? -1 : order[size_t(root)];
    };
    // Joints of each root to earlier roots.
    std::vector<std::vector<int>> jointsOf(m_reaches.size());
    for (int j = 0; j < int(topology.joints.size()); ++j) {
        const std::vector<FrameRef>& sides = topology.joints[size_t(j)].sides;
        if (sides.size() != 2 || sides[0].block == sides[1].block) continue;
        const int last = std::max(findOrder(sides[0].block), findOrder(sides[1].block));
        if (last >= 0) jointsOf[size_t(last)].push_back(j);
    }
    for (size_t k = 0; k < m_reaches.size(); ++k) {
        const Reach& reach = m_reaches[k];
        const Link& link = m_links[size_t(reach.link)];
        const Transform& X_GF = link.motions[reach.inboard]->X;
        int numRows = 0;
        for (const int j : jointsOf[k]) numRows += topology.joints[size_t(j)].numRows();
        SpatialVec& twist = m_twists[size_t(reach.root)];
        const auto setRelative = [&](const SpatialVec& S) {
            twist = SpatialVec(Vec3(0), Vec3(0));
            twist = calcTwist(link, reach.inboard, m_twists) +
                    toOrigin({X_GF.R() * S[0], X_GF.R() * S[1]}, X_GF.p()) -
                    calcTwist(link, 1 - reach.inboard, m_twists);
        };
        const auto calcErrors = [&](const SpatialVec& S) {
            setRelative(S);
            VectorXd errors(numRows);
            int row = 0;
            for (const int j : jointsOf[k]) {
                const Topology::Joint& joint = topology.joints[size_t(j)];
                FrameMotion moving[2];
                const FrameMotion* frames[] = {&moving[0], &moving[1]};
                for (const int side : {0, 1}) {
                    moving[side] = *terms.getMotions(j)[size_t(side)];
                    const int root = findRoot(joint.sides[size_t(side)].block);
                    if (root >= 0)
                        moving[side].V += fromOrigin(m_twists[size_t(root)], moving[side].X.p());
                }
                joint.record->equations->calcErrorDots(terms.getDrive(j), frames,
                                                       errors.data() + row);
                row += joint.numRows();
            }
            return errors;
        };
        SpatialVec S = reach.S;
        if (numRows > 0) {
            const SpatialVec none(Vec3(0), Vec3(0));
            const VectorXd atNone = calcErrors(none);
            MatrixXd slopes(numRows, 6);
            for (int i = 0; i < 6; ++i) {
                SpatialVec unit = none;
                unit[i / 3][i % 3] = 1;
                slopes.col(i) = calcErrors(unit) - atNone;
            }
            const VectorXd change = solveLeastSquares(slopes, calcErrors(S), ClosureRank);
            for (int i = 0; i < 6; ++i) S[i / 3][i % 3] -= change[i];
        }
        setRelative(S);
    }
    putTwists(m_twists, q, m_u);
}

void SteadyMotion::followMotions(const std::vector<double>& q) {
    Evaluation& equations = *m_equations;
    const Topology& topology = equations.getTopology();
    // Unit motions: the twist of each link, in the order of reach, with all bodies reached through
    // it, and the speeds of trees.
    SteadyMotion unit = *this;
    unit.m_twists.assign(m_roots.size(), SpatialVec(Vec3(0), Vec3(0)));
    unit.findReaches();
    std::fill(unit.m_u.begin(), unit.m_u.end(), 0.0);
    for (Reach& reach : unit.m_reaches) reach.S = SpatialVec(Vec3(0), Vec3(0));
    std::vector<std::vector<double>> columns;
    std::vector<double> u;
    const auto add = [&](double& speed) {
        speed = 1;
        unit.calcX(q, u);
        columns.push_back(u);
        speed = 0;
    };
    for (Reach& reach : unit.m_reaches)
        for (int i = 0; i < 6; ++i) add(reach.S[i / 3][i % 3]);
    for (int b = topology.numFlexible; b < topology.numBlocks(); ++b) {
        const Block& block = equations.getBlock(b);
        for (int i = block.firstU; i < block.firstU + block.numU; ++i)
            if (findRoot(b) < 0 && !topology.isPrescribed[size_t(i)]) add(unit.m_u[size_t(i)]);
    }
    const Eigen::Index n = Eigen::Index(m_u.size()), m = Eigen::Index(m_errors.size());
    MatrixXd motions(n, Eigen::Index(columns.size()));
    for (size_t k = 0; k < columns.size(); ++k)
        motions.col(Eigen::Index(k)) = Map<const VectorXd>(columns[k].data(), n);
    std::vector<double> lambda(size_t(m), 0), uDot(size_t(n), 0), r(static_cast<size_t>(n));
    equations.realize(m_t, q.data(), m_u.data());
    equations.calcResidual(q.data(), m_u.data(), uDot.data(), lambda.data(), r.data());
    MatrixXd M, G;
    calcMassAndJacobian(equations, M, G);
    VectorXd errors(m);
    equations.calcVelocityErrors(errors.data());
    const double fastest = Map<VectorXd>(m_u.data(), n).lpNorm<Eigen::Infinity>();
    if (errors.lpNorm<Eigen::Infinity>() <= SmallError * (1 + fastest)) return;
    Map<VectorXd>(m_u.data(), n) -= motions * solveLeastSquares(G * motions, errors, ClosureRank);
}

void SteadyMotion::prepareClosing(const std::vector<double>& q) {
    Evaluation& equations = *m_equations;
    const int n = equations.getTopology().numU, m = equations.getTopology().numMultipliers;
    const CoordinateScales scales(equations.getBlocks());
    VectorXd unit = VectorXd::Zero(n), r(n);
    std::vector<double> lambda(size_t(m), 0), uDot(size_t(n), 0);
    equations.realize(m_t, q.data(), m_u.data());
    equations.calcResidual(q.data(), m_u.data(), uDot.data(), lambda.data(), r.data());
    MatrixXd M;
    calcMassAndJacobian(equations, M, m_G);
    for (int b = 0; b < equations.getTopology().numBlocks(); ++b) {
        const Block& block = equations.getBlock(b);
        if (block.calcDisplacement(m_u.data() + block.firstU) < SlowestRate) continue;
        const bool isFlexible = b < equations.getTopology().numFlexible;
        for (int i = block.firstU; i < block.firstU + (isFlexible ? 6 : block.numU); ++i)
            if (!equations.getTopology().isPrescribed[size_t(i)])
                unit[i] = 1 / scales.metres[size_t(i)];
    }
    for (const Root& root : m_roots) unit.segment<3>(root.u0 + 3) *= TurnCost;
    MatrixXd scaled = m_G * unit.asDiagonal();
    VectorXd rows = scaled.rowwise().norm();
    for (double& norm : rows) norm = norm > 0 ? 1 / norm : 0;
    scaled = rows.asDiagonal() * scaled;
    m_closing = -(unit.asDiagonal() * calcColumnSpace(scaled, ClosureRank).pseudoInverse *
                  rows.asDiagonal());
}

void SteadyMotion::closeLoops(const std::vector<double>& q, std::vector<double>& u) const {
    VectorXd errors(m_closing.cols());
    for (int k = 0; k < NumClosings; ++k) {
        m_equations->realize(m_t, q.data(), u.data());
        m_equations->calcVelocityErrors(errors.data());
        const double speed = Map<const VectorXd>(u.data(), Eigen::Index(u.size())).lpNorm<1>();
        if (errors.lpNorm<Eigen::Infinity>() <= ClosedLoop * speed) return;
        Map<VectorXd>(u.data(), Eigen::Index(u.size())) += m_closing * errors;
    }
}

void SteadyMotion::close(MatrixXd& delta) const {
    if (m_closing.size() > 0) delta += m_closing * (m_G * delta);
}

VectorXd SteadyMotion::calcDeparture(const Balance& balance) const {
    const MatrixXd &M = balance.M, &K = balance.K;
    const double inertia = square(m_factor * m_rate);
    const std::vector<int> free = listFreeSpeeds(*m_equations);
    MatrixXd directions = MatrixXd::Zero(M.rows(), Eigen::Index(free.size()));
    for (size_t k = 0; k < free.size(); ++k)
        directions(free[k], Eigen::Index(k)) =
            1 / std::sqrt(std::abs(K(free[k], free[k])) + inertia * M(free[k], free[k]));
    const MatrixXd Z = directions * TangentSpace(balance.G * directions).getBasis();
    if (Z.cols() == 0) return VectorXd::Zero(M.rows());
    // Springs and inertia resist, even where the motion makes a stiffness negative.
    const MatrixXd reduced = calcCongruent(Z, K);
    const SymmetricEigen modes =
        calcSymmetricEigen(0.5 * (reduced + reduced.transpose()), calcCongruent(Z, M));
    VectorXd y = modes.vectors.transpose() * (Z.transpose() * (M * balance.moreUDot));
    for (Eigen::Index k = 0; k < y.size(); ++k) y[k] /= std::abs(modes.values[k]) + inertia;
    return Z * (modes.vectors * y);
}

std::string SteadyMotion::describeDeparture(const CoordinateScales& scales, const VectorXd& delta,
                                            double allowed) const {
    for (int b = 0; b < m_equations->getTopology().numBlocks(); ++b) {
        const Block& block = m_equations->getBlock(b);
        const double departure = block.calcDisplacement(delta.data() + block.firstU);
        if (departure <= allowed * scales.lengths[size_t(b)]) continue;
        std::ostringstream text;
        text << "forces that do not turn with it lead '" << block.name << "' " << departure
             << " m away; begin at rest, or at a steady motion near by (start: steady, or "
                "StaticEquilibrium::solveSteadyMotion())";
        return text.str();
    }
    return "";
}

SteadyMotion::Twists SteadyMotion::calcX(const std::vector<double>& q,
                                         std::vector<double>& u) const {
    u = m_u;
    Twists twists = m_twists;
    if (!m_reaches.empty()) m_equations->realize(m_t, q.data(), u.data());
    for (const Reach& reach : m_reaches) {
        const Link& link = m_links[size_t(reach.link)];
        const Transform& X_GF = link.motions[reach.inboard]->X;
        const SpatialVec S(X_GF.R() * reach.S[0], X_GF.R() * reach.S[1]);
        SpatialVec& twist = twists[size_t(reach.root)];
        twist = SpatialVec(Vec3(0), Vec3(0));
        twist = calcTwist(link, reach.inboard, twists) + toOrigin(S, X_GF.p()) -
                calcTwist(link, 1 - reach.inboard, twists);
    }
    putTwists(twists, q, u);
    if (m_closing.size() > 0) {
        closeLoops(q, u);
        twists = calcTwists(q, u);
    }
    return twists;
}

void SteadyMotion::addBesides(const std::vector<double>& q, const std::vector<double>& u,
                              const std::vector<double>& uDot) {
    const Eigen::Index n = Eigen::Index(u.size());
    m_qBesides.clear();
    std::vector<double> ownU(u.size()), ownUDot(u.size());
    calcSpeeds(q, ownU, ownUDot);
    m_qBesides = q;
    m_uBesides = Map<const VectorXd>(u.data(), n) - Map<const VectorXd>(ownU.data(), n);
    m_uDotBesides = Map<const VectorXd>(uDot.data(), n) - Map<const VectorXd>(ownUDot.data(), n);
}

void SteadyMotion::calcSpeeds(const std::vector<double>& q, std::vector<double>& u,
                              std::vector<double>& uDot) const {
    std::fill(u.begin(), u.end(), 0.0);
    std::fill(uDot.begin(), uDot.end(), 0.0);
    if (!isAtRest()) calcOwnSpeeds(q, u, uDot);
    if (m_qBesides.empty()) return;
    const Evaluation& equations = *m_equations;
    for (const auto& [total, more] :
         {std::pair(&u, &m_uBesides), std::pair(&uDot, &m_uDotBesides)}) {
        for (size_t i = 0; i < u.size(); ++i) (*total)[i] += (*more)[Eigen::Index(i)];
        for (int b = 0; b < equations.getTopology().numFlexible; ++b) {
            const size_t q0 = size_t(equations.getBlock(b).firstQ),
                         u0 = size_t(equations.getBlock(b).firstU);
            const Vec3 fixed = Vec3::getAs(more->data() + u0);
            if (fixed == Vec3(0)) continue;
            const Rotation turn = ~rotationOf(&q[q0]) * rotationOf(&m_qBesides[q0]);
            Vec3::updAs(total->data() + u0) += turn * fixed - fixed;
        }
    }
}

void SteadyMotion::calcOwnSpeeds(const std::vector<double>& q, std::vector<double>& u,
                                 std::vector<double>& uDot) const {
    const Twists twists = calcX(q, u);
    Twists rates(m_roots.size(), SpatialVec(Vec3(0), Vec3(0)));
    // A straight path along X suffices: its error is even in time, and differences cancel it.
    const double duration = TurnStep / m_rate;
    const auto addDifference = [&](int place, double weight) {
        std::vector<double> speeds[2];
        Twists ends[2];
        for (const int side : {0, 1}) {
            if (m_equations->getTopology().needsSimbody)
                m_equations->realize(m_t, q.data(), u.data());
            std::vector<double> delta = u, moved = q;
            for (double& part : delta) part *= (side == 0 ? -place : place) * duration;
            m_equations->getBlocks().moveQ(delta.data(), moved.data());
            ends[side] = calcX(moved, speeds[side]);
        }
        for (size_t i = 0; i < u.size(); ++i)
            uDot[i] += weight / duration * (speeds[1][i] - speeds[0][i]);
        for (size_t r = 0; r < rates.size(); ++r)
            rates[r] += weight / duration * (ends[1][r] - ends[0][r]);
    };
    if (!m_hasConstantTwists) {
        addDifference(1, 8.0 / 12);
        addDifference(2, -1.0 / 12);
    }
    // Accelerations of roots follow from the twists, which are often constant.
    for (size_t r = 0; r < m_roots.size(); ++r) {
        const Root& root = m_roots[r];
        const Vec3 p = calcPlace(root, q), alpha = rates[r][0];
        const Vec3 a = rates[r][1] + alpha % p + twists[r][0] % fromOrigin(twists[r], p)[1];
        Vec3::updAs(uDot.data() + root.u0) = ~calcAxes(root, q) * alpha;
        Vec3::updAs(uDot.data() + root.u0 + 3) = ~root.X_GF.R() * a;
    }
    for (double& rate : uDot) rate *= square(m_factor);
    for (double& speed : u) speed *= m_factor;
}

std::vector<double> SteadyMotion::flow(const std::vector<double>& q, double duration) const {
    std::vector<double> delta(m_u.size(), 0), piece(m_u.size());
    const auto move = [&] {
        std::vector<double> moved = q;
        for (size_t i = 0; i < delta.size(); ++i) piece[i] = delta[i] / NumFlowPieces;
        for (int k = 0; k < NumFlowPieces; ++k) {
            if (m_equations->getTopology().needsSimbody)
                m_equations->realize(m_t, moved.data(), m_u.data());
            m_equations->getBlocks().moveQ(piece.data(), moved.data());
        }
        m_equations->getBlocks().normalizeQ(moved.data());
        return moved;
    };
    // Bodies move relative to their roots first, then with them.
    for (size_t i = 0; i < delta.size(); ++i) delta[i] = duration * m_u[i];
    const std::vector<double> inner = move();
    std::vector<Transform> before(2 * m_reaches.size());
    const auto pose = [&](const Reach& reach, int side) -> const Transform& {
        return m_links[size_t(reach.link)]
            .motions[side == 0 ? reach.inboard : 1 - reach.inboard]
            ->X;
    };
    m_equations->realize(m_t, q.data(), m_u.data());
    for (size_t k = 0; k < before.size(); ++k) before[k] = pose(m_reaches[k / 2], int(k % 2));
    m_equations->realize(m_t, inner.data(), m_u.data());
    std::vector<Transform> moves;
    for (const SpatialVec& twist : m_twists) moves.push_back(calcExponential(twist, duration));
    for (size_t k = 0; k < m_reaches.size(); ++k) {
        const Reach& reach = m_reaches[k];
        const int inboard = findRoot(m_links[size_t(reach.link)].blocks[reach.inboard]);
        const Transform X_GF =
            (inboard < 0 ? Transform() : moves[size_t(inboard)]) * pose(reach, 0);
        const Transform X_FM =
            calcExponential(reach.S, duration) * ~before[2 * k] * before[2 * k + 1];
        moves[size_t(reach.root)] = X_GF * X_FM * ~pose(reach, 1);
    }
    for (size_t r = 0; r < m_roots.size(); ++r) {
        const Root& root = m_roots[r];
        const Vec3 p = calcPlace(root, q);
        Vec3::updAs(delta.data() + root.u0) = ~calcAxes(root, q) * calcTurn(moves[r].R());
        Vec3::updAs(delta.data() + root.u0 + 3) = ~root.X_GF.R() * (moves[r] * p - p);
    }
    return move();
}

bool SteadyMotion::isTimed(const SolutionPoint& point) const {
    Evaluation& equations = *m_equations;
    for (int i = 0; i < equations.getTopology().numU; ++i)
        if (equations.getTopology().isPrescribed[size_t(i)] && point.u[size_t(i)] != 0) return true;
    const std::vector<double> none(point.u.size(), 0);
    std::vector<double> errors(point.lambda.size(), 0);
    equations.realize(point.t, point.q.data(), none.data());
    equations.calcVelocityErrors(errors.data());
    return measure(errors) > 0;
}

void SteadyMotion::moveOn(SolutionPoint& point) const {
    const double duration = 1 / m_rate;
    if (isTimed(point)) point.t += duration;
    point.q = flow(point.q, duration);
    SteadyMotion own = *this;
    own.m_qBesides.clear();
    own.calcSpeeds(point.q, point.u, point.uDot);
    m_equations->prescribe(point.t, 0, nullptr, point.q.data(), point.u.data());
    m_equations->realize(point.t, point.q.data(), point.u.data());
}

MatrixXd SteadyMotion::carry(const std::vector<double>& q, double duration,
                             const std::vector<double>& laterQ, const MatrixXd& delta,
                             const VectorXd& steps) const {
    Evaluation& equations = *m_equations;
    const Topology& topology = equations.getTopology();
    const auto carryPart = [&](Eigen::Index column, double h) {
        std::vector<double> moved = q;
        const VectorXd part = h * delta.col(column);
        if (topology.needsSimbody) equations.realize(m_t, q.data(), m_u.data());
        equations.getBlocks().moveQ(part.data(), moved.data());
        moved = flow(moved, duration);
        for (int b = 0; b < topology.numBlocks(); ++b) {
            const Block& block = equations.getBlock(b);
            block.alignQ(&laterQ[size_t(block.firstQ)], &moved[size_t(block.firstQ)]);
        }
        return VectorXd(Map<const VectorXd>(moved.data(), topology.numQ));
    };
    MatrixXd changes(topology.numQ, delta.cols());
    for (Eigen::Index j = 0; j < delta.cols(); ++j)
        changes.col(j) = (carryPart(j, steps[j]) - carryPart(j, -steps[j])) / (2 * steps[j]);
    // Converts these rates to speeds, block by block, since N is block-diagonal.
    std::vector<double> unit(m_u.size(), 0), qDot(q.size());
    equations.realize(m_t, laterQ.data(), unit.data());
    std::vector<MatrixXd> N;
    int largest = 0;
    for (int b = 0; b < topology.numBlocks(); ++b) {
        const Block& block = equations.getBlock(b);
        N.push_back(MatrixXd::Zero(block.numQ, block.numU));
        largest = std::max(largest, block.numU);
    }
    for (int i = 0; i < largest; ++i) {
        for (int b = 0; b < topology.numBlocks(); ++b) {
            const Block& block = equations.getBlock(b);
            if (i > 0 && i <= block.numU) unit[size_t(block.firstU + i - 1)] = 0;
            if (i < block.numU) unit[size_t(block.firstU + i)] = 1;
        }
        equations.getBlocks().calcQDot(laterQ.data(), unit.data(), qDot.data());
        for (int b = 0; b < topology.numBlocks(); ++b) {
            const Block& block = equations.getBlock(b);
            if (i < block.numU)
                N[size_t(b)].col(i) = Map<const VectorXd>(&qDot[size_t(block.firstQ)], block.numQ);
        }
    }
    MatrixXd carried(Eigen::Index(m_u.size()), delta.cols());
    parallelFor(topology.numBlocks(), equations.getBlocks().numThreads, [&](int b) {
        const Block& block = equations.getBlock(b);
        carried.middleRows(block.firstU, block.numU) =
            solveLeastSquares(N[size_t(b)], changes.middleRows(block.firstQ, block.numQ));
    });
    return carried;
}

}  // namespace simflex
