// Exact accelerations of a native Simbody run, by block elimination:
//
//     M u̇ + Gᵀλ = f − b,   G u̇ = −Ġu − …        (J = M)
//
// Simbody's M_s u̇ + Gᵀλ = f − b − ΔM u̇ then has the same solution.

#include <cmath>
#include <mutex>

#include "simflex/body/FlexibleBody.h"
#include "simflex/body/InertiaCoupling.h"
#include "simflex/solver/BlockEliminationSolver.h"
#include "simflex/solver/equations/Evaluation.h"

namespace simflex {
namespace {

using namespace SimTK;

/** Settings of a State that determine the structure of the equations: enabled constraints, locks
 * and Motions, Euler angles, geometric stiffening. **/
std::vector<char> findConfiguration(const MultibodySystem& system, const State& state) {
    const SimbodyMatterSubsystem& matter = system.getMatterSubsystem();
    std::vector<char> configuration{char(matter.getUseEulerAngles(state))};
    for (ConstraintIndex i(0); i < matter.getNumConstraints(); ++i)
        configuration.push_back(char(matter.getConstraint(i).isDisabled(state)));
    for (MobilizedBodyIndex i(1); i < matter.getNumBodies(); ++i) {
        const MobilizedBody& mobod = matter.getMobilizedBody(i);
        if (mobod.getNumU(state) == 0) continue;
        configuration.push_back(char(mobod.getQMotionMethod(state)));
        configuration.push_back(char(mobod.getUMotionMethod(state)));
        configuration.push_back(char(mobod.getUDotMotionMethod(state)));
    }
    const FlexibleBodySubsystem& flexible = *FlexibleBodySubsystem::find(system);
    for (int b = 0; b < flexible.getNumBodies(); ++b)
        configuration.push_back(
            char(flexible.getBody(FlexibleBodyIndex(b)).isStiffeningEnabled(state)));
    return configuration;
}

/** Equations and memory for States of one configuration. **/
class Workspace {
public:
    Workspace(const MultibodySystem& system, const State& state, std::vector<char> configuration)
        : m_configuration(std::move(configuration)),
          m_equations(system, state, Topology::Setting::Native),
          m_system(m_equations.getTopology().makeNewtonSystem()),
          m_solver(m_system),
          m_q(size_t(m_equations.getTopology().numQ)),
          m_u(size_t(m_equations.getTopology().numU)),
          m_uDot(m_u.size()),
          m_lambda(size_t(m_equations.getTopology().numMultipliers), 0) {
        // Simbody's own part takes far longer, so that threads would gain nothing.
        m_equations.updBlocks().chooseNumThreads(1);
        m_solver.setNumThreads(1);
    }

    const std::vector<char>& getConfiguration() const { return m_configuration; }

    void addInForces(const State& state, Vector_<SpatialVec>& bodyForces, Vector& mobilityForces) {
        double *q = m_q.data(), *u = m_u.data(), *uDot = m_uDot.data();
        m_equations.getBlocks().getFromState(state, q, u);
        if (!m_equations.getTopology().states.empty()) m_equations.setZ(&state.getZ()[0]);
        m_equations.realizeNatively(state, bodyForces, mobilityForces, q, u);
        m_equations.calcPrescribedUDot(q, uDot);
        m_equations.calcResidual(q, u, uDot, m_lambda.data(), m_system.r.data());
        checkFinite(state.getTime());
        m_equations.calcAccelerationErrors(q, u, uDot, m_system.c.data());
        m_equations.formMassSystem(m_system);
        m_solver.factor(m_system);
        m_solver.solve(m_system);
        const std::vector<double>& delta = m_solver.getDeltaU();
        for (size_t i = 0; i < m_uDot.size(); ++i) uDot[i] += delta[i];
        m_equations.addInCouplingForces(uDot, bodyForces, mobilityForces);
    }

private:
    void checkFinite(double time) const {
        for (int b = 0; b < m_equations.getTopology().numBlocks(); ++b) {
            const Block& block = m_equations.getBlock(b);
            for (int i = block.firstU; i < block.firstU + block.numU; ++i)
                if (!std::isfinite(m_system.r[size_t(i)]))
                    throw std::runtime_error(
                        "the forces on '" + block.name +
                        "' are not finite numbers at t = " + std::to_string(time) + " s");
        }
    }

    std::vector<char> m_configuration;
    Evaluation m_equations;
    NewtonSystem m_system;
    BlockEliminationSolver m_solver;
    std::vector<double> m_q, m_u, m_uDot, m_lambda;
};

/** Keeps idle workspaces for later evaluations; one in use belongs to its thread. **/
class BlockInertiaCoupling : public InertiaCoupling {
public:
    explicit BlockInertiaCoupling(const MultibodySystem& system) : m_system(system) {}

    void addInForces(const State& state, Vector_<SpatialVec>& bodyForces,
                     Vector& mobilityForces) override {
        std::unique_ptr<Workspace> workspace = take(state);
        workspace->addInForces(state, bodyForces, mobilityForces);
        giveBack(std::move(workspace));
    }

private:
    static constexpr size_t MostKept = 8;

    std::unique_ptr<Workspace> take(const State& state) {
        std::vector<char> configuration = findConfiguration(m_system, state);
        {
            const std::lock_guard<std::mutex> lock(m_mutex);
            for (auto found = m_idle.begin(); found != m_idle.end(); ++found) {
                if ((*found)->getConfiguration() != configuration) continue;
                std::unique_ptr<Workspace> workspace = std::move(*found);
                m_idle.erase(found);
                return workspace;
            }
        }
        return std::make_unique<Workspace>(m_system, state, std::move(configuration));
    }

    void giveBack(std::unique_ptr<Workspace> workspace) {
        const std::lock_guard<std::mutex> lock(m_mutex);
        if (m_idle.size() == MostKept) m_idle.erase(m_idle.begin());  // unused for longest
        m_idle.push_back(std::move(workspace));
    }

    const MultibodySystem& m_system;
    std::mutex m_mutex;
    std::vector<std::unique_ptr<Workspace>> m_idle;
};

}  // namespace

std::shared_ptr<InertiaCoupling> InertiaCoupling::make(const MultibodySystem& system) {
    return std::make_shared<BlockInertiaCoupling>(system);
}

}  // namespace simflex
