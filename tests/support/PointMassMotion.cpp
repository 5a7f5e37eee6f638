#include "support/PointMassMotion.h"

namespace simflex::test {

using Eigen::Map;
using Eigen::Matrix3Xd;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

Matrix3Xd multiplyModes(const PointMassPart& part, const VectorXd& coordinates) {
    const int numNodes = part.body->mesh.numNodes();
    const Map<const MatrixXd> Phi(part.body->Phi.data(), 3 * numNodes, part.body->numModes);
    const VectorXd field = Phi * coordinates;
    return Map<const Matrix3Xd>(field.data(), 3, numNodes);
}

/** Returns the locations of the masses relative to B's origin, in B. **/
Matrix3Xd calcArms(const PointMassPart& part, const PointMassMotion& motion) {
    const Mesh& mesh = part.body->mesh;
    return Map<const Matrix3Xd>(mesh.positions.data(), 3, mesh.numNodes()) +
           multiplyModes(part, motion.xi);
}

Matrix3Xd crossColumns(const Vector3d& left, const Matrix3Xd& columns) {
    Matrix3Xd products(3, columns.cols());
    for (int k = 0; k < columns.cols(); ++k) products.col(k) = left.cross(columns.col(k));
    return products;
}

VectorXd massesOf(const PointMassPart& part) {
    return Map<const VectorXd>(part.masses.data(), int(part.masses.size()));
}

}  // namespace

PointMassMotion::PointMassMotion(int numModes) {
    for (Vector3d* v : {&p_GB, &omega_B, &v_G, &omegaDot_B, &vDot_G}) v->setZero();
    for (VectorXd* v : {&xi, &xiDot, &xiDotDot}) v->setZero(numModes);
}

PointMassMotion PointMassMotion::makeRandom(int numModes, unsigned seed, double deformation) {
    std::mt19937 random(seed);
    PointMassMotion motion(numModes);
    motion.R_GB =
        Eigen::Quaterniond(Eigen::Vector4d(makeRandomVector(4, 1, random)).normalized()).matrix();
    for (Vector3d* v :
         {&motion.p_GB, &motion.omega_B, &motion.v_G, &motion.omegaDot_B, &motion.vDot_G})
        *v = makeRandomVector(3, 2, random);
    motion.xi = makeRandomVector(numModes, deformation, random);
    motion.xiDot = makeRandomVector(numModes, 1, random);
    motion.xiDotDot = makeRandomVector(numModes, 1, random);
    return motion;
}

Matrix3Xd calcMassLocations(const PointMassPart& part, const PointMassMotion& motion) {
    return (motion.R_GB * calcArms(part, motion)).colwise() + motion.p_GB;
}

Matrix3Xd calcMassVelocities(const PointMassPart& part, const PointMassMotion& motion) {
    const Matrix3Xd relative =
        crossColumns(motion.omega_B, calcArms(part, motion)) + multiplyModes(part, motion.xiDot);
    return (motion.R_GB * relative).colwise() + motion.v_G;
}

Matrix3Xd calcMassAccelerations(const PointMassPart& part, const PointMassMotion& motion) {
    const Matrix3Xd r = calcArms(part, motion), rDot = multiplyModes(part, motion.xiDot);
    const Vector3d& omega = motion.omega_B;
    const Matrix3Xd relative = crossColumns(motion.omegaDot_B, r) +
                               crossColumns(omega, crossColumns(omega, r)) +
                               2 * crossColumns(omega, rDot) + multiplyModes(part, motion.xiDotDot);
    return (motion.R_GB * relative).colwise() + motion.vDot_G;
}

double calcKineticEnergy(const PointMassPart& part, const PointMassMotion& motion) {
    return 0.5 * calcMassVelocities(part, motion).colwise().squaredNorm() * massesOf(part);
}

Vector3d calcLinearMomentum(const PointMassPart& part, const PointMassMotion& motion) {
    return calcMassVelocities(part, motion) * massesOf(part);
}

Vector3d calcAngularMomentum(const PointMassPart& part, const PointMassMotion& motion) {
    const Matrix3Xd x = calcMassLocations(part, motion), v = calcMassVelocities(part, motion);
    Vector3d sum = Vector3d::Zero();
    for (int k = 0; k < x.cols(); ++k) sum += part.masses[k] * Vector3d(x.col(k)).cross(v.col(k));
    return sum;
}

VectorXd calcInertiaForces(const PointMassPart& part, const PointMassMotion& motion) {
    const Matrix3Xd force = calcMassAccelerations(part, motion) * massesOf(part).asDiagonal();
    VectorXd forces(6 + motion.numModes());
    for (int i = 0; i < forces.size(); ++i) {
        PointMassMotion virtualMotion(motion.numModes());
        virtualMotion.R_GB = motion.R_GB;
        virtualMotion.xi = motion.xi;
        if (i < 3)
            virtualMotion.omega_B[i] = 1;
        else if (i < 6)
            virtualMotion.v_G[i - 3] = 1;
        else
            virtualMotion.xiDot[i - 6] = 1;
        forces[i] = calcMassVelocities(part, virtualMotion).cwiseProduct(force).sum();
    }
    return forces;
}

VectorXd makeRandomVector(int size, double largest, std::mt19937& random) {
    std::uniform_real_distribution<double> uniform(-largest, largest);
    VectorXd values(size);
    for (int i = 0; i < size; ++i) values[i] = uniform(random);
    return values;
}

}  // namespace simflex::test
