#pragma once
/** @file
Says in words why a system could not be solved, and what to do about it (private header): which
body, coordinate or mode, joint, force or motion, with numbers. Works by evaluations after the
failure; nothing of it is in the way of a step that succeeds. **/

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
        const SolutionPoint& tried;  ///< where the last try stood when it was given up
        double h;
        const ImplicitStep::Outcome& outcome;
        const std::string& fault;  ///< what was said where nothing could be evaluated; else empty
        const std::vector<std::string>& redundancies;  ///< as the last factorization found them
        int numRedundantAtStart;
        bool hasForceJacobians;
        double accuracy;
    };

    /** Forces or positions are not finite numbers, or nothing can be evaluated: whose fault. **/
    std::string explainNonFinite(const FailedStep& step) const;
    std::string explainNonFiniteForces(int block, double t, const std::vector<double>& q,
                                       const std::vector<double>& u) const;
    /** Newton's iteration does not converge however short the step. **/
    std::string explainNoConvergence(const FailedStep& step) const;
    /** The local error is too large however short the step.
    @param error  in units of the accuracy
    @param errorQ, errorU, errorZ  by coordinate **/
    std::string explainLargeError(const FailedStep& step, double error, const double* errorQ,
                                  const double* errorU, const std::vector<double>& errorZ) const;
    /** Positions cannot be brought back onto a joint. **/
    std::string explainNoProjection(const FailedStep& step, int worstRow, double tolerance) const;

    /** The joints cannot be assembled. **/
    std::string explainAssembly(double t, const std::vector<double>& errors, double tolerance,
                                const std::vector<std::string>& redundancies) const;
    /** No speeds satisfy the joints and motions. **/
    std::string explainSpeeds(double t, const std::vector<double>& errors,
                              const std::vector<std::string>& redundancies) const;
    /** A block's matrix is singular or not finite. **/
    std::string explainSingularBlock(int block, const NewtonSystem& system) const;
    /** @param contact  that finds neither stick nor slip; −1: any **/
    std::string explainFriction(int contact) const;

private:
    /** "joint 'a' (error 0.1), joint 'b' (error 0.02)": the largest ones. **/
    std::string listErrors(const std::vector<double>& errors, double tolerance) const;
    /** Whether the joints are nearly dependent at the last good point, and which. **/
    std::string findSingularity(const FailedStep& step) const;
    std::string explainRedundancies(const std::vector<std::string>& redundancies) const;
    /** "mode 3 (34.2 Hz) of 'boom'": where this block moves or errs most. **/
    std::string findWorstCoordinate(int block, const double* errorQ, const double* errorU,
                                    double h) const;

    /** "variable z[0] of 'forces'": the auxiliary one that errs most. **/
    std::string findWorstZ(const std::vector<double>& errorZ) const;

    Evaluation& m_equations;
};

}  // namespace simflex
