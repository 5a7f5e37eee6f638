#pragma once
/** @file
Explains why a system could not be solved, and suggests remedies (private header): names body,
coordinate or mode, joint, force or motion, with numbers. Evaluations take place after the failure,
at no cost to successful steps. **/

#include <string>
#include <vector>

#include "simflex/solver/ImplicitIntegrator.h"
#include "simflex/solver/equations/Diagnosis.h"
#include "simflex/solver/integration/ImplicitStep.h"

namespace simflex {

class FailureDiagnosis {
public:
    explicit FailureDiagnosis(Evaluation& equations) : m_equations(equations) {}

    /** A step that failed, from the last good point. **/
    struct FailedStep {
        const SolutionPoint& last;   ///< the last good point
        const SolutionPoint& tried;  ///< state of the last attempt when it was abandoned
        double h;
        const ImplicitStep::Outcome& outcome;
        const std::string& fault;  ///< message of a failed evaluation; else empty
        const std::vector<std::string>& redundancies;  ///< found by the last factorization
        int numRedundantAtStart;
        bool hasForceJacobians;
        double accuracy;
    };

    /** Forces or positions are not finite, or cannot be evaluated: names the cause. **/
    std::string explainNonFinite(const FailedStep& step) const;
    std::string explainNonFiniteForces(int block, double t, const std::vector<double>& q,
                                       const std::vector<double>& u) const;
    /** Newton's method does not converge at any step size. **/
    std::string explainNoConvergence(const FailedStep& step) const;
    /** The local error is too large at any step size.
    @param error  in units of the accuracy
    @param errorQ, errorU, errorZ  by coordinate **/
    std::string explainLargeError(const FailedStep& step, double error, const double* errorQ,
                                  const double* errorU, const std::vector<double>& errorZ) const;
    /** Positions cannot be projected onto a joint. **/
    std::string explainNoProjection(const FailedStep& step, int worstRow, double tolerance) const;
    /** Speeds cannot be.
    @param errors  of all constraints [m/s, rad/s] **/
    std::string explainNoSpeeds(const FailedStep& step, const std::vector<double>& errors) const;

    /** The joints cannot be assembled. **/
    std::string explainAssembly(double t, const std::vector<double>& errors, double tolerance,
                                const std::vector<std::string>& redundancies) const;
    /** No speeds satisfy the joints and motions. **/
    std::string explainSpeeds(double t, const std::vector<double>& errors,
                              const std::vector<std::string>& redundancies) const;
    /** A block's matrix is singular or not finite. **/
    std::string explainSingularBlock(int block, const NewtonSystem& system) const;
    /** A contact finds neither stick nor slip. **/
    std::string explainFriction(int contact) const;

private:
    /** "joint 'a' keeps an error of 0.1, joint 'b' keeps an error of 0.02": the largest ones. **/
    std::string listErrors(const std::vector<double>& errors, double tolerance) const;
    /** The same for speeds: the largest, down to a hundredth of it. **/
    std::string listSpeedErrors(const std::vector<double>& errors) const;
    /** Why constraints cannot be satisfied: a motion that jumps, a singular position, or else
    `otherwise`. **/
    std::string explainConstraints(const FailedStep& step, const char* otherwise) const;
    /** Whether the joints are nearly dependent at the last good point, and which. **/
    std::string findSingularity(const FailedStep& step) const;
    std::string explainRedundancies(const std::vector<std::string>& redundancies) const;
    /** "mode 3 (34.2 Hz) of 'boom'": speed with the largest motion or error of this block. **/
    std::string findWorstCoordinate(int block, const double* errorQ, const double* errorU,
                                    double h) const;

    /** "variable z[0] of 'forces'": auxiliary variable with the largest error. **/
    std::string findWorstZ(const std::vector<double>& errorZ) const;

    Evaluation& m_equations;
};

}  // namespace simflex
