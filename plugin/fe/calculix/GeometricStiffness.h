#pragma once
/** @file
Geometric (stress) stiffness of a part under given loads, with the stresses of CalculiX. Internal to
fe and reduction.

    K_g = k ⊗ 1₃,    k_ij = ∫ ∇N_iᵀ σ ∇N_j dV

Each load runs as point loads in a linear static step with a statically determinate support; the
stresses at the integration points are read and k is summed up here. (CalculiX itself can store the
stiffness of a prestressed part, *STEP, PERTURBATION, but adds to K_g the change of K by the
displacements, rigid rotations among them.) Loads must be self-equilibrated: the support then
carries nothing. **/

#include <functional>

#include "simflex/fe/CalculixDeck.h"

namespace simflex {

/** One load and what to call it in messages. **/
struct PrestressLoad {
    std::string name;           ///< "turning about x", "force x on interface 'pin'"
    std::vector<double> force;  ///< 3·numNodes, dof = 3·node + axis [N]
};

struct PrestressOptions {
    std::string program;   ///< as CalculixOptions::program
    int numProcesses = 0;  ///< runs of CalculiX at the same time; 0: one a processor
    ProgressCallback progress;
};

/** Calls `take` with the index of each load and its k (numNodes); in any order, never at the same
time. Temporary files go to $TMPDIR (else /tmp) and are removed, also after an error.
@param model  as readCalculixDeck() gave it: its deck, model.source, is read again.
@throws std::runtime_error if the deck has changed since or is gone, or if CalculiX fails: names the
    load and shows the end of CalculiX's output.
@throws Cancelled if options.progress asks to stop. **/
void calcGeometricStiffness(const FeModel& model, const std::vector<PrestressLoad>& loads,
                            const PrestressOptions& options,
                            const std::function<void(int, const SymmetricMatrix&)>& take);

}  // namespace simflex
