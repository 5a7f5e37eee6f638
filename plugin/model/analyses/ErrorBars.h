#pragma once
/** @file
Estimates the error of a run due to truncated modes.

The same analyses are run again with the finer twin of every part (ReducedBody::finer), in a
separate thread beside the run itself. For each row and column of a probe p, in its unit,

    error = p(finer) − p(run),

so that p + error is the better value and |error| the error bar. It covers everything that changes
with the parts: deflection and stress within a part, natural frequencies and hence the phase of
vibrations, reactions, contact, controllers. It does not cover modes that the finer twin lacks too,
discretisation errors of mesh and time steps (a run with a tighter accuracy shows the latter), or
anything beyond linear elasticity.

Natural modes and frequency responses are compared as in Comparison.h; linear models have no error
bars.

The finer twin has all constraint, attachment and normal modes of its part, the next normal modes,
and those of inertia relief. Its motion ξ has the component c_j = φ_jᵀKΦ ξ along each shape φ_j that
the part lacks, φ_jᵀKφ_k = δ_jk. Modes are advised until the remaining displacements, Σ |c_j|
max|φ_j|, have dropped by the factor by which the error must drop. **/

#include <string>
#include <vector>

#include "simflex/model/analyses/ModelRun.h"
#include "simflex/model/results/Comparison.h"

namespace simflex {
namespace model {

/** Advised number of modes of a part. **/
struct ModeAdvice {
    std::string part, probe;  ///< probe is the column, "tip.y"
    int modes = 0;            ///< current number of Craig–Bampton modes
    int wanted = 0;           ///< 0: more than the finer twin has
};

struct ErrorBars {
    ResultComparison comparison;  ///< of the run with its finer twin
    std::vector<ModeAdvice> advice;
};

/** Largest error, relative to a probe's range, for which no more modes are advised. **/
constexpr double TrustedError = 0.01;

class ErrorBarRun {
public:
    /** Builds the twin.
    @param run  the run to be performed
    @throws ModelError naming a part without a finer twin, and the cure, or if no body of the model
    can bend. **/
    ErrorBarRun(const ModelRun& run, const RunOptions& options);

    /** Performs both runs.
    @throws as ModelRun::perform(). **/
    void perform(ModelRun& run);
    /** Adds a probe "NAME error" for each probe of transient and static analyses to the results of
    the run. **/
    ErrorBars keep(const ModelRun& run) const;

    const ModelRun& getFiner() const { return *m_finer; }

private:
    std::vector<ModeAdvice> advise(const ModelRun& run, const Results& finer,
                                   const ResultComparison& comparison) const;

    RunOptions m_options;
    std::unique_ptr<ModelRun> m_finer;
};

}  // namespace model
}  // namespace simflex
