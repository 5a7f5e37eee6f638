#pragma once
/** @file
Accelerations and multipliers at one point of a solution (private header). Its q, u and z are as
accurate as the steps; u̇ and λ come from polynomials through a few points, or from the scheme at a
step's end, and satisfy neither the loads at its time nor g̈ = 0. The residuals

    r = M u̇ + b − f + Gᵀλ,    g̈ = G u̇ + Ġ u + …

are removed by one correction with the Newton matrix of a step, formed at the point:

    [ J  Gᵀ ] [mass·Δu̇]     [    r    ]
    [ G  0  ] [  Δλ    ] = − [ mass·g̈ ],    J = M/mass + D + stiffness·K

Where a step resolves the vibrations, J is M/mass: u̇ and λ are those of this q, u and load,
independent of previous values, at the order of the states. A mode that is stiff relative to the
step (mass·stiffness·Ω² ≫ 1) is in equilibrium within the error of q: an error of 1e-6 m there would
mean an acceleration of Ω²·1e-6 m, and a corresponding reaction. It is treated as the small
displacement that it is, as in position projection, which uses the same norm.

Its matrices are its own, so that calls do not affect later steps. **/

#include <memory>

#include "simflex/solver/BlockEliminationSolver.h"
#include "simflex/solver/equations/Evaluation.h"
#include "simflex/solver/integration/SolutionHistory.h"

namespace simflex {

class PointBalance {
public:
    struct Options {
        bool isDense = false;        ///< see Evaluation::formNewtonSystem()
        bool isRedundant = false;    ///< redundant constraints in the steps: λ of least norm
        bool hasLateBlocks = false;  ///< as in the solver of the steps
        int numThreads = 1;
    };

    explicit PointBalance(Evaluation& equations) : m_equations(equations) {}

    /** Corrects u̇ and λ of a point.
    @param factors  of a step as long as those about the point
    @throws std::runtime_error that names a body if its matrix is singular **/
    void calc(const NewtonFactors& factors, const Options& options, SolutionPoint& point);

private:
    struct Matrices {
        explicit Matrices(NewtonSystem newtonSystem)
            : system(std::move(newtonSystem)), solver(system) {}
        NewtonSystem system;
        BlockEliminationSolver solver;
    };
    void factor(const Options& options);

    Evaluation& m_equations;
    std::unique_ptr<Matrices> m_matrices;  ///< from the first point on
};

}  // namespace simflex
