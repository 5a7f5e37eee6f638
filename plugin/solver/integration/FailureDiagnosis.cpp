#include "simflex/solver/integration/FailureDiagnosis.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <sstream>

#include "simflex/base/DenseAlgebra.h"

namespace simflex {

std::string FailureDiagnosis::listErrors(const std::vector<double>& errors,
                                         double tolerance) const {
    constexpr size_t Most = 3;
    // Largest error of each joint.
    std::vector<std::pair<double, std::string>> worst;
    for (size_t row = 0; row < errors.size(); ++row) {
        const double error = std::abs(errors[row]);
        if (error <= tolerance) continue;
        const std::string name = m_equations.getTopology().describeConstraint(int(row));
        const auto same = std::find_if(worst.begin(), worst.end(),
                                       [&](const auto& entry) { return entry.second == name; });
        if (same == worst.end())
            worst.emplace_back(error, name);
        else if (!(same->first >= error))
            same->first = error;
    }
    std::stable_sort(worst.begin(), worst.end(),
                     [](const auto& a, const auto& b) { return a.first > b.first; });
    std::ostringstream text;
    for (size_t k = 0; k < std::min(worst.size(), Most); ++k)
        text << (k > 0 ? ", " : "") << worst[k].second << " keeps an error of " << worst[k].first;
    if (worst.size() > Most) text << " and " << worst.size() - Most << " more";
    return text.str();
}

std::string FailureDiagnosis::explainRedundancies(
    const std::vector<std::string>& redundancies) const {
    constexpr size_t Most = 3;
    std::string text;
    for (size_t k = 0; k < std::min(redundancies.size(), Most); ++k)
        text += (k > 0 ? "; " : "") + redundancies[k];
    if (redundancies.size() > Most)
        text += " and " + std::to_string(redundancies.size() - Most) + " more";
    return text;
}

std::string FailureDiagnosis::explainAssembly(double t, const std::vector<double>& errors,
                                              double tolerance,
                                              const std::vector<std::string>& redundancies) const {
    std::ostringstream text;
    text << "the joints cannot be assembled at t = " << t << " s: " << listErrors(errors, tolerance)
         << " (allowed " << tolerance << " m or rad)";
    if (redundancies.empty())
        text << "; check the attachment frames, or start closer to an assembled position";
    else
        text << ". They contradict each other: " << explainRedundancies(redundancies)
             << ". Leave one of these joints or motions out, or make their frames agree";
    return text.str();
}

std::string FailureDiagnosis::listSpeedErrors(const std::vector<double>& errors) const {
    double largest = 0;
    for (const double error : errors) largest = std::max(largest, std::abs(error));
    return listErrors(errors, 0.01 * largest) + " m/s or rad/s";
}

std::string FailureDiagnosis::explainSpeeds(double t, const std::vector<double>& errors,
                                            const std::vector<std::string>& redundancies) const {
    std::ostringstream text;
    text << "no speeds satisfy the joints at t = " << t << " s: " << listSpeedErrors(errors);
    if (!redundancies.empty())
        text << ". Motions or locks contradict each other: " << explainRedundancies(redundancies);
    text << ". Leave one of the motions out, or give them speeds that agree";
    return text.str();
}

std::string FailureDiagnosis::explainFriction(int contact) const {
    const Topology& topology = m_equations.getTopology();
    return topology.describeConstraint(topology.frictions[size_t(contact)].firstRow) +
           " finds neither sticking nor sliding that agrees with the reaction it causes: a joint "
           "that is self-locking or reverses its own load, or a load that several joints share in "
           "more than one way; smaller coefficients, a flexible part, or friction in fewer of them "
           "make it unique";
}

std::string FailureDiagnosis::explainSingularBlock(int block, const NewtonSystem& system) const {
    const NewtonSystem::Block& values = system.blocks[size_t(block)];
    const auto isFinite = [](const std::vector<double>& numbers) {
        return std::all_of(numbers.begin(), numbers.end(),
                           [](double value) { return std::isfinite(value); });
    };
    const std::string& name = m_equations.getBlock(block).name;
    if (!isFinite(values.matrix) || !isFinite(values.head) || !isFinite(values.coupling) ||
        !isFinite(values.tree.inertia) || !isFinite(values.tree.motions) || !isFinite(values.Gt))
        return "the Newton matrix of '" + name +
               "' is not finite: check the mass of its bodies, and forces and motions that may "
               "return numbers that are not";
    const std::string culprit = findMassless(*m_equations.updBlocks().all[size_t(block)]);
    if (!culprit.empty())
        return "the mass matrix of '" + name + "' is singular: " + culprit +
               " has no mass or inertia to move; give its body mass and inertia, or weld it to "
               "its parent";
    return "the Newton matrix of '" + name +
           "' is singular: a spring of negative stiffness outweighs its inertia, or it turns or "
           "flies away too fast for the step; limit the step (setMaximumStepSize()), the stiffness "
           "or the speed";
}

std::string FailureDiagnosis::findWorstCoordinate(int b, const double* errorQ, const double* errorU,
                                                  double h) const {
    const Block& block = m_equations.getBlock(b);
    std::vector<double> alone(size_t(std::max(block.numQ, block.numU)), 0);
    double largest = -1;
    std::string worst = "'" + block.name + "'";
    for (int i = 0; errorQ && i < block.numQ; ++i) {
        alone[size_t(i)] = errorQ[block.firstQ + i];
        const double size = block.calcQDisplacement(alone.data());
        alone[size_t(i)] = 0;
        if (!(size > largest)) continue;
        largest = size;
        worst = block.describeCoordinate(i);
    }
    for (int i = 0; i < block.numU; ++i) {
        alone[size_t(i)] = errorU[block.firstU + i];
        const double size = block.calcUDisplacement(alone.data(), h);
        alone[size_t(i)] = 0;
        if (!(size > largest)) continue;
        largest = size;
        worst = block.describeSpeed(i);
    }
    return worst;
}

std::string FailureDiagnosis::explainNonFinite(const FailedStep& step) const {
    const double t = step.tried.t;
    const bool isThere =
        findNonFinite(m_equations, t, step.last.q.data(), step.last.u.data()).empty();
    const SolutionPoint& point = isThere ? step.tried : step.last;
    if (step.fault.empty() || !isThere)
        return explainNonFiniteForces(step.outcome.worstBlock, t, point.q, point.u);
    return step.fault.substr(0, step.fault.find('\n'));
}

std::string FailureDiagnosis::explainNonFiniteForces(int block, double t,
                                                     const std::vector<double>& q,
                                                     const std::vector<double>& u) const {
    const std::string& name = m_equations.getBlock(block).name;
    const std::string culprit = findNonFinite(m_equations, t, q.data(), u.data());
    if (culprit.empty())
        return "forces or positions of '" + name +
               "' are not finite numbers. They overflow in the iteration: is a stiffness or load "
               "too large, or a mass too small?";
    return "forces or positions of '" + name + "' are not finite numbers: " + culprit +
           ". Let it return finite numbers for every time and position";
}

std::string FailureDiagnosis::explainLargeError(const FailedStep& step, double error,
                                                const double* errorQ, const double* errorU,
                                                const std::vector<double>& errorZ) const {
    int worst = 0;
    ErrorNorm& norm = m_equations.updErrorNorm();
    const bool isOfZ =
        norm.calcZSize(errorZ.data()) > norm.calcSize(errorQ, errorU, step.h, &worst);
    std::ostringstream text;
    text << "the local error stays at " << error * step.accuracy
         << (norm.isInMetres() && !isOfZ ? " m" : "") << " (allowed " << step.accuracy
         << "), most of it in "
         << (isOfZ ? findWorstZ(errorZ) : findWorstCoordinate(worst, errorQ, errorU, step.h));
    const std::string jump =
        findMotionJump(m_equations, step.last.t, step.h, step.last.q.data(), step.last.u.data());
    if (!jump.empty())
        text << ". " << jump << ": let it change smoothly";
    else
        text << ". Something there jumps or is noisy: let loads and motions change smoothly, or "
                "allow a larger error by setAccuracy() or shorter steps by setMinimumStepSize()";
    return text.str();
}

std::string FailureDiagnosis::findWorstZ(const std::vector<double>& errorZ) const {
    const auto isLess = [](double a, double b) { return std::abs(a) < std::abs(b); };
    const int worst = int(std::max_element(errorZ.begin(), errorZ.end(), isLess) - errorZ.begin());
    const SimTK::State& state = m_equations.getSimbody().getState();
    for (SimTK::SubsystemIndex s(0); s < state.getNumSubsystems(); ++s) {
        const int local = worst - int(state.getZStart(s));
        if (local >= 0 && local < state.getNZ(s))
            return "variable z[" + std::to_string(local) + "] of '" + state.getSubsystemName(s) +
                   "'";
    }
    return "a variable z";
}

std::string FailureDiagnosis::explainNoProjection(const FailedStep& step, int worstRow,
                                                  double tolerance) const {
    if (!std::isfinite(step.tried.constraintError)) return explainNonFinite(step);
    std::ostringstream text;
    text << m_equations.getTopology().describeConstraint(worstRow) << " keeps an error of "
         << step.tried.constraintError << " (allowed " << tolerance << ")"
         << explainConstraints(
                step,
                ". Round-off may be larger than that: allow more by setConstraintTolerance()");
    return text.str();
}

std::string FailureDiagnosis::explainNoSpeeds(const FailedStep& step,
                                              const std::vector<double>& errors) const {
    if (!std::all_of(errors.begin(), errors.end(), [](double e) { return std::isfinite(e); }))
        return explainNonFinite(step);
    return listSpeedErrors(errors) +
           explainConstraints(step,
                              ". The joints' directions change too much in such a step, as near a "
                              "singular position: allow shorter steps");
}

std::string FailureDiagnosis::explainConstraints(const FailedStep& step,
                                                 const char* otherwise) const {
    const std::string jump =
        findMotionJump(m_equations, step.last.t, step.h, step.last.q.data(), step.last.u.data());
    if (!jump.empty()) return ". " + jump + ": let it change smoothly";
    const std::string singularity = findSingularity(step);
    return singularity.empty() ? otherwise : singularity;
}

std::string FailureDiagnosis::findSingularity(const FailedStep& step) const {
    constexpr const char* Advice =
        ". Start beside it, drive another joint, keep motions within reach, or let a part bend";
    if (int(step.redundancies.size()) > step.numRedundantAtStart)
        return ". This is a singular position: " + explainRedundancies(step.redundancies) + Advice;
    // Smallest eigenvalue of G M⁻¹Gᵀ, scaled to a unit diagonal, after those of redundancies.
    constexpr int MostRows = 500;
    constexpr double Redundant = 1e-12, Singular = 1e-6, Involved = 0.1;
    NewtonSystem system = m_equations.getTopology().makeNewtonSystem();
    const int m = m_equations.getTopology().firstFrictionRow;
    if (m == 0 || m > MostRows) return "";
    const SolutionPoint& last = step.last;
    std::vector<double> residual(last.u.size());
    m_equations.realize(last.t, last.q.data(), last.u.data());
    m_equations.calcResidual(last.q.data(), last.u.data(), last.uDot.data(), last.lambda.data(),
                             residual.data());
    m_equations.formMassSystem(system);
    Eigen::MatrixXd S = Eigen::MatrixXd::Zero(m, m);
    for (const NewtonSystem::Block& block : system.blocks) {
        const int n = block.size, columns = block.numColumns();
        Eigen::MatrixXd Gt(n, columns), M = Eigen::MatrixXd::Identity(n, n);
        system.expandGt(block, Gt.data());
        if (block.form == NewtonSystem::Block::Form::Arrow) {
            M.topLeftCorner<6, 6>() = Eigen::Map<const Eigen::MatrixXd>(block.head.data(), 6, 6);
            M.bottomLeftCorner(n - 6, 3) =
                Eigen::Map<const Eigen::MatrixXd>(block.coupling.data(), n - 6, 3);
            M.topRightCorner(3, n - 6) = M.bottomLeftCorner(n - 6, 3).transpose();
        } else {
            M = Eigen::Map<const Eigen::MatrixXd>(block.matrix.data(), n, n);
        }
        const Eigen::MatrixXd part = Gt.transpose() * solveEachSymmetric(M, Gt);
        for (int i = 0; i < columns; ++i)
            for (int j = 0; j < columns; ++j)
                if (block.rows[size_t(i)] < m && block.rows[size_t(j)] < m)
                    S(block.rows[size_t(i)], block.rows[size_t(j)]) += part(i, j);
    }
    if (!S.allFinite()) return "";
    const double smallest = 1e-20 * S.diagonal().maxCoeff();
    Eigen::VectorXd scale(m);
    for (int i = 0; i < m; ++i) scale[i] = S(i, i) > smallest ? 1 / std::sqrt(S(i, i)) : 0;
    S = scale.asDiagonal() * S * scale.asDiagonal();
    const SymmetricEigen eigen = calcSymmetricEigen(S);
    int k = step.numRedundantAtStart;
    while (k < m && !(eigen.values[k] > Redundant)) ++k;
    if (k > step.numRedundantAtStart) --k;
    if (k >= m || eigen.values[k] > Singular) return "";
    std::vector<std::string> names;
    for (int i = 0; i < m; ++i) {
        const std::string name = m_equations.getTopology().describeConstraint(i);
        if (std::abs(eigen.vectors(i, k)) > Involved &&
            !std::count(names.begin(), names.end(), name))
            names.push_back(name);
    }
    std::string text = ". This is close to a singular position, where the equations of ";
    for (size_t i = 0; i < names.size(); ++i)
        text += (i == 0 ? "" : i + 1 == names.size() ? " and " : ", ") + names[i];
    return text + " depend on each other" + Advice;
}

std::string FailureDiagnosis::explainNoConvergence(const FailedStep& step) const {
    const ImplicitStep::Outcome& outcome = step.outcome;
    const Block& block = m_equations.getBlock(outcome.worstBlock);
    std::ostringstream text;
    text << "worst body '" << block.name << "' moves by " << outcome.displacementChange
         << " m in the last iteration";
    // Rows beyond the multipliers belong to force elements.
    const int row = outcome.worstRow;
    if (row >= 0 && row < m_equations.getTopology().numMultipliers)
        text << ", " << m_equations.getTopology().describeConstraint(row) << " has residual "
             << outcome.constraintResidual;
    if (const int undecided = m_equations.getFrictions().findUndecided(); undecided >= 0)
        return text.str() + ": " + explainFriction(undecided);
    const double *q = step.last.q.data(), *u = step.last.u.data();
    const std::string jump = findMotionJump(m_equations, step.last.t, step.h, q, u);
    if (!jump.empty()) {
        text << ". " << jump << ": let it change smoothly";
        return text.str();
    }
    const std::string singularity = findSingularity(step);
    if (!singularity.empty()) return text.str() + singularity;
    const std::string foreign =
        findLargestForeignForce(m_equations, step.last.t, q, u, outcome.worstBlock);
    const std::string element =
        findLargestElement(m_equations, step.last.t, q, u, outcome.worstBlock);
    if (!foreign.empty() && !step.hasForceJacobians)
        text << ". The Newton matrix lacks what is stiff in Simbody's own forces, here " << foreign
             << ": tell it by addForceJacobian(), or use an element of simflex/forces";
    else if (!element.empty())
        text << ". The largest force there is that of " << element
             << ": too stiff a spring or stop, or a load that changes faster than the step can "
                "follow; reduce its stiffness, or give it damping";
    else
        text << ". A singular position, a joint against another or a load that changes faster than "
                "the step can follow are usual causes: look at the bodies there just before";
    return text.str();
}

}  // namespace simflex
