#pragma once
/** @file
What modes that were left out of parts would change in a run.

The same analyses are done once more with the finer twin of every part (ReducedBody::finer), beside
the run itself, in a thread of its own. Row by row and column by column of each probe p, in the same
unit,

    error = p(finer) − p(run),

so that p + error is the better value and |error| the bar. It holds whatever changes with the parts:
deflection and stress within a part, frequencies and with them the phase of vibration, reactions,
contact, controllers. It does not hold what the finer twin has left out too, nor errors of mesh, of
steps (ModelRun with more accuracy tells these) and of what is no linear elasticity.

Natural modes and frequency responses are compared as Comparison.h does; linear models have none.

The finer twin has all constraint, attachment and normal modes of its part, the next normal modes,
and those of inertia relief. Along each shape φ_j that the part lacks, φ_jᵀKφ_k = δ_jk, its motion ξ
has c_j = φ_jᵀKΦ ξ: a part would have to have as many of these as it takes until the rest of their
displacements, Σ |c_j| max|φ_j|, has come down by the factor that the error is to. **/

#include <string>
#include <vector>

#include "simflex/model/analyses/ModelRun.h"
#include "simflex/model/results/Comparison.h"

namespace simflex {
namespace model {

/** How many modes a part should have. **/
struct ModeAdvice {
    std::string part, probe;  ///< the column, "tip.y"
    int modes = 0;            ///< as the part is reduced now: Craig–Bampton modes
    int wanted = 0;           ///< 0: more than the finer twin has
};

struct ErrorBars {
    ResultComparison comparison;  ///< of the run with the finer one
    std::vector<ModeAdvice> advice;
};

/** Part of a probe's range that an error may be, unless more modes are advised. **/
constexpr double TrustedError = 0.01;

/** A run with its finer twin. **/
class ErrorBarRun {
public:
    /** Builds the twin. @param run  that is to be performed
    @throws ModelError naming the part of which nothing more is known, and the cure; or if no body
    of the model can bend. **/
    ErrorBarRun(const ModelRun& run, const RunOptions& options);

    /** Performs both. @throws as ModelRun::perform(). **/
    void perform(ModelRun& run);
    /** Adds to the results of the run a probe "NAME error" for each of its own, of transient and
    static analyses. **/
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
