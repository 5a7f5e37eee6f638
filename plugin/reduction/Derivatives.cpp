#include "Derivatives.h"

#include <array>
#include <optional>

#include "Coordinates.h"
#include "simflex/base/ParallelFor.h"
#include "simflex/fe/DesignParameter.h"
#include "simflex/fe/elements/FeElements.h"

namespace simflex {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;

constexpr int NumVariants = DesignParameter::NumVariants;

/** Elements are summed in this many shares for any number of threads. **/
constexpr int NumShares = 16;

Eigen::Map<const Vector3d> positionOf(const FeModel& model, int node) {
    return Eigen::Map<const Vector3d>(&model.mesh.positions[3 * size_t(node)]);
}

bool haveSameTies(const FeModel& a, const FeModel& b) {
    return a.constraints.rowStarts == b.constraints.rowStarts &&
           a.constraints.columns == b.constraints.columns &&
           a.constraints.coefficients == b.constraints.coefficients;
}

/** Motion of the tied nodes at another parameter value, where it changes. **/
class TiedMotion {
public:
    TiedMotion(const FeModel& model, const RigidMotion& rigid, const InterfaceTies& ties,
               const MeanAxisModes& modes)
        : m_model(model), m_rigid(rigid), m_ties(ties), m_modes(modes) {}

    std::optional<Shapes> calc(const FeModel& variant) const {
        if (haveSameTies(m_model, variant) && !areInterfacesMoved(variant)) return {};
        const Coordinates coordinates(variant);
        Vectors q = coordinates.solve(m_modes.Phi);
        Shapes R(m_modes.Phi.rows(), 6);
        for (int node = 0; node < variant.mesh.numNodes(); ++node)
            R.middleRows<3>(3 * node) = calcRigidMotion(positionOf(variant, node) - m_rigid.center);
        const Shapes rigidOfTies = coordinates.solveRigid(R);
        for (size_t k = 0; k < m_ties.ties().size(); ++k) {
            const InterfaceTies::Tie& tie = m_ties.ties()[k];
            if (tie.type != TieType::Rigid) continue;
            // Motion of the master as a motion about the centre of mass.
            MatrixXd motion = m_modes.boundary.middleRows(6 * Index(k), 6);
            const Vector3d arm = m_rigid.center - Eigen::Map<const Vector3d>(tie.master.data());
            motion.topRows<3>() =
                (calcRigidMotion(arm) * m_modes.boundary.middleRows(6 * Index(k), 6)).eval();
            for (const int node : tie.nodes)
                for (const int coordinate : coordinates.coordinatesOf(node))
                    q.row(coordinate) = rigidOfTies.row(coordinate) * motion;
        }
        return coordinates.expand(coordinates.listAll(), q);
    }

private:
    bool areInterfacesMoved(const FeModel& variant) const {
        for (int node = 0; node < variant.mesh.numNodes(); ++node)
            if (m_ties.rigidTieOf(node) >= 0 &&
                positionOf(variant, node) != positionOf(m_model, node))
                return true;
        return false;
    }

    const FeModel& m_model;
    const RigidMotion& m_rigid;
    const InterfaceTies& m_ties;
    const MeanAxisModes& m_modes;
};

/** Derivatives of ΦᵀKΦ and ΦᵀMΦ with respect to p, times Step·p. **/
class ModalDifference {
public:
    ModalDifference(const FeModel& model, const DesignParameter& parameter, const Shapes& Phi,
                    const std::array<std::optional<Shapes>, NumVariants>& moved)
        : m_model(model), m_parameter(parameter), m_Phi(Phi), m_moved(moved) {
        for (const std::optional<Shapes>& motion : moved) m_isMoved |= motion.has_value();
    }

    struct Sum {
        MatrixXd K, M;
    };

    Sum calc() const {
        const Index n = m_Phi.cols();
        std::array<Sum, NumShares> shares;
        const int numElements = m_model.elements->size();
        parallelFor(NumShares, omp_get_max_threads(), Schedule::WhoeverIsFree, [&](int share) {
            Sum& sum = shares[size_t(share)];
            sum.K = sum.M = MatrixXd::Zero(n, n);
            Work work;
            const auto from = std::int64_t(numElements) * share / NumShares,
                       to = std::int64_t(numElements) * (share + 1) / NumShares;
            for (auto e = from; e < to; ++e) addElement(int(e), work, sum);
        });
        Sum total{MatrixXd::Zero(n, n), MatrixXd::Zero(n, n)};
        for (const Sum& sum : shares) total.K += sum.K, total.M += sum.M;
        addOthers(total);
        for (MatrixXd* A : {&total.K, &total.M}) *A = 0.5 * (*A + A->transpose()).eval();
        return total;
    }

private:
    struct Work {
        std::array<ElementPoints, NumVariants> points;
        MatrixXd motion, withoutRigid, strains, stresses, velocities, momenta;
        Eigen::Matrix<double, 6, Eigen::Dynamic> B;
    };

    const Shapes& motionOf(int variant) const {
        return m_moved[size_t(variant)] ? *m_moved[size_t(variant)] : m_Phi;
    }

    /** Fits a + θ × (x − c) to the motion U of nodes at x: one mode per column, 3 + 3 rows. **/
    static MatrixXd fitRigid(const Eigen::Matrix3Xd& arms, const MatrixXd& U) {
        MatrixXd rigid = MatrixXd::Zero(6, U.cols());
        for (Index k = 0; k < arms.cols(); ++k) {
            rigid.topRows<3>() += U.middleRows<3>(3 * k) / double(arms.cols());
            rigid.bottomRows<3>() +=
                calcRigidMotion(arms.col(k)).rightCols<3>().transpose() * U.middleRows<3>(3 * k);
        }
        const Eigen::Matrix3d spread = arms * arms.transpose();
        const Eigen::Matrix3d moments = spread.trace() * Eigen::Matrix3d::Identity() - spread;
        rigid.bottomRows<3>() = moments.ldlt().solve(rigid.bottomRows<3>()).eval();
        return rigid;
    }

    void addElement(int e, Work& work, Sum& sum) const {
        for (int j = 0; j < NumVariants; ++j) {
            const FeModel& variant = m_parameter.variants[size_t(j)];
            variant.elements->calcPoints(e, variant.mesh, work.points[size_t(j)]);
        }
        const ElementPoints &first = work.points.front(), &last = work.points.back();
        const bool hasK = m_isMoved || !first.haveSameStiffness(last),
                   hasM = m_isMoved || !first.haveSameMass(last);
        if (!hasK && !hasM) return;

        // Subtract the rigid motion of the element, which is most of its motion, before computing
        // strains.
        const int* nodes = m_model.elements->nodesOf(e);
        const Index count = m_model.elements->numNodesOf(e), n = m_Phi.cols();
        Eigen::Matrix3Xd arms(3, count);
        MatrixXd U(3 * count, n);
        for (Index k = 0; k < count; ++k) {
            arms.col(k) = positionOf(m_model, nodes[k]);
            U.middleRows<3>(3 * k) = m_Phi.middleRows<3>(3 * nodes[k]);
        }
        const Vector3d center = arms.rowwise().mean();
        arms.colwise() -= center;
        const MatrixXd rigid = fitRigid(arms, U);

        const Index numPoints = Index(work.points[0].points.size());
        work.strains.resize(6 * numPoints * NumVariants, n);
        work.stresses.resize(6 * numPoints * NumVariants, n);
        work.velocities.resize(3 * numPoints * NumVariants, n);
        work.momenta.resize(3 * numPoints * NumVariants, n);
        work.withoutRigid.resize(3 * count, n);
        work.motion.resize(3 * count, n);
        Index at = 0;
        for (int j = 0; j < NumVariants; ++j) {
            const double weight = DesignParameter::Weights[size_t(j)];
            const FeModel& variant = m_parameter.variants[size_t(j)];
            for (Index k = 0; k < count; ++k) {
                const auto moved = motionOf(j).middleRows<3>(3 * nodes[k]);
                work.motion.middleRows<3>(3 * k) = moved;
                work.withoutRigid.middleRows<3>(3 * k) =
                    U.middleRows<3>(3 * k) - calcRigidMotion(arms.col(k)) * rigid;
                const Vector3d shift = positionOf(variant, nodes[k]) - center - arms.col(k);
                work.withoutRigid.middleRows<3>(3 * k) +=
                    moved - U.middleRows<3>(3 * k) -
                    calcRigidMotion(shift).rightCols<3>() * rigid.bottomRows<3>();
            }
            const ElementPoints& points = work.points[size_t(j)];
            for (const ElementPoint& point : points.points) {
                const Eigen::Map<const Eigen::Matrix<double, 6, 6, Eigen::RowMajor>> D(
                    point.D[0].data());
                point.calcStrainMatrix(work.B);
                work.strains.middleRows<6>(6 * at).noalias() = work.B * work.withoutRigid;
                work.stresses.middleRows<6>(6 * at).noalias() =
                    (weight * point.volume) * D * work.strains.middleRows<6>(6 * at);
                auto velocity = work.velocities.middleRows<3>(3 * at);
                velocity.setZero();
                for (Index k = 0; k < count; ++k)
                    velocity += point.N[k] * work.motion.middleRows<3>(3 * k);
                work.momenta.middleRows<3>(3 * at) =
                    (weight * point.volume * point.density) * velocity;
                ++at;
            }
            for (Index l = 0; hasK && l < points.hourglass.cols(); ++l)
                for (Index k = 0; k < points.hourglass.rows(); ++k)
                    sum.K.noalias() += (weight * points.hourglass(k, l)) *
                                       (work.withoutRigid.middleRows<3>(3 * k).transpose() *
                                        work.withoutRigid.middleRows<3>(3 * l));
        }
        if (hasK) sum.K.noalias() += work.strains.transpose() * work.stresses;
        if (hasM) sum.M.noalias() += work.velocities.transpose() * work.momenta;
    }

    /** Adds springs, points, trusses and membranes. **/
    void addOthers(Sum& sum) const {
        const auto &first = m_parameter.variants.front(), &last = m_parameter.variants.back();
        const bool hasK = m_isMoved || first.K.values != last.K.values ||
                          first.mesh.positions != last.mesh.positions,
                   hasM = m_isMoved || first.m.values != last.m.values;
        for (int j = 0; j < NumVariants; ++j) {
            const double weight = DesignParameter::Weights[size_t(j)];
            const FeModel& variant = m_parameter.variants[size_t(j)];
            const Shapes& motion = motionOf(j);
            if (hasK && !variant.K.values.empty())
                sum.K += weight * (motion.transpose() * LowerTriangle(variant.K).multiply(motion));
            if (hasM && !variant.m.values.empty())
                sum.M +=
                    weight * (motion.transpose() * FullRows(variant.m).multiplyPerAxis(motion));
        }
    }

    const FeModel& m_model;
    const DesignParameter& m_parameter;
    const Shapes& m_Phi;
    const std::array<std::optional<Shapes>, NumVariants>& m_moved;
    bool m_isMoved = false;
};

std::vector<double> toNumbers(const MatrixXd& A) {
    return {A.data(), A.data() + A.size()};
}

}  // namespace

std::vector<ReducedBody::Derivative> calcDerivatives(const FeModel& model, const RigidMotion& rigid,
                                                     const InterfaceTies& ties,
                                                     const MeanAxisModes& modes,
                                                     const ProgressCallback& progress) {
    std::vector<ReducedBody::Derivative> derivatives;
    const TiedMotion motion(model, rigid, ties, modes);
    for (const auto& parameter : model.parameters) {
        reportProgress(progress, "derivatives",
                       double(derivatives.size()) / double(model.parameters.size()));
        std::array<std::optional<Shapes>, NumVariants> moved;
        for (size_t j = 0; j < moved.size(); ++j) moved[j] = motion.calc(parameter->variants[j]);
        const auto sum = ModalDifference(model, *parameter, modes.Phi, moved).calc();
        const double step = DesignParameter::Step * parameter->value;
        derivatives.push_back({parameter->name, parameter->unit, parameter->value,
                               toNumbers(sum.K / step), toNumbers(sum.M / step)});
    }
    return derivatives;
}

}  // namespace simflex
