#include "simflex/solver/equations/FlexibleBlock.h"

#include <algorithm>
#include <cstdio>

#include "simflex/base/Dot.h"
#include "simflex/solver/equations/FunctionsOfTime.h"

namespace simflex {

using namespace SimTK;
using Eigen::Map;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::Vector4d;
using Eigen::VectorXd;

namespace {

/** Products of one block of a batch, kept per thread from call to call, so that nothing is
allocated and they stay in cache. **/
FlexibleBodyData& updProducts(int place, const FlexibleBodyModel& model) {
    thread_local FlexibleBodyData products[FlexibleBlock::LargestBatch];
    products[place].fit(model);
    return products[place];
}

}  // namespace

FlexibleBlock::FlexibleBlock(const FlexibleBodySubsystem::Guts& guts, FlexibleBodyIndex index,
                             const State& state, Modes modes)
    : m_guts(guts),
      m_record(guts.body(index)),
      m_model(modes == Modes::All ? guts.getModel(state, m_record) : *m_record.rigid),
      m_n(m_model.n) {
    name = m_record.name;
    numQ = 7 + m_n;
    numU = 6 + m_n;
    m_held.assign(size_t(m_record.numModes() - m_n), 0);
    m_constants = std::make_shared<Constants>(
        Constants{m_record.damping.head(m_n), m_model.omegaSquared.cwiseSqrt().cwiseInverse()});
    m_hasDampingCoupling = m_n > 0 && m_record.dampingCoupling.size() > 0;
    m_I.setZero();
    m_IDot.setZero();
    m_CXiDot.setZero();
    m_xi.setZero(m_n);
    m_NXi.setZero(m_model.NTiles.paddedRows());
    if (!m_record.loads.empty()) m_loads.setZero(m_record.numModes());
    m_shapesXi.setZero(m_model.shapeTiles.paddedRows());
    m_shapesXiDot.setZero(m_model.shapeTiles.paddedRows());
    m_shapesXiDotDot.setZero(m_model.shapeTiles.paddedRows());

    const SimbodyMatterSubsystem& matter = guts.getMatter();
    m_stateFrameU = int(matter.getMobilizedBody(m_record.frame).getFirstUIndex(state));
    for (MobilizedBodyIndex carrier : m_record.carriers) {
        const MobilizedBody& mobod = matter.getMobilizedBody(carrier);
        for (int k = 0; k < mobod.getNumU(state); ++k) {
            m_stateQ.push_back(int(mobod.getFirstQIndex(state)) + k);
            m_stateU.push_back(int(mobod.getFirstUIndex(state)) + k);
        }
    }
}

void FlexibleBlock::shareConstants(const FlexibleBlock& other) {
    if (&m_model == &other.m_model && getDamping() == other.getDamping())
        m_constants = other.m_constants;
}

int FlexibleBlock::addFrame(const FlexibleFrame& frame) {
    const auto& known = m_record.model->interfaceShapes;
    const auto found = std::find(known.begin(), known.end(), frame.shapes);
    const int interface = found == known.end() ? -1 : int(found - known.begin());
    m_frames.push_back(frame);
    if (hasHeldModes())
        m_frames.back().shapes = interface < 0 ? FrameShapes::make(frame.shapes->s, {}, {})
                                               : m_model.interfaceShapes[size_t(interface)];
    m_interfaces.push_back(interface);
    m_curveOf.push_back(-1);
    m_poses.emplace_back();
    if (m_model.isStiffened && !frame.shapes->curvature.empty()) {
        size_t curve = 0;
        while (curve < m_curves.size() && m_curves[curve].shapes != frame.shapes) ++curve;
        if (curve == m_curves.size()) {
            auto tangent = std::make_shared<FrameShapes>();
            tangent->s = frame.shapes->s;
            tangent->columns = frame.shapes->columns;
            m_curves.push_back({frame.shapes, tangent, {}});
        }
        m_curveOf.back() = int(curve);
        m_interfaces.back() = -1;
        m_frames.back().shapes = m_curves[curve].tangent;
    }
    frames.emplace_back();
    return int(frames.size()) - 1;
}

void FlexibleBlock::realize(const EvaluationContext&, const double* q, const double* u) {
    m_body.R_GB = rotationOf(q);
    m_body.p_GB = Vec3(q[4], q[5], q[6]);
    m_body.omega_B = Vec3(u[0], u[1], u[2]);
    m_body.v_G = Vec3(u[3], u[4], u[5]);
    for (Curve& curve : m_curves)
        curve.atXi = calcTangentShapes(*curve.shapes, q + 7, *curve.tangent);
    for (size_t k = 0; k < m_frames.size(); ++k) {
        const int curve = m_curveOf[k];
        m_poses[k] = calcFramePose(m_frames[k], curve < 0 ? calcFrameSums(int(k), m_shapesXi, q + 7)
                                                          : m_curves[size_t(curve)].atXi);
        const FrameMotion motion =
            calcFrameMotion(m_poses[k], m_body, calcFrameSums(int(k), m_shapesXiDot, u + 6));
        frames[k].X = motion.X;  // accelerations are computed elsewhere
        frames[k].V = motion.V;
    }
}

FrameSums FlexibleBlock::calcFrameSums(int frame, const VectorXd& products,
                                       const double* coordinates) const {
    const int interface = m_interfaces[size_t(frame)];
    if (interface < 0) return multiplyShapes(*m_frames[size_t(frame)].shapes, coordinates);
    const double* sums = products.data() + 6 * interface;
    return {Vec3(sums[0], sums[1], sums[2]), Vec3(sums[3], sums[4], sums[5])};
}

void FlexibleBlock::calcShapeProducts(const std::vector<FlexibleBlock*>& blocks, const double* q,
                                      const double* u) {
    if (blocks.empty()) return;
    const double* factors[2 * LargestBatch];
    double* products[2 * LargestBatch];
    const int count = int(blocks.size());
    for (int k = 0; k < count; ++k) {
        FlexibleBlock& block = *blocks[size_t(k)];
        factors[k] = q + block.firstQ + 7;
        factors[count + k] = u + block.firstU + 6;
        products[k] = block.m_shapesXi.data();
        products[count + k] = block.m_shapesXiDot.data();
    }
    blocks.front()->m_model.shapeTiles.multiply(2 * count, factors, products);
}

void FlexibleBlock::calcAccelerationProducts(const std::vector<FlexibleBlock*>& blocks,
                                             const double* uDot) {
    if (blocks.empty()) return;
    const double* factors[LargestBatch];
    double* products[LargestBatch];
    for (size_t k = 0; k < blocks.size(); ++k) {
        factors[k] = uDot + blocks[k]->firstU + 6;
        products[k] = blocks[k]->m_shapesXiDotDot.data();
    }
    blocks.front()->m_model.shapeTiles.multiply(int(blocks.size()), factors, products);
}

void FlexibleBlock::calcResiduals(const std::vector<FlexibleBlock*>& blocks,
                                  const EvaluationContext& context, const double* q,
                                  const double* u, const double* uDot, double* r) {
    if (blocks.empty()) return;
    const FlexibleBodyModel& model = blocks.front()->m_model;
    const double *xi[LargestBatch], *xiDot[LargestBatch];
    FlexibleBodyData* data[LargestBatch];
    for (size_t k = 0; k < blocks.size(); ++k) {
        xi[k] = q + blocks[k]->firstQ + 7;
        xiDot[k] = u + blocks[k]->firstU + 6;
        data[k] = &updProducts(int(k), model);
    }
    calcProducts(model, int(blocks.size()), xi, xiDot, data);
    for (size_t k = 0; k < blocks.size(); ++k) {
        FlexibleBlock& block = *blocks[k];
        block.calcResidual(context, *data[k], q + block.firstQ, u + block.firstU,
                           uDot + block.firstU, r + block.firstU);
    }
}

void FlexibleBlock::calcResidual(const EvaluationContext& context, const double* q, const double* u,
                                 const double* uDot, double* r) {
    const double *xi = q + 7, *xiDot = u + 6;
    FlexibleBodyData* data = &updProducts(0, m_model);
    calcProducts(m_model, 1, &xi, &xiDot, &data);
    calcResidual(context, *data, q, u, uDot, r);
}

void FlexibleBlock::calcResidual(const EvaluationContext& context, FlexibleBodyData& data,
                                 const double* q, const double* u, const double* uDot, double* r) {
    Vector3d rotation;
    calcBodyResidual(m_model, data, toEigen(m_body.omega_B), Map<const Vector3d>(uDot), q + 7,
                     u + 6, uDot + 6, getDamping(), rotation, r + 6);
    m_I = data.I;
    m_IDot = data.IDot;
    m_CXiDot = data.CXiDot;
    std::copy_n(q + 7, m_n, m_xi.data());
    m_hasNXi = false;
    Map<Vector3d>(r, 3) = rotation;
    if (m_hasDampingCoupling)
        for (int i = 0; i < m_n; ++i)
            r[6 + i] += dot(m_record.dampingCoupling.col(i).data(), u + 6, m_n);
    // ∑mφ = 0: uniform gravity acts at the frame's origin and on no mode.
    const Vec3& gravity = context.gravity->atBody[m_record.frame];
    for (int a = 0; a < 3; ++a) r[3 + a] = m_model.mass * (uDot[3 + a] - gravity[a]);
    if (hasLoads()) subtractLoads(context, q, r);
}

const double* FlexibleBlock::findNXi() {
    if (!m_hasNXi) {
        const double* xi = m_xi.data();
        double* NXi = m_NXi.data();
        m_model.NTiles.multiply(1, &xi, &NXi);
        m_hasNXi = true;
    }
    return m_NXi.data();
}

void FlexibleBlock::subtractLoads(const EvaluationContext& context, const double* q, double* r) {
    Vec3 torque_B(0), force_G(0);
    m_loads.setZero();
    addInLoads(m_record.loads, &context.timeValues->scales[m_firstScale], m_body.R_GB, findXi(q),
               torque_B, force_G, m_loads.data());
    for (int a = 0; a < 3; ++a) {
        r[a] -= context.loadFraction * torque_B[a];
        r[3 + a] -= context.loadFraction * force_G[a];
    }
    for (int i = 0; i < m_n; ++i) r[6 + i] -= context.loadFraction * m_loads[i];
}

void FlexibleBlock::subtractForce(int frame, const SpatialVec& F_G, double* r) const {
    addInRow(frame, -F_G, r);
}

void FlexibleBlock::subtractSimbodyForces(const Vector_<SpatialVec>& bodyForces,
                                          const Vector& mobilityForces, double* r) {
    const SpatialVec& force = bodyForces[m_record.frame];
    Vec3 torque_G = force[0], force_G = force[1];
    for (int a = 0; a < 3; ++a) {
        torque_G[a] += mobilityForces[m_stateFrameU + a];
        force_G[a] += mobilityForces[m_stateFrameU + 3 + a];
    }
    const Vec3 torque_B = ~m_body.R_GB * torque_G;
    for (int a = 0; a < 3; ++a) {
        r[a] -= torque_B[a];
        r[3 + a] -= force_G[a];
    }
    for (int i = 0; i < m_n; ++i) r[6 + i] -= mobilityForces[m_stateU[i]];
}

void FlexibleBlock::addInRow(int frame, const SpatialVec& d, double* row) const {
    addInConstraintRow(m_frames[frame], m_poses[frame], m_body.R_GB, d, row);
}

SpatialVec FlexibleBlock::calcFrameAcceleration(int frame, const double* u,
                                                const double* uDot) const {
    FrameSums atXiDotDot = calcFrameSums(frame, m_shapesXiDotDot, uDot + 6);
    if (m_curveOf[size_t(frame)] >= 0) {
        const FrameSums more =
            calcCurvatureSums(*m_curves[size_t(m_curveOf[size_t(frame)])].shapes, u + 6);
        atXiDotDot.translation += more.translation;
        atXiDotDot.rotation += more.rotation;
    }
    return simflex::calcFrameAcceleration(
        m_poses[frame], m_body, calcFrameSums(frame, m_shapesXiDot, u + 6),
        Vec3(uDot[0], uDot[1], uDot[2]), Vec3(uDot[3], uDot[4], uDot[5]), atXiDotDot);
}

void FlexibleBlock::calcColumn(int frame, const SpatialVec& d, double* rigid,
                               double* coefficients) const {
    calcFrameForce(m_poses[frame], m_body.R_GB, d, Vec3::updAs(rigid), Vec3::updAs(rigid + 3),
                   Vec3::updAs(coefficients), Vec3::updAs(coefficients + 3));
}

void FlexibleBlock::calcDiagonal(const NewtonFactors& factors, double* diagonal) const {
    Map<VectorXd> d(diagonal, m_n);
    d = getDamping() + factors.stiffness * m_model.omegaSquared;
    d.array() += 1 / factors.mass;
}

void FlexibleBlock::formArrow(double mass, NewtonSystem::Block& block) {
    block.form = NewtonSystem::Block::Form::Arrow;
    Map<Eigen::Matrix<double, 6, 6>> head(block.head.data());
    head.setZero();
    head.topLeftCorner<3, 3>() = m_I / mass;
    head.diagonal().tail<3>().setConstant(m_model.mass / mass);
    const double *NXi = findNXi(), factor = -1 / mass;
    double* coupling = block.coupling.data();
    for (int i = 0; i < 3 * m_n; ++i) coupling[i] = factor * NXi[i];  // Cᵀ = −Nξ
}

void FlexibleBlock::formNewtonBlock(const NewtonFactors& factors, BlockDerivatives derivatives,
                                    const EvaluationContext&, const double* q, const double* u,
                                    const double* uDot, NewtonSystem::Block& block) {
    if (derivatives != BlockDerivatives::Constant) {
        const double *xi = q + 7, *xiDot = u + 6;
        FlexibleBodyData* data = &updProducts(0, m_model);
        calcProducts(m_model, 1, &xi, &xiDot, &data);
        data->I = m_I;
        data->IDot = m_IDot;
        data->CXiDot = m_CXiDot;
        block.form = NewtonSystem::Block::Form::General;
        block.matrix.resize(size_t(numU) * size_t(numU));
        calcNewtonMatrix(m_model, *data, factors.mass, factors.stiffness, toEigen(m_body.omega_B),
                         Map<const Vector3d>(uDot), ConstModes(u + 6, m_n),
                         ConstModes(uDot + 6, m_n), getDamping(),
                         Map<MatrixXd>(block.matrix.data(), numU, numU));
        if (m_hasDampingCoupling)
            Map<MatrixXd>(block.matrix.data(), numU, numU).bottomRightCorner(m_n, m_n) +=
                m_record.dampingCoupling;
        return;
    }
    if (block.part >= 0) return formArrow(factors.mass, block);
    formFullArrow(factors.mass, block);
    Map<MatrixXd>(block.matrix.data(), numU, numU).diagonal().tail(m_n) =
        (getDamping() + factors.stiffness * m_model.omegaSquared).array() + 1 / factors.mass;
}

void FlexibleBlock::formMassBlock(NewtonSystem::Block& block) {
    if (block.part >= 0) return formArrow(1, block);
    formFullArrow(1, block);
    Map<MatrixXd>(block.matrix.data(), numU, numU).diagonal().tail(m_n).setOnes();
}

void FlexibleBlock::formFullArrow(double mass, NewtonSystem::Block& block) {
    block.form = NewtonSystem::Block::Form::Symmetric;
    block.matrix.assign(size_t(numU) * size_t(numU), 0);
    Map<MatrixXd> J(block.matrix.data(), numU, numU);
    J.topLeftCorner<3, 3>() = m_I / mass;
    J.diagonal().segment<3>(3).setConstant(m_model.mass / mass);
    J.topRightCorner(3, m_n) = findCTransposed().transpose() / mass;
    J.bottomLeftCorner(m_n, 3) = findCTransposed() / mass;
}

void FlexibleBlock::addInCouplingForces(const double* uDot, Vector_<SpatialVec>& bodyForces,
                                        Vector& mobilityForces) {
    const Map<const Vector3d> omegaDot(uDot);
    const Vector3d rotation = (m_I - m_model.inertia) * omegaDot +
                              findCTransposed().transpose() * ConstModes(uDot + 6, m_n);
    bodyForces[m_record.frame][0] -= m_body.R_GB * toSimTK(rotation);
    const VectorXd modes = findCTransposed() * omegaDot;
    for (int i = 0; i < m_n; ++i) mobilityForces[m_stateU[size_t(i)]] -= modes[i];
}

void FlexibleBlock::integrateQ(const EvaluationContext&, const double* qHist, double gamma,
                               const double* u, double* q) const {
    Map<Vector4d>(q, 4) =
        integrateQuaternion(Map<const Vector4d>(qHist), gamma, Map<const Vector3d>(u), true);
    Map<VectorXd>(q + 4, 3 + m_n) =
        ConstModes(qHist + 4, 3 + m_n) + gamma * ConstModes(u + 3, 3 + m_n);
}

void FlexibleBlock::calcQDot(const EvaluationContext&, const double* q, const double* u,
                             double* qDot) const {
    Map<Vector4d>(qDot, 4) =
        0.5 * multiplyQuaternion(Map<const Vector4d>(q), Map<const Vector3d>(u), true);
    std::copy_n(u + 3, 3 + m_n, qDot + 4);
}

void FlexibleBlock::displaceQ(const EvaluationContext&, const double* delta, double* q) const {
    Map<Vector4d> quaternion(q);
    quaternion = displaceQuaternion(quaternion, Map<const Vector3d>(delta), true);
    Map<VectorXd>(q + 4, 3 + m_n) += ConstModes(delta + 3, 3 + m_n);
}

void FlexibleBlock::normalizeQ(double* q) const {
    Map<Vector4d>(q, 4).normalize();
}

void FlexibleBlock::alignQ(const double* reference, double* q) const {
    alignQuaternion(reference, q);
}

double FlexibleBlock::calcModalDisplacement(const double* modes) const {
    return ConstModes(modes, m_n).cwiseProduct(m_model.displacementPerMode).norm();
}

double FlexibleBlock::calcDisplacement(const double* delta) const {
    return std::hypot(m_model.radius * Map<const Vector3d>(delta).norm(),
                      Map<const Vector3d>(delta + 3).norm(), calcModalDisplacement(delta + 6));
}

void FlexibleBlock::getDisplacements(double* ofSpeeds) const {
    std::fill_n(ofSpeeds, 3, m_model.radius);
    std::fill_n(ofSpeeds + 3, 3, 1.0);
    std::copy_n(m_model.displacementPerMode.data(), m_n, ofSpeeds + 6);
}

double FlexibleBlock::calcQDisplacement(const double* deltaQ) const {
    return std::hypot(m_model.radius * 2 * Map<const Vector4d>(deltaQ).norm(),
                      Map<const Vector3d>(deltaQ + 4).norm(), calcModalDisplacement(deltaQ + 7));
}

double FlexibleBlock::calcUDisplacement(const double* deltaU, double h) const {
    double modal = 0;
    for (int i = 0; i < m_n; ++i) {
        const double displacement = deltaU[6 + i] * m_model.displacementPerMode[i] *
                                    std::min(h, m_constants->inverseOmega[i]);
        modal += displacement * displacement;
    }
    return std::hypot(h * m_model.radius * Map<const Vector3d>(deltaU).norm(),
                      h * Map<const Vector3d>(deltaU + 3).norm(), std::sqrt(modal));
}

double FlexibleBlock::calcDampingPower(const double* u) const {
    const ConstModes xiDot(u + 6, m_n);
    double power = -xiDot.dot(getDamping().cwiseProduct(xiDot));
    if (m_hasDampingCoupling) power -= xiDot.dot(m_record.dampingCoupling * xiDot);
    return power;
}

double FlexibleBlock::calcLoadPower(const EvaluationContext& context, const double* q,
                                    const double* u) {
    if (m_record.loads.empty()) return 0;
    Vec3 torque_B(0), force_G(0);
    m_loads.setZero();
    addInLoads(m_record.loads, &context.timeValues->scales[m_firstScale], m_body.R_GB, findXi(q),
               torque_B, force_G, m_loads.data());
    double power = ~torque_B * m_body.omega_B + ~force_G * m_body.v_G;
    for (int i = 0; i < m_n; ++i) power += m_loads[i] * u[6 + i];
    return power;
}

void FlexibleBlock::getFromState(const State& state, double* q, double* u) const {
    const BodyFrame frame = m_guts.getBodyFrame(state, m_record);
    const Quaternion quaternion = frame.R_GB.convertRotationToQuaternion();
    for (int a = 0; a < 4; ++a) q[a] = quaternion[a];
    for (int a = 0; a < 3; ++a) {
        q[4 + a] = frame.p_GB[a];
        u[a] = frame.omega_B[a];
        u[3 + a] = frame.v_G[a];
    }
    for (int i = 0; i < m_n; ++i) {
        q[7 + i] = state.getQ()[m_stateQ[i]];
        u[6 + i] = state.getU()[m_stateU[i]];
    }
}

void FlexibleBlock::putIntoState(const double* q, const double* u, State& state) const {
    const MobilizedBody& frame = m_guts.getMatter().getMobilizedBody(m_record.frame);
    const Rotation R_GB = rotationOf(q);
    frame.setQToFitTransform(state, Transform(R_GB, Vec3(q[4], q[5], q[6])));
    frame.setUToFitVelocity(state,
                            SpatialVec(R_GB * Vec3(u[0], u[1], u[2]), Vec3(u[3], u[4], u[5])));
    Real *const stateQ = &state.updQ()[0], *const stateU = &state.updU()[0];
    for (int i = 0; i < m_n; ++i) {
        stateQ[m_stateQ[i]] = q[7 + i];
        stateU[m_stateU[i]] = u[6 + i];
    }
    for (size_t i = 0; i < m_held.size(); ++i) stateQ[m_stateQ[i]] = stateU[m_stateU[i]] = 0;
}

void FlexibleBlock::putUDot(const double* q, const double* uDot, Vector& simbodyUDot) const {
    const Vec3 omegaDot_G = rotationOf(q) * Vec3(uDot[0], uDot[1], uDot[2]);
    for (int a = 0; a < 3; ++a) {
        simbodyUDot[m_stateFrameU + a] = omegaDot_G[a];
        simbodyUDot[m_stateFrameU + 3 + a] = uDot[3 + a];
    }
    for (int i = 0; i < m_n; ++i) simbodyUDot[m_stateU[i]] = uDot[6 + i];
}

std::string FlexibleBlock::describeSpeed(int speed) const {
    if (speed < 6) return (speed < 3 ? "rotation of '" : "translation of '") + name + "'";
    char text[64];
    std::snprintf(text, sizeof text, "mode %d (%.4g Hz) of '", speed - 5,
                  1 / (2 * SimTK::Pi * m_constants->inverseOmega[speed - 6]));
    return text + name + "'";
}

std::string FlexibleBlock::describeCoordinate(int coordinate) const {
    return describeSpeed(coordinate < 4 ? 0 : coordinate - 1);
}

}  // namespace simflex
