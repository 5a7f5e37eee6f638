#include "support/LinearModel.h"

namespace simflex::examples {

using namespace SimTK;

namespace {

/** L⁻ᵀ of M = LLᵀ. **/
Matrix calcInverseFactorTranspose(const Matrix& M) {
    const int n = M.nrow();
    Matrix L(n, n, 0.0), inverse(n, n, 0.0);
    for (int j = 0; j < n; ++j)
        for (int i = j; i < n; ++i) {
            Real sum = M(i, j);
            for (int k = 0; k < j; ++k) sum -= L(i, k) * L(j, k);
            L(i, j) = i == j ? std::sqrt(sum) : sum / L(j, j);
        }
    for (int j = 0; j < n; ++j)
        for (int i = j; i < n; ++i) {
            Real sum = i == j;
            for (int k = j; k < i; ++k) sum -= L(i, k) * inverse(k, j);
            inverse(i, j) = sum / L(i, i);
        }
    return Matrix(~inverse);
}

/** Index in u of a body's mode. **/
int findModeIndex(const FlexibleBody& body, const State& state, int mode) {
    return int(body.getModalMobilizer(mode / 6).getFirstUIndex(state)) + mode % 6;
}

Vec3 readColumn(const std::vector<double>& matrix, int column) {
    return {matrix[3 * column], matrix[3 * column + 1], matrix[3 * column + 2]};
}

}  // namespace

LinearModel::LinearModel(const MultibodySystem& system, const SimbodyMatterSubsystem& matter,
                         std::vector<FlexibleBody> bodies, const State& state, double dampingRatio)
    : m_bodies(std::move(bodies)), m_state(state) {
    system.realize(m_state, Stage::Velocity);
    const int n = m_state.getNU();
    Matrix M, G;
    matter.calcM(m_state, M);
    matter.calcG(m_state, G);
    Vector K(n, 0.0), D(n, 0.0);
    for (const FlexibleBody& body : m_bodies)
        for (int i = 0; i < body.getNumModes(); ++i) {
            const int index = findModeIndex(body, m_state, i);
            K[index] = body.getPart().omegaSquared[i];
            D[index] = 2 * dampingRatio * std::sqrt(K[index]);
        }

    const Matrix scale = calcInverseFactorTranspose(M);
    const Matrix scaledG = G * scale;
    FactorQTZ gram(Matrix(scaledG * ~scaledG), 1e-12);  // joints may be redundant
    Matrix solved;
    gram.solve(scaledG, solved);
    Matrix projector = Matrix(~scaledG * solved);
    projector *= -1;
    for (int i = 0; i < n; ++i) projector(i, i) += 1;

    Matrix basis = scale * projector, weighted = basis;
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) weighted(i, j) *= K[i];
    Matrix S = ~basis * weighted;
    S = 0.5 * (S + Matrix(~S));
    // S is symmetric without negative eigenvalues: its singular vectors are its eigenvectors.
    FactorSVD eigen(S);
    Vector values;
    Matrix left, right;
    eigen.getSingularValuesAndVectors(values, left, right);
    int numModes = 0;
    while (numModes < n && values[numModes] > 1e-9 * values[0]) ++numModes;
    m_modes.resize(n, numModes);
    for (int k = 0; k < numModes; ++k) {
        const int from = numModes - 1 - k;  // values descend
        m_omegaSquared.push_back(values[from]);
        m_modes(k) = basis * Vector(left(from));
        Real damping = 0;
        for (int i = 0; i < n; ++i) damping += square(m_modes(i, k)) * D[i];
        m_dampingRatios.push_back(damping / (2 * std::sqrt(values[from])));
    }
}

double LinearModel::getFrequency(int mode) const {
    return std::sqrt(m_omegaSquared.at(mode)) / (2 * Pi);
}

double LinearModel::getDampingRatio(int mode) const {
    return m_dampingRatios.at(mode);
}

Vector LinearModel::calcGravityForce(const Vec3& gravity) const {
    Vector f(m_state.getNU(), 0.0);
    for (const FlexibleBody& body : m_bodies) {
        const int first = body.getFrame().getFirstUIndex(m_state);
        for (int axis = 0; axis < 3; ++axis)
            f[first + 3 + axis] = body.getPart().mass * gravity[axis];
    }
    return f;
}

Vector LinearModel::calcStaticDisplacement(const Vector& f) const {
    Vector v(m_state.getNU(), 0.0);
    for (int k = 0; k < getNumModes(); ++k)
        v += m_modes(k) * ((~m_modes(k) * f) / m_omegaSquared[k]);
    return v;
}

State LinearModel::calcDisplacedState(const Vector& v) const {
    State state = m_state;
    for (const FlexibleBody& body : m_bodies) {
        const int first = body.getFrame().getFirstUIndex(m_state);
        const Vec3 turn(v[first], v[first + 1], v[first + 2]);
        const Vec3 shift(v[first + 3], v[first + 4], v[first + 5]);
        const Transform X_GB = body.getFramePose(m_state);
        const Real angle = turn.norm();
        const Rotation R = angle > 0 ? Rotation(angle, UnitVec3(turn)) : Rotation();
        body.setFramePose(state, Transform(R * X_GB.R(), X_GB.p() + shift));
        Vector xi(body.getNumModes());
        for (int i = 0; i < xi.size(); ++i) xi[i] = v[findModeIndex(body, m_state, i)];
        body.setModalCoordinates(state, xi);
    }
    return state;
}

Matrix LinearModel::calcTranslationMap(const FlexibleBody& body,
                                       const std::string& interface) const {
    const ReducedBody::Interface& seat = body.getPart().getInterface(interface);
    const Rotation R_GB = body.getFramePose(m_state).R();
    const Vec3 arm = R_GB * Vec3(seat.position[0], seat.position[1], seat.position[2]);
    Matrix map(3, m_state.getNU(), 0.0);
    const int first = body.getFrame().getFirstUIndex(m_state);
    for (int axis = 0; axis < 3; ++axis) {
        const Vec3 turned = Vec3(axis == 0, axis == 1, axis == 2) % arm;
        for (int row = 0; row < 3; ++row) map(row, first + axis) = turned[row];
        map(axis, first + 3 + axis) = 1;
    }
    for (int i = 0; i < body.getNumModes(); ++i) {
        const Vec3 shape = R_GB * readColumn(seat.Phi, i);
        for (int row = 0; row < 3; ++row) map(row, findModeIndex(body, m_state, i)) = shape[row];
    }
    return map;
}

Vector_<std::complex<double>> LinearModel::calcResponse(const Vector_<std::complex<double>>& f,
                                                        double omega) const {
    using Complex = std::complex<double>;
    Vector_<Complex> v(m_state.getNU(), Complex(0));
    for (int k = 0; k < getNumModes(); ++k) {
        Complex modalForce = 0;
        for (int i = 0; i < f.size(); ++i) modalForce += m_modes(i, k) * f[i];
        const Complex stiffness(m_omegaSquared[k] - omega * omega,
                                2 * m_dampingRatios[k] * std::sqrt(m_omegaSquared[k]) * omega);
        const Complex amplitude = modalForce / stiffness;
        for (int i = 0; i < v.size(); ++i) v[i] += m_modes(i, k) * amplitude;
    }
    return v;
}

}  // namespace simflex::examples
