#include "simflex/body/InterfaceKinematics.h"

#include <algorithm>
#include <cmath>

#include "simflex/base/Chunk.h"
#include "simflex/base/Dot.h"

namespace simflex {

using SimTK::Mat33;
using SimTK::Real;
using SimTK::Rotation;
using SimTK::SpatialVec;
using SimTK::Vec3;

namespace {

/** A 3×3 matrix by columns, in registers. Sums in the same order as SimTK, but many times as
fast. **/
class Columns {
public:
    explicit Columns(const Mat33& matrix) {
        for (int j = 0; j < 3; ++j) m_columns[j] = load(matrix.col(j));
    }
    Columns operator+(const Columns& other) const {
        return {m_columns[0] + other.m_columns[0], m_columns[1] + other.m_columns[1],
                m_columns[2] + other.m_columns[2]};
    }
    Columns operator*(double factor) const {
        return {m_columns[0] * factor, m_columns[1] * factor, m_columns[2] * factor};
    }
    Columns operator*(const Columns& other) const {
        return {multiply(other.m_columns[0]), multiply(other.m_columns[1]),
                multiply(other.m_columns[2])};
    }
    Vec3 operator*(const Vec3& vector) const {
        const Column product = multiply(load(vector));
        return Vec3(product[0], product[1], product[2]);
    }
    Mat33 toMat33() const {
        const Column *a = m_columns, *b = a + 1, *c = a + 2;
        return Mat33((*a)[0], (*b)[0], (*c)[0], (*a)[1], (*b)[1], (*c)[1], (*a)[2], (*b)[2],
                     (*c)[2]);
    }

private:
    using Column = double __attribute__((vector_size(32)));

    Columns(const Column& a, const Column& b, const Column& c) : m_columns{a, b, c} {}
    static Column load(const Vec3& values) { return Column{values[0], values[1], values[2], 0}; }
    Column multiply(const Column& x) const {
        return m_columns[0] * x[0] + m_columns[1] * x[1] + m_columns[2] * x[2];
    }

    Column m_columns[3];
};

/** Coefficients of the exponential and its Jacobian at angle t = |θ|, and their derivatives divided
by t. **/
struct Coefficients {
    Real a;       ///< sin t / t
    Real b;       ///< (1 − cos t)/t²
    Real c;       ///< (t − sin t)/t³
    Real bSlope;  ///< b'(t)/t
    Real cSlope;  ///< c'(t)/t
};

Coefficients calcCoefficients(Real squared) {
    // The closed forms cancel near zero; use series accurate to round-off.
    if (squared < 1e-4) {
        const Real x = squared;
        return {1 + x * (-1. / 6 + x * (1. / 120 - x * (1. / 5040))),
                1. / 2 + x * (-1. / 24 + x * (1. / 720 - x * (1. / 40320))),
                1. / 6 + x * (-1. / 120 + x * (1. / 5040 - x * (1. / 362880))),
                -1. / 12 + x * (1. / 180 - x * (1. / 6720)),
                -1. / 60 + x * (1. / 1260 - x * (1. / 60480))};
    }
    if (squared < 1) {
        Coefficients k{0, 0, 0, 0, 0};
        Real power = 1, previousPower = 0, factorial = 1;  // ±x^n, ±x^(n−1), (2n+1)!
        for (int n = 0; n < 10; ++n) {
            const Real inB = 1 / (factorial * (2 * n + 2)), inC = inB / (2 * n + 3);
            k.a += power / factorial;
            k.b += power * inB;
            k.c += power * inC;
            k.bSlope -= 2 * n * previousPower * inB;
            k.cSlope -= 2 * n * previousPower * inC;
            factorial *= (2 * n + 2) * (2 * n + 3);
            previousPower = power;
            power *= -squared;
        }
        return k;
    }
    const Real t = std::sqrt(squared), sine = std::sin(t), cosine = std::cos(t);
    const Real a = sine / t, b = (1 - cosine) / squared, c = (t - sine) / (squared * t);
    return {a, b, c, (a - 2 * b) / squared, (b - 3 * c) / squared};
}

}  // namespace

Mat33 calcLeftJacobian(const Vec3& theta) {
    const Coefficients k = calcCoefficients(theta.normSqr());
    const Mat33 skew = SimTK::crossMat(theta);
    return Mat33(1) + k.b * skew + k.c * skew * skew;
}

Vec3 calcLeftJacobianDotTimes(const Vec3& theta, const Vec3& thetaDot) {
    const Coefficients k = calcCoefficients(theta.normSqr());
    const Real rate = ~theta * thetaDot;
    const Vec3 once = theta % thetaDot, twice = theta % once;
    // d/dt of b[θ]× + c[θ]×², applied to θ̇; [θ̇]×θ̇ = 0.
    return k.bSlope * rate * once + k.cSlope * rate * twice + k.c * (thetaDot % once);
}

Rotation calcExponential(const Vec3& theta) {
    const Coefficients k = calcCoefficients(theta.normSqr());
    const Mat33 skew = SimTK::crossMat(theta);
    return Rotation(Mat33(1) + k.a * skew + k.b * skew * skew, true);
}

std::shared_ptr<const FrameShapes> FrameShapes::make(const Vec3& s, const std::vector<double>& Phi,
                                                     const std::vector<double>& Psi,
                                                     std::vector<double> curvature) {
    auto shapes = std::make_shared<FrameShapes>();
    shapes->s = s;
    shapes->curvature = std::move(curvature);
    for (const std::vector<double>* source : {&Phi, &Psi})
        for (size_t a = 0; a < 3; ++a)
            for (size_t i = a; i < source->size(); i += 3) shapes->columns.push_back((*source)[i]);
    return shapes;
}

FrameSums multiplyShapes(const FrameShapes& shapes, const double* coordinates) {
    const int n = shapes.numModes();
    const double* column = shapes.columns.data();
    FrameSums sums;
    for (Vec3* sum : {&sums.translation, &sums.rotation})
        for (int a = 0; a < 3; ++a, column += n) (*sum)[a] = dot(column, coordinates, n);
    return sums;
}

FrameSums calcTangentShapes(const FrameShapes& shapes, const double* xi, FrameShapes& tangent) {
    const int n = shapes.numModes();
    const double *column = shapes.columns.data(), *H = shapes.curvature.data();
    double* tangentColumn = tangent.columns.data();
    FrameSums sums;
    for (Vec3* sum : {&sums.translation, &sums.rotation})
        for (int a = 0; a < 3; ++a, column += n, tangentColumn += n) {
            for (int i = 0; i < n; ++i, H += n) tangentColumn[i] = column[i] + dot(H, xi, n);
            (*sum)[a] = 0.5 * (dot(column, xi, n) + dot(tangentColumn, xi, n));
        }
    return sums;
}

FrameSums calcCurvatureSums(const FrameShapes& shapes, const double* xiDot) {
    const int n = shapes.numModes();
    const double* H = shapes.curvature.data();
    FrameSums sums;
    for (Vec3* sum : {&sums.translation, &sums.rotation})
        for (int a = 0; a < 3; ++a)
            for (int i = 0; i < n; ++i, H += n) (*sum)[a] += xiDot[i] * dot(H, xiDot, n);
    return sums;
}

FrameAtXi::FrameAtXi(const FlexibleFrame& frame, const double* xi, Order order) : m_tangent(frame) {
    if (order == Order::First || frame.shapes->curvature.empty()) {
        m_pose = calcFramePose(frame, xi);
        return;
    }
    m_curved = frame.shapes;
    auto shapes = std::make_shared<FrameShapes>();
    shapes->s = m_curved->s;
    shapes->columns.resize(m_curved->columns.size());
    const FrameSums atXi = calcTangentShapes(*m_curved, xi, *shapes);
    m_tangent.shapes = shapes;
    m_pose = calcFramePose(m_tangent, atXi);
}

FrameMotion FrameAtXi::calcMotion(const BodyFrame& body, const double* xiDot) const {
    return calcFrameMotion(m_tangent, m_pose, body, xiDot);
}

SpatialVec FrameAtXi::calcAcceleration(const BodyFrame& body, const double* xiDot,
                                       const Vec3& omegaDot_B, const Vec3& vDot_G,
                                       const double* xiDotDot) const {
    FrameSums sums = multiplyShapes(*m_tangent.shapes, xiDotDot);
    if (m_curved) {
        const FrameSums more = calcCurvatureSums(*m_curved, xiDot);
        sums.translation += more.translation;
        sums.rotation += more.rotation;
    }
    return calcFrameAcceleration(m_pose, body, multiplyShapes(*m_tangent.shapes, xiDot), omegaDot_B,
                                 vDot_G, sums);
}

FlexibleFramePose calcFramePose(const FlexibleFrame& frame, const FrameSums& atXi) {
    FlexibleFramePose pose;
    pose.theta = atXi.rotation;
    const Coefficients k = calcCoefficients(pose.theta.normSqr());
    const Columns skew(SimTK::crossMat(pose.theta)), square = skew * skew;
    const Columns one(Mat33(1)), R_BI = one + skew * k.a + square * k.b;
    pose.E = (one + skew * k.b + square * k.c).toMat33();
    pose.rho = R_BI * frame.X_IA.p();
    pose.R_BA = Rotation((R_BI * Columns(frame.X_IA.R())).toMat33(), true);
    pose.r = frame.shapes->s + atXi.translation + pose.rho;
    return pose;
}

FlexibleFramePose calcFramePose(const FlexibleFrame& frame, const double* xi) {
    return calcFramePose(frame, multiplyShapes(*frame.shapes, xi));
}

FrameMotion calcFrameMotion(const FlexibleFramePose& pose, const BodyFrame& body,
                            const FrameSums& atXiDot) {
    const Columns R_GB(body.R_GB);
    const Vec3 omegaRel = Columns(pose.E) * atXiDot.rotation;
    const Vec3 vRel = atXiDot.translation + omegaRel % pose.rho;
    FrameMotion motion;
    motion.X = SimTK::Transform(Rotation((R_GB * Columns(pose.R_BA)).toMat33(), true),
                                body.p_GB + R_GB * pose.r);
    motion.V = {R_GB * (body.omega_B + omegaRel), body.v_G + R_GB * (body.omega_B % pose.r + vRel)};
    return motion;
}

FrameMotion calcFrameMotion(const FlexibleFrame& frame, const FlexibleFramePose& pose,
                            const BodyFrame& body, const double* xiDot) {
    return calcFrameMotion(pose, body, multiplyShapes(*frame.shapes, xiDot));
}

SpatialVec calcFrameAcceleration(const FlexibleFrame& frame, const FlexibleFramePose& pose,
                                 const BodyFrame& body, const double* xiDot, const Vec3& omegaDot_B,
                                 const Vec3& vDot_G, const double* xiDotDot) {
    return calcFrameAcceleration(pose, body, multiplyShapes(*frame.shapes, xiDot), omegaDot_B,
                                 vDot_G, multiplyShapes(*frame.shapes, xiDotDot));
}

SpatialVec calcFrameAcceleration(const FlexibleFramePose& pose, const BodyFrame& body,
                                 const FrameSums& atXiDot, const Vec3& omegaDot_B,
                                 const Vec3& vDot_G, const FrameSums& atXiDotDot) {
    const Vec3 omegaRel = pose.E * atXiDot.rotation;
    const Vec3 vRel = atXiDot.translation + omegaRel % pose.rho;
    const Vec3 alphaRel =
        pose.E * atXiDotDot.rotation + calcLeftJacobianDotTimes(pose.theta, atXiDot.rotation);
    const Vec3 aRel =
        atXiDotDot.translation + alphaRel % pose.rho + omegaRel % (omegaRel % pose.rho);
    const Vec3& omega = body.omega_B;
    const Vec3 alpha_B = omegaDot_B + omega % omegaRel + alphaRel;
    const Vec3 a_B = omegaDot_B % pose.r + omega % (omega % pose.r) + 2 * (omega % vRel) + aRel;
    return {body.R_GB * alpha_B, vDot_G + body.R_GB * a_B};
}

void calcFrameForce(const FlexibleFramePose& pose, const Rotation& R_GB, const SpatialVec& F_G,
                    Vec3& torque_B, Vec3& force_G, Vec3& translation, Vec3& rotation) {
    const Vec3 torque = ~R_GB * F_G[0];
    translation = ~R_GB * F_G[1];
    torque_B = torque + pose.r % translation;
    force_G = F_G[1];
    rotation = ~pose.E * (torque + pose.rho % translation);
}

void addInFrameForce(const FlexibleFrame& frame, const FlexibleFramePose& pose,
                     const Rotation& R_GB, const SpatialVec& F_G, Vec3& torque_B, Vec3& force_G,
                     double* modal) {
    Vec3 torque, linear, force, moment;
    calcFrameForce(pose, R_GB, F_G, torque, linear, force, moment);
    torque_B += torque;
    force_G += linear;
    const int n = frame.numModes();
    const double* A = frame.shapes->columns.data();
    const auto addChunk = [&](int i, int count) {
        const Chunk sum = loadChunk(A + i, count) * force[0] +
                          loadChunk(A + i + n, count) * force[1] +
                          loadChunk(A + i + 2 * n, count) * force[2] +
                          loadChunk(A + i + 3 * n, count) * moment[0] +
                          loadChunk(A + i + 4 * n, count) * moment[1] +
                          loadChunk(A + i + 5 * n, count) * moment[2];
        storeChunk(loadChunk(modal + i, count) + sum, modal + i, count);
    };
    int i = 0;
    for (; i + ChunkSize <= n; i += ChunkSize) addChunk(i, ChunkSize);
    if (i < n) addChunk(i, n - i);
}

void addInConstraintRow(const FlexibleFrame& frame, const FlexibleFramePose& pose,
                        const Rotation& R_GB, const SpatialVec& d, double* row) {
    Vec3 torque_B(0), force_G(0);
    addInFrameForce(frame, pose, R_GB, d, torque_B, force_G, row + 6);
    for (int a = 0; a < 3; ++a) {
        row[a] += torque_B[a];
        row[3 + a] += force_G[a];
    }
}

}  // namespace simflex
