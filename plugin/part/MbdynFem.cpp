#include "simflex/part/MbdynFem.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>
#include <numeric>
#include <sstream>
#include <stdexcept>

#include "simflex/base/DenseAlgebra.h"
#include "simflex/base/NumberText.h"
#include "simflex/base/UnfinishedFile.h"
#include "simflex/part/PartWarnings.h"
#include "simflex/part/TextLines.h"

namespace simflex {
namespace {

using Eigen::Matrix3d;
using Eigen::Matrix3Xd;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

/** Modes whose inner products deviate from orthonormal mean-axis modes by less are used
unchanged. **/
constexpr double RoundOff = 1e-11;
/** A combination of modes with a smaller share of its mass outside rigid motion is rigid. **/
constexpr double RigidLimit = 1e-9;

constexpr int MostNodes = 100000000, MostModes = 1000000, MostNumber = 2000000000;

Matrix3d crossMatrix(const Vector3d& a) {
    Matrix3d A;
    A << 0, -a.z(), a.y(), a.z(), 0, -a.x(), -a.y(), a.x(), 0;
    return A;
}

/** Builds a symmetric matrix from components xx yy zz xy xz yz. **/
template <class Components>
Matrix3d symmetricMatrix(const Components& c) {
    Matrix3d A;
    A << c[0], c[3], c[4], c[3], c[1], c[5], c[4], c[5], c[2];
    return A;
}

// Writing

/** File text with numbers of 17 digits. **/
class FemText {
public:
    void line(const std::string& text) { m_text += text + "\n"; }
    void group(int number, const char* what) {
        line("**");
        line("** RECORD GROUP " + std::to_string(number) + ", " + what);
    }
    void number(double value, char after) {
        m_text += writeScientific(value, 16);
        m_text += after;
    }
    /** Writes one matrix row per line. **/
    template <class Matrix>
    void matrix(const Matrix& A) {
        for (Eigen::Index i = 0; i < A.rows(); ++i)
            for (Eigen::Index j = 0; j < A.cols(); ++j)
                number(A(i, j), j + 1 < A.cols() ? ' ' : '\n');
    }
    const std::string& text() const { return m_text; }

private:
    std::string m_text;
};

/** Replaces characters that would end the line or the quotes of a comment. **/
std::string plainName(std::string name) {
    for (char& c : name)
        if (c == '\'' || (unsigned char)(c) < ' ') c = '_';
    return name;
}

// Reading

struct RecordGroup {
    int line = 0;
    std::vector<double> numbers;
};

/** The numbers of a file by record group, and the interfaces named in its comments. **/
class FemFile {
public:
    explicit FemFile(const std::string& path) : m_path(path) {
        TextLines lines(path, "MBDyn modal data file");
        std::vector<std::string_view> fields;
        int group = 0;
        while (lines.nextFilled()) {
            const std::string_view line = trimBlanks(lines.line());
            if (line.substr(0, 2) == "**") {
                readComment(lines, line, group);
                continue;
            }
            if (group == 0) lines.refuse("data before the first '** RECORD GROUP' line");
            splitFields(line, fields);
            auto& numbers = m_groups[group].numbers;
            for (size_t k = 0; k < fields.size(); ++k) {
                const bool isRevision =
                    group == 1 && numbers.empty() && k == 0 && fields[0].substr(0, 3) == "REV";
                if (!isRevision) numbers.push_back(lines.parseNumber(fields[k], "an entry"));
            }
        }
    }

    bool has(int group) const { return m_groups.count(group) > 0; }

    /** Returns the numbers of a group, which must have this count. **/
    const std::vector<double>& get(int group, const char* what, size_t count) const {
        const auto found = m_groups.find(group);
        if (found == m_groups.end())
            throw std::invalid_argument(m_path + ": record group " + std::to_string(group) + " (" +
                                        what + ") is missing");
        if (found->second.numbers.size() != count)
            refuse(group,
                   std::string("(") + what + ") has " +
                       std::to_string(found->second.numbers.size()) + " numbers; it must have " +
                       std::to_string(count) +
                       (found->second.numbers.size() < count ? "; is the file cut short?" : ""));
        return found->second.numbers;
    }

    [[noreturn]] void refuse(int group, const std::string& why) const {
        throw std::invalid_argument(m_path + ":" + std::to_string(m_groups.at(group).line) +
                                    ": record group " + std::to_string(group) + " " + why);
    }

    int toCount(int group, double value, const char* what, int least, int most) const {
        if (!(value >= least && value <= most) || value != std::floor(value)) {
            std::ostringstream text;
            text << "has " << what << " " << value << "; it must be a whole number from " << least
                 << " to " << most;
            refuse(group, text.str());
        }
        return int(value);
    }

    std::vector<std::pair<std::string, int>> interfaces;

private:
    void readComment(const TextLines& lines, std::string_view line, int& group) {
        const std::string text(line);
        int number = 0;
        const size_t at = text.find("RECORD GROUP");
        if (at != std::string::npos && std::sscanf(text.c_str() + at, "RECORD GROUP %d", &number)) {
            if (number < 1 || number > 99)
                lines.refuse("there is no record group " + std::to_string(number));
            if (m_groups.count(number))
                lines.refuse("record group " + std::to_string(number) + " comes twice");
            group = number;
            m_groups[group].line = lines.number();
            return;
        }
        // ** INTERFACE 'name' IS NODE 123
        const size_t open = text.find('\''), close = text.rfind('\'');
        if (text.find("INTERFACE") == std::string::npos || close <= open) return;
        if (std::sscanf(text.c_str() + close, "' IS NODE %d", &number) == 1)
            interfaces.emplace_back(text.substr(open + 1, close - open - 1), number);
    }

    std::string m_path;
    std::map<int, RecordGroup> m_groups;
};

/** All sums bilinear in s (from the centre of mass) and the mode shapes. **/
struct ModalSums {
    double mass = 0;
    Vector3d center = Vector3d::Zero();
    Matrix3d inertia = Matrix3d::Zero();       ///< about the centre of mass
    Matrix3Xd T;                               ///< ∑m φ_i
    std::array<std::array<VectorXd, 3>, 3> P;  ///< P[a][b]_i = ∑m s_a φ_b,i
    std::array<std::array<MatrixXd, 3>, 3> G;  ///< G[a][b]_ij = ∑m φ_a,i φ_b,j

    explicit ModalSums(int n) : T(Matrix3Xd::Zero(3, n)) {
        for (size_t a = 0; a < 3; ++a)
            for (size_t b = 0; b < 3; ++b) P[a][b].setZero(n), G[a][b].setZero(n, n);
    }

    Matrix3d getP(int i) const {
        Matrix3d result;
        for (size_t a = 0; a < 3; ++a)
            for (size_t b = 0; b < 3; ++b) result(long(a), long(b)) = P[a][b][i];
        return result;
    }
    void setP(int i, const Matrix3d& value) {
        for (size_t a = 0; a < 3; ++a)
            for (size_t b = 0; b < 3; ++b) P[a][b][i] = value(long(a), long(b));
    }
    void setG(int i, int j, const Matrix3d& value) {
        for (size_t a = 0; a < 3; ++a)
            for (size_t b = 0; b < 3; ++b) G[a][b](i, j) = value(long(a), long(b));
    }
    Matrix3d getG(int i, int j) const {
        Matrix3d result;
        for (size_t a = 0; a < 3; ++a)
            for (size_t b = 0; b < 3; ++b) result(long(a), long(b)) = G[a][b](i, j);
        return result;
    }
};

/** Modes at nodes: rows 6·node …, as in the file. **/
struct FemModes {
    Matrix3Xd x;
    MatrixXd U, M, K;

    auto translation(int node) const { return U.middleRows(6 * node, 3); }
};

ModalSums sumLumped(const FemFile& file, const FemModes& modes) {
    const int n = int(modes.U.cols()), numNodes = int(modes.x.cols());
    const auto& diagonal = file.get(11, "lumped masses", 6 * size_t(numNodes));
    ModalSums sums(n);
    VectorXd m(numNodes);
    double largest = 0;
    for (int node = 0; node < numNodes; ++node) {
        m[node] = diagonal[6 * size_t(node)];
        largest = std::max(largest, std::abs(m[node]));
    }
    const double tolerance = 1e-9 * largest;
    const double length = (modes.x.rowwise().maxCoeff() - modes.x.rowwise().minCoeff()).norm();
    for (int node = 0; node < numNodes; ++node) {
        const double* values = &diagonal[6 * size_t(node)];
        if (std::abs(values[1] - values[0]) > tolerance ||
            std::abs(values[2] - values[0]) > tolerance)
            file.refuse(11, "gives the node in place " + std::to_string(node + 1) +
                                " other masses in other directions; simflex needs the same in all");
        for (int a = 3; a < 6; ++a)
            if (std::abs(values[a]) > tolerance * length * length)
                file.refuse(11, "gives the node in place " + std::to_string(node + 1) +
                                    " rotary inertia, which simflex has no place for; lump the "
                                    "mass to translations, or write record groups 12 and 14 to 18");
    }
    sums.mass = m.sum();
    if (!(sums.mass > 0)) file.refuse(11, "has no mass");
    sums.center = modes.x * m / sums.mass;
    Matrix3d S = Matrix3d::Zero();
    for (int node = 0; node < numNodes; ++node) {
        const Vector3d s = modes.x.col(node) - sums.center;
        const auto phi = modes.translation(node);
        S += m[node] * s * s.transpose();
        sums.T += m[node] * phi;
        for (int a = 0; a < 3; ++a)
            for (int b = 0; b < 3; ++b) {
                sums.P[size_t(a)][size_t(b)] += m[node] * s[a] * phi.row(b).transpose();
                sums.G[size_t(a)][size_t(b)] += m[node] * phi.row(a).transpose() * phi.row(b);
            }
    }
    sums.inertia = S.trace() * Matrix3d::Identity() - S;
    return sums;
}

ModalSums sumInvariants(const FemFile& file, int n) {
    const size_t N = size_t(n);
    ModalSums sums(n);
    const auto& rigid = file.get(12, "rigid body inertia", 13);
    sums.mass = rigid[0];
    if (!(sums.mass > 0)) file.refuse(12, "has no mass");
    for (int a = 0; a < 3; ++a) {
        sums.center[a] = rigid[size_t(1 + a)];
        for (int b = 0; b < 3; ++b) sums.inertia(a, b) = rigid[size_t(4 + 3 * a + b)];
    }
    if ((sums.inertia - sums.inertia.transpose()).norm() > 1e-9 * sums.inertia.norm())
        file.refuse(12, "has an inertia matrix that is not symmetric");
    const auto& inv3 = file.get(14, "invariant 3", 3 * N);
    file.get(15, "invariant 4", 3 * N);
    const auto& inv8 = file.get(16, "invariant 8", 9 * N);
    const auto& inv9 = file.get(18, "invariant 9", 9 * N * N);
    for (int i = 0; i < n; ++i) {
        Matrix3d A;
        for (int a = 0; a < 3; ++a) {
            sums.T(a, i) = inv3[size_t(a) * N + size_t(i)];
            for (int b = 0; b < 3; ++b) A(a, b) = inv8[size_t(a) * 3 * N + size_t(3 * i + b)];
        }
        // −∑m [x×][φ×] = ∑m (x·φ) 1 − ∑m φ xᵀ, and x = s + centre.
        const Matrix3d phiX = 0.5 * A.trace() * Matrix3d::Identity() - A;
        sums.setP(i, phiX.transpose() - sums.center * sums.T.col(i).transpose());
        for (int j = 0; j < n; ++j) {
            Matrix3d B;  // ∑m [φ_i×][φ_j×] = ∑m φ_j φ_iᵀ − ∑m (φ_i·φ_j) 1
            for (int a = 0; a < 3; ++a)
                for (int b = 0; b < 3; ++b)
                    B(a, b) =
                        inv9[size_t(a) * 3 * N * N + 3 * (size_t(i) * N + size_t(j)) + size_t(b)];
            sums.setG(j, i, B - 0.5 * B.trace() * Matrix3d::Identity());
        }
    }
    return sums;
}

/** Rigid part of each mode: translation and rotation about the centre of mass, weighted by
mass. **/
struct RigidPart {
    Matrix3Xd a, b;

    explicit RigidPart(const ModalSums& sums) {
        const int n = int(sums.T.cols());
        a = sums.T / sums.mass;
        Matrix3Xd h(3, n);
        for (int i = 0; i < n; ++i) {
            const Matrix3d P = sums.getP(i);
            h.col(i) << P(1, 2) - P(2, 1), P(2, 0) - P(0, 2), P(0, 1) - P(1, 0);
        }
        b = solveEachSymmetric(sums.inertia, h);
    }
};

/** Removes the rigid motion from all sums and from M. **/
void removeRigid(const RigidPart& rigid, ModalSums& sums, MatrixXd& M) {
    const int n = int(sums.T.cols());
    const Matrix3d S = 0.5 * sums.inertia.trace() * Matrix3d::Identity() - sums.inertia;
    const ModalSums old = sums;
    for (int i = 0; i < n; ++i) {
        const Matrix3d bi = crossMatrix(rigid.b.col(i));
        sums.setP(i, old.getP(i) + S * bi);
        for (int j = 0; j < n; ++j) {
            const Matrix3d bj = crossMatrix(rigid.b.col(j));
            sums.setG(i, j,
                      old.getG(i, j) - sums.mass * rigid.a.col(i) * rigid.a.col(j).transpose() +
                          old.getP(i).transpose() * bj - bi * old.getP(j) - bi * S * bj);
        }
    }
    M -= sums.mass * rigid.a.transpose() * rigid.a;
    M -= calcCongruent(rigid.b, sums.inertia);
    sums.T.setZero();
}

/** Returns V with VᵀMV = 1, VᵀKV = Ω² ascending; massless directions (rigid ones) are removed. **/
MatrixXd solvePencil(const FemFile& file, const MatrixXd& M, const VectorXd& wholeMass,
                     const MatrixXd& K, VectorXd& omegaSquared) {
    const VectorXd scale = wholeMass.cwiseSqrt().cwiseInverse();
    if (!scale.allFinite()) file.refuse(9, "has a mode without mass");
    const MatrixXd scaled = scale.asDiagonal() * M * scale.asDiagonal();
    const SymmetricEigen mass = calcSymmetricEigen(scaled);
    const VectorXd& mu = mass.values;
    if (!mass.hasConverged || mu[0] < -1e-6 * std::max(1.0, mu[mu.size() - 1]))
        file.refuse(9,
                    "is no mass matrix of these modes: with their rigid motion taken out it is "
                    "not positive");
    const long numRigid = (mu.array() < RigidLimit * mu[mu.size() - 1]).count();
    const long n = mu.size() - numRigid;
    const MatrixXd W = scale.asDiagonal() * mass.vectors.rightCols(n) *
                       mu.tail(n).cwiseSqrt().cwiseInverse().asDiagonal();
    const MatrixXd reduced = calcCongruent(W, K);
    const SymmetricEigen stiffness = calcSymmetricEigen(0.5 * (reduced + reduced.transpose()));
    omegaSquared = stiffness.values;
    return W * stiffness.vectors;
}

std::vector<double> toVector(const MatrixXd& A) {
    return {A.data(), A.data() + A.size()};
}

void setInvariants(const ModalSums& sums, const MatrixXd& V, ReducedBody& body) {
    const int n = int(V.cols());
    std::array<std::array<VectorXd, 3>, 3> P;
    std::array<std::array<MatrixXd, 3>, 3> G;
    for (size_t a = 0; a < 3; ++a)
        for (size_t b = 0; b < 3; ++b) {
            P[a][b] = V.transpose() * sums.P[a][b];
            G[a][b] = calcCongruent(V, sums.G[a][b]);
        }
    const Matrix3d& I0 = sums.inertia;
    body.mass = sums.mass;
    body.centerOfMass = {sums.center.x(), sums.center.y(), sums.center.z()};
    body.inertia = {I0(0, 0), I0(1, 1), I0(2, 2), I0(0, 1), I0(0, 2), I0(1, 2)};
    constexpr size_t TensorAxes[6][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}};
    body.I1.resize(6 * size_t(n));
    Eigen::Map<MatrixXd> I1(body.I1.data(), 6, n);
    for (size_t c = 0; c < 6; ++c) {
        const size_t a = TensorAxes[c][0], b = TensorAxes[c][1];
        MatrixXd I2;
        if (a == b) {
            const size_t p = (a + 1) % 3, q = (a + 2) % 3;
            I1.row(long(c)) = 2 * (P[p][p] + P[q][q]).transpose();
            I2 = G[p][p] + G[q][q];
            I2 = 0.5 * (I2 + I2.transpose()).eval();
        } else {
            I1.row(long(c)) = -(P[a][b] + P[b][a]).transpose();
            I2 = -0.5 * (G[a][b] + G[a][b].transpose());
        }
        body.I2[c] = toVector(I2);
    }
    body.N[0] = toVector(G[1][2] - G[1][2].transpose());
    body.N[1] = toVector(G[0][2].transpose() - G[0][2]);
    body.N[2] = toVector(G[0][1] - G[0][1].transpose());
}

/** Returns the largest difference of A from B relative to the largest entry of B. **/
double calcDefect(const MatrixXd& A, const MatrixXd& B) {
    return (A - B).cwiseAbs().maxCoeff() / B.cwiseAbs().maxCoeff();
}

}  // namespace

void writeMbdynFem(const std::string& path, const ReducedBody& body, ExchangeNodes nodes) {
    body.validate();
    const int n = body.numModes;
    const bool withMesh = nodes == ExchangeNodes::All || body.interfaces.empty();
    const int numMesh = withMesh ? body.mesh.numNodes() : 0;
    int nextNumber =
        1 + *std::max_element(body.mesh.nodeNumbers.begin(), body.mesh.nodeNumbers.end());
    const Vector3d center(body.centerOfMass.data());

    FemText out;
    out.line("** MBDyn MODAL DATA FILE");
    out.line("** PART '" + plainName(body.name) + "' IN UNITS m kg s, WRITTEN BY simflex");
    std::vector<int> numbers(body.mesh.nodeNumbers.begin(),
                             body.mesh.nodeNumbers.begin() + numMesh);
    Matrix3Xd x(3, numMesh + int(body.interfaces.size()));
    for (int node = 0; node < numMesh; ++node)
        x.col(node) = center + Vector3d(body.mesh.position(node).data());
    for (const auto& interface : body.interfaces) {
        out.line("** INTERFACE '" + plainName(interface.name) + "' IS NODE " +
                 std::to_string(nextNumber));
        x.col(long(numbers.size())) = center + Vector3d(interface.position.data());
        numbers.push_back(nextNumber++);
    }

    out.group(1, "HEADER");
    out.line("**   REVISION,  NODE,  NORMAL, ATTACHMENT, CONSTRAINT, REJECTED MODES.");
    out.line("      REV0 " + std::to_string(numbers.size()) + " " + std::to_string(n) + " 0 0 0");
    out.group(2, "FINITE ELEMENT NODE LIST");
    for (const int number : numbers) out.line(std::to_string(number));
    const char* const names[3] = {"NODAL X COORDINATES", "NODAL Y COORDINATES",
                                  "NODAL Z COORDINATES"};
    for (int a = 0; a < 3; ++a) {
        out.group(5 + a, names[a]);
        out.matrix(MatrixXd(x.row(a).transpose()));
    }
    out.group(8, "MODE SHAPES");
    const size_t rows = 3 * size_t(body.mesh.numNodes());
    for (int i = 0; i < n; ++i) {
        out.line("**    NORMAL MODE SHAPE #  " + std::to_string(i + 1));
        for (int node = 0; node < numMesh; ++node)
            for (int a = 0; a < 6; ++a)
                out.number(a < 3 ? body.Phi[size_t(i) * rows + size_t(3 * node + a)] : 0,
                           a < 5 ? ' ' : '\n');
        for (const auto& interface : body.interfaces)
            for (int a = 0; a < 6; ++a)
                out.number((a < 3 ? interface.Phi : interface.Psi)[size_t(3 * i + a % 3)],
                           a < 5 ? ' ' : '\n');
    }
    out.group(9, "MODAL MASS MATRIX");
    out.matrix(MatrixXd(MatrixXd::Identity(n, n)));
    out.group(10, "MODAL STIFFNESS MATRIX");
    out.matrix(MatrixXd(Eigen::Map<const VectorXd>(body.omegaSquared.data(), n).asDiagonal()));

    out.group(12, "RIGID BODY INERTIA MATRIX");
    out.number(body.mass, '\n');
    out.matrix(MatrixXd(center.transpose()));
    out.matrix(symmetricMatrix(body.inertia));
    const auto component = [n](const std::vector<double>& A, int i, int j) {
        return A[size_t(i) + size_t(n) * size_t(j)];
    };
    MatrixXd inv8(3, 3 * n), inv5(3, n * n), inv9(3, 3 * n * n);
    for (int i = 0; i < n; ++i) {
        inv8.middleCols(3 * i, 3) = 0.5 * symmetricMatrix(&body.I1[6 * size_t(i)]);
        for (int j = 0; j < n; ++j) {
            Vector3d N;
            for (int a = 0; a < 3; ++a) N[a] = component(body.N[size_t(a)], i, j);
            double I2[6];
            for (size_t c = 0; c < 6; ++c) I2[c] = component(body.I2[c], i, j);
            inv5.col(i * n + j) = N;
            inv9.middleCols(3 * (i * n + j), 3) = 0.5 * crossMatrix(N) - symmetricMatrix(I2);
        }
    }
    out.group(14, "INVARIANT 3");
    out.matrix(MatrixXd(MatrixXd::Zero(3, n)));
    out.group(15, "INVARIANT 4");
    out.matrix(MatrixXd(MatrixXd::Zero(3, n)));
    out.group(16, "INVARIANT 8");
    out.matrix(inv8);
    out.group(17, "INVARIANT 5");
    out.matrix(inv5);
    out.group(18, "INVARIANT 9");
    out.matrix(inv9);
    out.line("**");
    replaceFile(path, out.text());
}

ReducedBody readMbdynFem(const std::string& path, const MbdynFemOptions& options,
                         std::vector<std::string>* notes, std::vector<std::string>* warnings) {
    const FemFile file(path);
    const auto& header = file.get(1, "header", 5);
    const int numNodes = file.toCount(1, header[0], "a number of nodes of", 1, MostNodes);
    int n = 0;
    for (size_t k = 1; k < 4; ++k)
        n += file.toCount(1, header[k], "a number of modes of", 0, MostModes);
    n -= file.toCount(1, header[4], "a number of rejected modes of", 0, MostModes);
    if (n < 1) file.refuse(1, "has no modes");

    // Sort the nodes by number.
    const auto& listed = file.get(2, "nodes", size_t(numNodes));
    std::vector<int> order(size_t(numNodes), 0);
    std::iota(order.begin(), order.end(), 0);
    std::sort(order.begin(), order.end(),
              [&](int a, int b) { return listed[size_t(a)] < listed[size_t(b)]; });
    ReducedBody body;
    for (const int k : order) {
        const int number = file.toCount(2, listed[size_t(k)], "a node number of", 1, MostNumber);
        if (!body.mesh.nodeNumbers.empty() && body.mesh.nodeNumbers.back() == number)
            file.refuse(2, "lists node " + std::to_string(number) + " twice");
        body.mesh.nodeNumbers.push_back(number);
    }

    FemModes modes;
    const size_t numRows = 6 * size_t(numNodes), N = size_t(n);
    const char* const names[3] = {"x coordinates", "y coordinates", "z coordinates"};
    const double* coordinates[3];
    for (int a = 0; a < 3; ++a) coordinates[a] = file.get(5 + a, names[a], size_t(numNodes)).data();
    const auto& shapes = file.get(8, "mode shapes", numRows * N);
    modes.x.resize(3, numNodes);
    for (int a = 0; a < 3; ++a)
        modes.x.row(a) = Eigen::Map<const VectorXd>(coordinates[a], numNodes).transpose();
    modes.U = Eigen::Map<const MatrixXd>(shapes.data(), long(numRows), n);
    for (const auto& [group, what, matrix] :
         {std::tuple(9, "modal mass matrix", &modes.M), {10, "modal stiffness", &modes.K}}) {
        *matrix = Eigen::Map<const MatrixXd>(file.get(group, what, N * N).data(), n, n);
        if (calcDefect(*matrix, matrix->transpose()) > 1e-6)
            file.refuse(group, std::string("(") + what + ") is not symmetric");
        *matrix = 0.5 * (*matrix + matrix->transpose()).eval();
    }

    const bool hasInvariants = file.has(12) && file.has(14) && file.has(16) && file.has(18);
    if (!hasInvariants && !file.has(11))
        throw std::invalid_argument(
            path +
            ": it has neither lumped masses (record group 11) nor rigid body inertia with "
            "invariants (12 and 14 to 18), so that its mass cannot be known; write one of "
            "them");
    ModalSums sums = hasInvariants ? sumInvariants(file, n) : sumLumped(file, modes);
    if (!(calcSymmetricEigen(sums.inertia).values[0] > 1e-12 * sums.inertia.trace()))
        file.refuse(hasInvariants ? 12 : 11,
                    "gives no inertia about some axis: the masses lie on "
                    "a line");
    const VectorXd wholeMass = modes.M.diagonal();
    const RigidPart rigid(sums);
    const double radius = std::sqrt(sums.inertia.trace() / sums.mass);
    const double rigidShare =
        sums.mass * (rigid.a.squaredNorm() + radius * radius * rigid.b.squaredNorm());

    const VectorXd stiffness = modes.K.diagonal();
    const bool isOrthonormal = calcDefect(modes.M, MatrixXd::Identity(n, n)) < RoundOff &&
                               calcDefect(MatrixXd(stiffness.asDiagonal()), modes.K) < RoundOff &&
                               std::is_sorted(stiffness.data(), stiffness.data() + n);
    MatrixXd V = MatrixXd::Identity(n, n);
    VectorXd omegaSquared = stiffness;
    const bool isMeanAxis = isOrthonormal && rigidShare < RoundOff * RoundOff * n;
    if (!isMeanAxis) {
        removeRigid(rigid, sums, modes.M);
        V = solvePencil(file, modes.M, wholeMass, modes.K, omegaSquared);
        if (V.cols() == 0) file.refuse(8, "has rigid motions alone");
    }
    setInvariants(sums, V, body);
    const int numModes = int(V.cols());
    body.numModes = numModes;
    body.omegaSquared = toVector(omegaSquared);
    body.name = options.name.empty() ? std::filesystem::path(path).stem().string() : options.name;
    body.provenance.source = path;
    body.provenance.program = "MBDyn modal data";

    // Shapes at the nodes without rigid motion.
    const auto shapeOf = [&](int k) {
        MatrixXd U = modes.U.middleRows(6 * k, 6);
        if (!isMeanAxis) {
            const Vector3d s = modes.x.col(k) - sums.center;
            U.topRows(3) -= rigid.a - crossMatrix(s) * rigid.b;
            U.bottomRows(3) -= rigid.b;
        }
        return MatrixXd(U * V);
    };
    MatrixXd Phi(3 * numNodes, numModes);
    for (int node = 0; node < numNodes; ++node) {
        const int k = order[size_t(node)];
        Phi.middleRows(3 * node, 3) = shapeOf(k).topRows(3);
        for (int a = 0; a < 3; ++a) body.mesh.positions.push_back(modes.x(a, k) - sums.center[a]);
    }
    body.Phi = toVector(Phi);
    for (const auto& [name, number] :
         options.interfaces.empty() ? file.interfaces : options.interfaces) {
        const auto found =
            std::lower_bound(body.mesh.nodeNumbers.begin(), body.mesh.nodeNumbers.end(), number);
        if (found == body.mesh.nodeNumbers.end() || *found != number)
            throw std::invalid_argument(path + ": interface '" + name + "': the file has no node " +
                                        std::to_string(number));
        const int node = int(found - body.mesh.nodeNumbers.begin()), k = order[size_t(node)];
        if (modes.U.middleRows(6 * k + 3, 3).isZero(0))
            throw std::invalid_argument(
                path + ": interface '" + name + "': node " + std::to_string(number) +
                " has no rotations in the file; an interface must be a node that turns, such as "
                "the master of a rigid tie");
        ReducedBody::Interface interface;
        interface.name = name;
        for (int a = 0; a < 3; ++a) interface.position[size_t(a)] = modes.x(a, k) - sums.center[a];
        const MatrixXd shape = shapeOf(k);
        interface.Phi = toVector(shape.topRows(3));
        interface.Psi = toVector(shape.bottomRows(3));
        interface.nodes = {node};
        body.interfaces.push_back(std::move(interface));
    }
    if (warnings)
        for (const auto& [group, what] : {std::pair(3, "initial modal displacements"),
                                          {4, "initial modal velocities"},
                                          {13, "the modal damping matrix"},
                                          {19, "the stress stiffening matrices"}})
            if (file.has(group)) warnings->push_back(std::string("left out ") + what);
    if (notes && numModes < n)
        notes->push_back("left out " + std::to_string(n - numModes) + " rigid modes");
    try {
        body.validate();
    } catch (const std::invalid_argument& error) {
        throw std::invalid_argument(path + ": " + error.what());
    }
    if (warnings)
        for (const std::string& doubt : listPartDoubts(body)) warnings->push_back(doubt);
    return body;
}

}  // namespace simflex
