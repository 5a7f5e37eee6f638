#include "CraigBampton.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "BlockLanczos.h"
#include "FixedInterfaces.h"
#include "MeanAxis.h"
#include "StaticLoads.h"
#include "simflex/base/Archive.h"
#include "simflex/base/DenseAlgebra.h"
#include "simflex/base/Hash.h"
#include "simflex/fe/NodeSelection.h"

namespace simflex {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

/** Share of an attachment mode's energy below which the normal modes are taken to contain it. **/
constexpr double NothingNew = 1e-12;

[[noreturn]] void refuse(const ReductionOptions& options, const std::string& what) {
    throw std::invalid_argument("part '" + options.name + "': " + what);
}

/** Ξᵀ M Ξ, whose eigenvalues are 1/ω² of the free-free modes of the tied model. Ξ extends Θ by the
energy-orthonormal constraint modes and removes rigid motions in the metric M. **/
class FreeModesOperator : public SymmetricOperator {
public:
    FreeModesOperator(const FeProducts& products, const RigidMotion& rigid,
                      const FixedInterfaces& held, const Shapes& constraint)
        : m_m(products.m), m_held(held), m_R(rigid.R), m_MR(products.m.multiplyPerAxis(rigid.R)) {
        m_RMR = Eigen::LDLT<MatrixXd>(MatrixXd(m_R.transpose() * m_MR));
        if (constraint.cols() <= 6) {
            m_static = Shapes::Zero(constraint.rows(), 0);
            return;
        }
        const MatrixXd K = constraint.transpose() * products.K.multiply(constraint);
        const Eigen::VectorXd scale = K.diagonal().cwiseSqrt().cwiseInverse();
        const SymmetricEigen eigen = calcSymmetricEigen(
            scale.asDiagonal() * (0.5 * (K + K.transpose())) * scale.asDiagonal());
        const Index elastic = K.rows() - 6;
        const MatrixXd orthonormal =
            scale.asDiagonal() * eigen.vectors.rightCols(elastic) *
            eigen.values.tail(elastic).cwiseSqrt().cwiseInverse().asDiagonal();
        m_static = constraint * orthonormal;
    }

    Index size() const override { return m_static.cols() + m_held.size(); }

    /** Returns Ξ x. **/
    Shapes toShapes(const Vectors& X) const {
        Shapes u = m_held.toShapes(X.bottomRows(m_held.size()));
        u.noalias() += m_static * X.topRows(m_static.cols());
        const MatrixXd motions = m_RMR.solve(MatrixXd(m_MR.transpose() * u));
        u -= m_R * motions;
        return u;
    }

    void apply(const Vectors& X, Vectors& Y) const override {
        Shapes f = m_m.multiplyPerAxis(toShapes(X));
        const MatrixXd accelerations = m_RMR.solve(MatrixXd(m_R.transpose() * f));
        f -= m_MR * accelerations;
        Y.resize(X.rows(), X.cols());
        Y.topRows(m_static.cols()) = m_static.transpose() * f;
        Y.bottomRows(m_held.size()) = m_held.fromForces(f);
    }

private:
    const FullRows& m_m;
    const FixedInterfaces& m_held;
    const Shapes& m_R;
    const Shapes m_MR;
    Eigen::LDLT<MatrixXd> m_RMR;
    Shapes m_static;
};

/** Removes the normal modes from the deflections u under the loads and orthonormalises the rest in
energy: u_iᵀKu_j = f_iᵀu_j, since the interfaces are held in all. **/
Shapes makeAttachments(const Shapes& loads, Shapes u, const Shapes& normal) {
    if (loads.cols() == 0) return u;
    const Eigen::VectorXd before = (loads.transpose() * u).diagonal();
    const MatrixXd held = normal.transpose() * loads;
    u -= normal * held;
    // A load on nodes constrained to a rigid interface causes no deflection.
    const Eigen::VectorXd scale =
        before.unaryExpr([](double twice) { return twice > 0 ? 1 / std::sqrt(twice) : 0.0; });
    const SymmetricEigen energy =
        calcSymmetricEigen(scale.asDiagonal() * symmetricGram(loads, u) * scale.asDiagonal());
    const Index kept = (energy.values.array() > NothingNew).count();
    const MatrixXd orthonormal = scale.asDiagonal() * energy.vectors.rightCols(kept) *
                                 energy.values.tail(kept).cwiseSqrt().cwiseInverse().asDiagonal();
    return u * orthonormal;
}

void checkFrequencies(const ReductionOptions& options) {
    for (const double hertz : options.frequencies)
        if (!(hertz > 0) || !std::isfinite(hertz))
            refuse(options, "modes are asked for at " + std::to_string(hertz) +
                                " Hz; a frequency must be positive");
    if (!options.frequencies.empty() && options.interfaces.empty() && options.loadPoints.empty())
        refuse(options,
               "modes at a frequency are of motions of interfaces and forces at load points, and "
               "the part has neither; give one of them");
}

/** Stores the results of phases in the checkpoint and reuses stored ones. **/
class Stages {
public:
    Stages(const FeModel& model, const ReductionOptions& options)
        : m_checkpoint(options.checkpoint) {
        if (!m_checkpoint) return;
        for (const SymmetricMatrix* A : {&model.K, &model.m}) {
            m_key.add(A->columnStarts);
            m_key.add(A->rows);
            m_key.add(A->values);
        }
        m_key.add(model.mesh.positions);
        m_key.add(model.constraints.rowStarts);
        m_key.add(model.constraints.columns);
        m_key.add(model.constraints.coefficients);
        for (const InterfaceOptions& interface : options.interfaces) {
            m_key.add(interface.name);
            m_key.add(selectNodes(model.mesh, interface.nodes));
            m_key.add(interface.tie == TieType::Rigid ? 0.0 : 1.0);
            if (interface.master)
                for (const double x : *interface.master) m_key.add(x);
        }
        for (const LoadPoint& point : options.loadPoints) {
            m_key.add(selectNodes(model.mesh, point.nodes));
            m_key.add(point.axes);
        }
        m_key.add(double(options.numModes));
        m_key.add(options.highestFrequency.value_or(-1));
        m_key.add(double(options.hasInertiaRelief));
        m_key.add(options.frequencies);
        m_key.add(double(options.numFurtherModes));
        m_key.add(options.solver ? 1.0 : 0.0);
    }

    template <class Make>
    void run(const char* name, const std::vector<Shapes*>& shapes,
             const std::vector<Eigen::VectorXd*>& vectors, const Make& make) const {
        if (!m_checkpoint) return make();
        const auto visitAll = [&](Archive& archive) {
            for (Eigen::VectorXd* x : vectors) visit(archive, *x);
            for (Shapes* X : shapes) visit(archive, *X);
        };
        if (m_checkpoint->load(name, m_key.get(), visitAll)) return;
        auto start = std::chrono::steady_clock::now();
        make();
        m_checkpoint->save(name, m_key.get(), lapTime(start), visitAll);
    }

private:
    template <class Matrix>
    static void visit(Archive& archive, Matrix& X) {
        std::int64_t sizes[] = {X.rows(), X.cols()};
        archive.visit(sizes[0], sizes[1]);
        for (const std::int64_t size : sizes)
            if (size < 0 || size > std::numeric_limits<int>::max())
                throw std::runtime_error("a matrix has no size");
        if (Matrix::ColsAtCompileTime == 1 && sizes[1] != 1)
            throw std::runtime_error("a vector has other columns than one");
        if (archive.isReading()) {
            archive.requireLeft(std::uint64_t(sizes[0] * sizes[1]), sizeof(double));
            X.resize(sizes[0], sizes[1]);
        }
        archive.visitBytes(X.data(), size_t(X.size()) * sizeof(double));
    }

    const ReductionCheckpoint* m_checkpoint;
    Hash m_key;
};

/** Returns the number of normal modes wanted and the smallest 1/ω². **/
ModeRange chooseNormalModes(const ReductionOptions& options, int numStatic, Index numFree,
                            bool hasInterfaces) {
    const Index most = numStatic + numFree;
    ModeRange range;
    if (options.highestFrequency) {
        if (!(*options.highestFrequency > 0) || !std::isfinite(*options.highestFrequency))
            refuse(options, "the highest frequency is " +
                                std::to_string(*options.highestFrequency) +
                                " Hz; it must be positive");
        range.smallest = std::pow(2 * M_PI * *options.highestFrequency, -2);
        return range;
    }
    if (options.numModes < std::max(7, numStatic))
        refuse(options,
               std::to_string(options.numModes) +
                   (hasInterfaces ? " modes are too few: interfaces, load points, inertia relief "
                                    "and frequencies need " +
                                        std::to_string(numStatic) +
                                        " static modes, and six rigid modes are taken out"
                                  : std::string(" modes are too few: the six rigid modes are among "
                                                "them")) +
                   "; ask for at least " + std::to_string(std::max(7, numStatic)));
    if (options.numModes > most)
        refuse(options, std::to_string(options.numModes) + " modes are too many: the mesh has " +
                            std::to_string(numFree) + " free degrees of freedom; ask for at most " +
                            std::to_string(most) + ", or refine the mesh");
    range.count = options.numModes - numStatic;
    return range;
}

/** Whether mode k has the frequency of the one before it but for round-off, which then decides what
the modes of the group are. **/
bool isInGroup(const Eigen::VectorXd& omegaSquared, Index k) {
    constexpr double Equal = 1 + 1e-6;  // in ω²
    return k > 0 && k < omegaSquared.size() && omegaSquared[k] < Equal * omegaSquared[k - 1];
}

/** Returns how many of the modes found are kept: those wanted, and the others of a group of equal
frequencies, as of equal bays, unless these are more than all that are wanted: then none of the
group. One more mode is kept if its frequency is within 1 % of the last one's and the next one's is
not: half a pair, such as the bending modes of a round shaft, would make the part asymmetric. **/
Index chooseNumKept(const ModeRange& wanted, const Eigen::VectorXd& omegaSquared) {
    constexpr double Near = 1.02;  // in ω²
    const Index found = omegaSquared.size();
    Index kept = 0;
    while (kept < std::min<Index>(found, wanted.count) && omegaSquared[kept] * wanted.smallest <= 1)
        ++kept;
    Index first = kept, end = kept;
    while (isInGroup(omegaSquared, end)) ++end;
    if (end > kept) {
        while (isInGroup(omegaSquared, first)) --first;
        return end > 2 * kept && first > 0 ? first : end;
    }
    const auto isTwin = [&](Index k) {
        return k > 0 && k < found && omegaSquared[k] < Near * omegaSquared[k - 1];
    };
    return isTwin(kept) && !isTwin(kept + 1) ? kept + 1 : kept;
}

/** Finds the modes wanted, and those that chooseNumKept() compares with. **/
FixedInterfaces::NormalModes calcModesOf(const FixedInterfaces& held, const ModeRange& wanted,
                                         const ProgressCallback& progress) {
    constexpr double Beyond = 1.05;  // in ω²
    ModeRange range = wanted;
    range.smallest /= Beyond;
    for (int more = 2;; more *= 8) {
        if (wanted.count < held.size())
            range.count = int(std::min<Index>(held.size(), Index(wanted.count) + more));
        FixedInterfaces::NormalModes modes = held.calcNormalModes(range, progress);
        const Index found = modes.omegaSquared.size();
        const bool isWholeGroup = found < range.count || found == held.size() ||
                                  found > 2 * Index(wanted.count) ||
                                  !isInGroup(modes.omegaSquared, found - 1) ||
                                  chooseNumKept(wanted, modes.omegaSquared) < found;
        if (isWholeGroup) return modes;
    }
}

}  // namespace

double lapTime(std::chrono::steady_clock::time_point& start) {
    const auto now = std::chrono::steady_clock::now();
    const double seconds = std::chrono::duration<double>(now - start).count();
    start = now;
    return seconds;
}

ModeBasis calcCraigBamptonBasis(const FeModel& model, const FeProducts& products,
                                const RigidMotion& rigid, const InterfaceTies& ties,
                                const ReductionOptions& options, const ProgressCallback& progress,
                                ReductionTimings& timings) {
    auto lap = std::chrono::steady_clock::now();
    reportProgress(progress, "ordering K", -1);
    const Shapes pointLoads = makePointLoads(model, ties, options);
    if (options.solver && (options.numCheckedModes > 0 || !options.frequencies.empty()))
        refuse(options,
               std::string(options.numCheckedModes > 0 ? "frequencies of the full model are checked"
                                                       : "modes at a frequency are found") +
                   " by the library's own solver alone; leave that out");
    checkFrequencies(options);
    const auto held = std::make_shared<FixedInterfaces>(options.name, model, products, rigid, ties);
    const bool hasInterfaces = !ties.ties().empty();
    const int numConstraint = hasInterfaces ? ties.numBoundaryDofs() : 6;
    const int numPerFrequency = ties.numBoundaryDofs() + int(pointLoads.cols());
    const int numInertia = options.hasInertiaRelief ? countInertiaLoads(hasInterfaces) : 0;
    const int numLoads =
        int(pointLoads.cols()) + numInertia + int(options.frequencies.size()) * numPerFrequency;
    const bool isFiner = options.numFurtherModes > 0;
    const int numFurtherLoads =
        isFiner && !options.hasInertiaRelief ? countInertiaLoads(hasInterfaces) : 0;
    held->factor(options.numModes + options.numFurtherModes + numFurtherLoads, options, progress);
    const ModeRange wanted =
        chooseNormalModes(options, numConstraint + numLoads, held->size(), hasInterfaces);
    timings.factor = lapTime(lap);
    timings.numFactorEntries = held->numFactorEntries();

    reportProgress(progress, "constraint modes", -1);
    const Stages stages(model, options);
    Shapes constraint, loads, deflection;
    stages.run("constraint modes", {&constraint, &loads, &deflection}, {}, [&] {
        constraint = hasInterfaces ? held->calcConstraintModes() : rigid.R;
        loads.resize(model.K.size, numLoads + numFurtherLoads);
        Index next = 0;
        const auto add = [&](const Shapes& some) {
            loads.middleCols(next, some.cols()) = some;
            next += some.cols();
        };
        add(pointLoads);
        if (numInertia > 0) add(makeInertiaLoads(model, products, rigid, hasInterfaces));
        for (const double hertz : options.frequencies)
            add(makeFrequencyLoads(options.name, products, *held,
                                   constraint.leftCols(ties.numBoundaryDofs()), pointLoads, hertz,
                                   progress));
        if (numFurtherLoads > 0) add(makeInertiaLoads(model, products, rigid, hasInterfaces));
        deflection = held->solve(loads);
    });
    timings.constraintModes = lapTime(lap);

    reportProgress(progress, "normal modes", -1);
    FixedInterfaces::NormalModes normal;
    stages.run("normal modes", {&normal.shapes}, {&normal.omegaSquared},
               [&] { normal = calcModesOf(*held, wanted, progress); });
    const Index numNormal = chooseNumKept(wanted, normal.omegaSquared);
    const bool isLacking =
        !options.highestFrequency && normal.omegaSquared.size() < Index(wanted.count);
    normal.omegaSquared.conservativeResize(numNormal);
    normal.shapes = normal.shapes.leftCols(numNormal).eval();
    timings.numLanczosBlocks = normal.numBlocks;
    const auto join = [&](Index loadsTaken, const FixedInterfaces::NormalModes& modes) {
        const Shapes attachments = makeAttachments(loads.leftCols(loadsTaken),
                                                   deflection.leftCols(loadsTaken), modes.shapes);
        ModeBasis basis;
        const Index numModes = numConstraint + attachments.cols() + modes.shapes.cols();
        if (numModes < 7)
            refuse(options,
                   "no elastic mode is left; raise the highest frequency or the number of "
                   "modes");
        basis.numConstraint = numConstraint;
        basis.numAttachment = int(attachments.cols());
        basis.normalOmegaSquared = modes.omegaSquared;
        basis.Psi.resize(model.K.size, numModes);
        basis.Psi << constraint, attachments, modes.shapes;
        basis.boundary = Shapes::Zero(ties.numBoundaryDofs(), numModes);
        basis.boundary.leftCols(ties.numBoundaryDofs()).setIdentity();
        basis.held = held;
        if (hasInterfaces) {
            const Shapes MR = products.m.multiplyPerAxis(rigid.R);
            const MatrixXd shares = MR.transpose() * modes.shapes;
            basis.effectiveMasses = shares.cwiseAbs2() * basis.normalOmegaSquared.asDiagonal();
        }
        return basis;
    };
    ModeBasis basis = join(numLoads, normal);
    if (isLacking)
        basis.lack = std::to_string(wanted.count) +
                     " normal modes are asked for, but the mesh has only " +
                     std::to_string(numNormal) + ": ask for fewer modes or refine the mesh";
    if (!options.highestFrequency && numNormal > wanted.count)
        basis.group = std::to_string(numNormal) + " normal modes are taken instead of " +
                      std::to_string(wanted.count) +
                      ", since the frequencies of the last ones are the same";
    if (isFiner && !isLacking) {
        ModeRange more;
        more.count = int(std::min<Index>(numNormal + options.numFurtherModes, held->size()));
        FixedInterfaces::NormalModes all;
        stages.run("further normal modes", {&all.shapes}, {&all.omegaSquared},
                   [&] { all = held->calcNormalModes(more, progress); });
        basis.finer = std::make_shared<const ModeBasis>(join(loads.cols(), all));
    }
    timings.normalModes = lapTime(lap);
    return basis;
}

std::vector<StaticError> calcStaticErrors(const FeModel& model, const FeProducts& products,
                                          const RigidMotion& rigid, const InterfaceTies& ties,
                                          const ReductionOptions& options, const ModeBasis& basis,
                                          const MeanAxisModes& modes) {
    const EquilibriumLoads loads =
        makeEquilibriumLoads(model, products, rigid, ties, makePointLoads(model, ties, options),
                             listPointLoads(options));
    const EquilibriumShapes full = solveEquilibrium(products, ties, basis, loads);
    const MatrixXd forces =
        modes.Phi.transpose() * loads.applied + modes.boundary.transpose() * loads.onTies;
    std::vector<StaticError> errors;
    for (Index k = 0; k < loads.applied.cols(); ++k) {
        const double whole = loads.applied.col(k).dot(full.u.col(k)) +
                             loads.onTies.col(k).dot(full.boundary.col(k)),
                     held = (forces.col(k).array().square() / modes.omegaSquared.array()).sum();
        if (whole > 0) errors.push_back({loads.names[size_t(k)], 1 - held / whole});
    }
    return errors;
}

std::vector<double> calcFullFrequencies(const FeProducts& products, const RigidMotion& rigid,
                                        const ModeBasis& basis, int count,
                                        const ProgressCallback& progress) {
    const FreeModesOperator C(products, rigid, *basis.held,
                              basis.Psi.leftCols(basis.numConstraint));
    ModeRange range;
    range.count = int(std::min<Index>(count, C.size()));
    const Eigenpairs pairs =
        calcLargestEigenpairs(C, range, "frequencies of the full model", progress);
    const Shapes phi = C.toShapes(pairs.vectors);
    const Shapes Kphi = products.K.multiply(phi), Mphi = products.m.multiplyPerAxis(phi);
    std::vector<double> hertz;
    for (Index k = 0; k < phi.cols(); ++k)
        hertz.push_back(std::sqrt(phi.col(k).dot(Kphi.col(k)) / phi.col(k).dot(Mphi.col(k))) /
                        (2 * M_PI));
    std::sort(hertz.begin(), hertz.end());
    return hertz;
}

}  // namespace simflex
