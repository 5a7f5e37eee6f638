#pragma once
/** @file
The equations of one implicit step (private header) in the unknowns u and λ, by a StepFormula:

    q(u),  u̇(u),    r = M u̇ + b − f + Gᵀλ,    c = ġ  or  g/stiffness **/

#include <vector>

#include "simflex/solver/equations/Evaluation.h"
#include "simflex/solver/equations/StepFormula.h"

namespace simflex {

class StepEquations {
public:
    explicit StepEquations(Evaluation& equations);

    /** Writes the q and u̇ that follow from u, and prescribed u; realizes the equations there and
    writes position errors to system.c. **/
    void arrive(const StepFormula& formula, std::vector<double>& u, std::vector<double>& q,
                std::vector<double>& uDot, NewtonSystem& system);

    /** The same, and evaluates r and c there.
    @param level   of c: Velocity or Position, see Evaluation::calcStepErrors()
    @param finish  called for each block when its part of r is complete, from several threads **/
    void evaluate(const StepFormula& formula, MotionLevel level, const std::vector<double>& lambda,
                  const std::vector<double>& z, const Evaluation::BlockVisit& finish,
                  std::vector<double>& u, std::vector<double>& q, std::vector<double>& uDot,
                  NewtonSystem& system);

    /** @name evaluate() in two steps
    z may be corrected in between, if the equations have states. **/
    /**@{**/
    /** Writes the q that follows from u, and prescribed u, and realizes the equations there. **/
    void realize(const StepFormula& formula, const std::vector<double>& z, std::vector<double>& u,
                 std::vector<double>& q);
    /** Writes u̇, r and c. **/
    void calcResidual(const StepFormula& formula, MotionLevel level,
                      const std::vector<double>& lambda, const Evaluation::BlockVisit& finish,
                      const std::vector<double>& q, const std::vector<double>& u,
                      std::vector<double>& uDot, NewtonSystem& system);
    /**@}**/

    /** (u − u_hist)/mass, or the prescribed value. **/
    void calcUDot(const StepFormula& formula, const std::vector<double>& q,
                  const std::vector<double>& u, std::vector<double>& uDot) const;

private:
    void calcQ(const StepFormula& formula, const std::vector<double>& u, std::vector<double>& q);
    /** The same of one block, and u̇. **/
    void placeBlock(const StepFormula& formula, const Block& block, const double* u, double* q);
    void placeBlock(const StepFormula& formula, const Block& block, const double* u, double* q,
                    double* uDot);

    Evaluation& m_equations;
    std::vector<double> m_delta;
};

}  // namespace simflex
