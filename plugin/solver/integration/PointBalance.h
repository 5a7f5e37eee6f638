#pragma once
/** @file
Accelerations and multipliers at one point of a solution (private header). Its q, u and z are as
good as the steps; its u̇ and λ come from polynomials through a few points, or from the scheme at a
step's end, and know nothing of the loads at its time, nor that g̈ = 0. What they miss there,

    r = M u̇ + b − f + Gᵀλ,    g̈ = G u̇ + Ġ u + …

one correction makes up, with the Newton matrix of a step, formed at the point:

    [ J  Gᵀ ] [mass·Δu̇]     [    r    ]
    [ G  0  ] [  Δλ    ] = − [ mass·g̈ ],    J = M/mass + D + stiffness·K

Where a step resolves what vibrates, J is M/mass: u̇ and λ are those of this q and u and this load,
whatever was known of them before, and of the order of the states. A mode that is stiff against the
step (mass·stiffness·Ω² ≫ 1) is in equilibrium but for what q leaves open: an error of 1e-6 m there
would be an acceleration of Ω²·1e-6 m, and a reaction of as many newtons. It is counted as the small
displacement that it is, as in projections of positions, whose norm is the same.

It has matrices of its own: whatever is looked at, the steps to come are the same. **/

#include <memory>

#include "simflex/solver/BlockEliminationSolver.h"
#include "simflex/solver/equations/Evaluation.h"
#include "simflex/solver/integration/SolutionHistory.h"

namespace simflex {

class PointBalance {
public:
    struct Options {
        bool isDense = false;        ///< see Evaluation::formNewtonSystem()
        bool isRedundant = false;    ///< constraints were so in the steps: λ is that of least norm
        bool hasLateBlocks = false;  ///< as the solver of the steps
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
