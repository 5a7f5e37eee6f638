#pragma once
/** @file
Reduces a finite element model to a ReducedBody by the Craig–Bampton method.

1. Interfaces are tied to their master points: rigidly (RBE2), u_slave = u_I + θ_I × (x − x_I), or
   distributing (RBE3), the master being the rigid motion that fits the nodes best.
2. Basis Ψ: constraint modes, one per boundary degree of freedom; static attachment modes of load
   points, of inertia relief and at frequencies (see StaticLoads.h); the lowest normal modes with
   all interfaces held, K_ii φ = ω² M_ii φ.
3. The small pencil (ΨᵀKΨ, ΨᵀMΨ) is solved and its six zeros are dropped. The rest is projected off
   the analytic rigid motions R and orthonormalised again: ΦᵀMΦ = 1, ΦᵀKΦ = Ω², RᵀMΦ = 0.
4. Second-order invariants of the mean-axis frame (see ReducedBody).

    ReductionOptions options;
    options.name = "crank";
    options.interfaces = {{"shaft", "SHAFT"}, {"pin", "PIN"}};
    options.numModes = 50;                                  // 12 constraint + 38 normal
    ReducedBody crank = reduce(readCalculixDeck("crank.inp"), options);   // 44 modes
    writeReducedBody("crank.h5", crank);

Source: R. R. Craig, M. C. C. Bampton, Coupling of substructures for dynamic analyses, AIAA Journal
6 (1968) 1313–1319; A. A. Shabana, Dynamics of Multibody Systems, ch. 5–6. **/

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "simflex/base/Progress.h"
#include "simflex/fe/Checkpoint.h"
#include "simflex/fe/FeModel.h"
#include "simflex/part/ReducedBody.h"

namespace simflex {

class StiffnessSolver;

/** A joint seat: nodes tied to a master point. **/
struct InterfaceOptions {
    InterfaceOptions() = default;
    InterfaceOptions(std::string interfaceName, std::string whichNodes,
                     TieType tieType = TieType::Rigid)
        : name(std::move(interfaceName)), nodes(std::move(whichNodes)), tie(tieType) {}

    std::string name;   ///< used to attach joints
    std::string nodes;  ///< a node set of the model or a shape, see selectNodes()
    TieType tie = TieType::Rigid;
    std::optional<std::array<double, 3>>
        master;  ///< deck coordinates [m]; default: findMiddle() of the nodes
};

/** A location other than an interface where forces will act. Its static (attachment) modes, one per
direction, make the part's deflection under them that of the full model. **/
struct LoadPoint {
    std::string nodes;         ///< share the force; see selectNodes()
    std::string axes = "xyz";  ///< directions, in deck axes
};

/** Where to store stress and strain of the modes. They are computed from the displacements by the
model's elements and averaged over the elements at a node, across materials, as in CalculiX. **/
struct StressOptions {
    enum class Nodes { Skin, All, Sets };
    Nodes nodes = Nodes::Skin;      ///< Skin: nodes of faces that belong to one element only
    std::vector<std::string> sets;  ///< for Nodes::Sets, see selectNodes()
};

struct ReductionOptions {
    std::string name = "part";
    std::vector<InterfaceOptions> interfaces;
    std::vector<LoadPoint> loadPoints;
    /** Adds twelve inertia-relief modes (six without interfaces): static shapes under linear
    acceleration fields, which make weight, angular acceleration and centrifugal load exact. **/
    bool hasInertiaRelief = false;
    /** Frequencies at which the response to harmonic interface motions and forces at load points is
    exact, apart from damping [Hz]; adds one mode for each of these inputs. **/
    std::vector<double> frequencies;
    /** Number of Craig–Bampton modes before the six rigid ones are removed: 6 per interface, one
    per direction of each load point, those of inertia relief and frequencies, and normal modes for
    the rest; the part gets numModes − 6. Without interfaces: free-free modes including the six
    rigid ones. One mode is added if the frequency of the next normal mode is within 1 % of the last
    one's, so that pairs, as of round parts, stay together; larger groups of equal frequencies, as
    of equal bays, are kept whole, or left out if they would more than double the normal modes. **/
    int numModes = 50;
    /** If set, takes all normal modes up to this frequency instead of numModes [Hz]. **/
    std::optional<double> highestFrequency;
    /** Number of part frequencies compared with the full model's, which are computed to full
    accuracy: ReductionReport::fullFrequencies. Also computes ReductionReport::staticErrors. 0: no
    check. **/
    int numCheckedModes = 0;
    bool hasStiffening = false;  ///< computes ReducedBody::stiffening
    /** Number of additional normal modes of ReducedBody::finer, which also has inertia relief; 0:
    no finer part. **/
    int numFurtherModes = 0;
    /** Memory limit of the reduction beyond the model [bytes], checked by a prediction before K is
    factored. Default: the memory available. **/
    std::optional<double> memoryLimit;
    /** Replaces the library's factorization and eigensolver, for instance by a distributed one
    (SlepcSolver.h). Null: the library's own. **/
    std::shared_ptr<StiffnessSolver> solver;
    /** If set, computes ReducedBody::modalStress. **/
    std::optional<StressOptions> stress;
    /** If not null, the factor, constraint modes and normal modes are stored there and reused, so
    that an interrupted reduction resumes with bit-identical results. **/
    const ReductionCheckpoint* checkpoint = nullptr;
};

/** Wall time of the phases [s], and the size of the problem. **/
struct ReductionTimings {
    double factor = 0;           ///< Cholesky of K_ii
    double constraintModes = 0;  ///< K_ii⁻¹K_ib, and attachment modes
    double normalModes = 0;      ///< Lanczos
    double orthonormalize = 0;   ///< small pencil, projection, second pencil
    double check = 0;            ///< frequencies of the full model
    double invariants = 0;
    double stiffening = 0;  ///< loads, assembly, products
    double stress = 0;      ///< modal stress
    double total = 0;
    int numDofs = 0;            ///< of the finite element model
    long numFactorEntries = 0;  ///< nonzeros of the Cholesky factor
    int numLanczosBlocks = 0;   ///< blocks of eight vectors solved for by Lanczos
};

/** Reduces a part, with ReducedBody::derivatives if the model was read with parameters
(CalculixOptions::derivatives). O(factor) + O(numModes²·numDofs). Bit-identical for equal models and
options.
@param timings  if not null, receives the time of each phase.
@throws std::invalid_argument naming part, interface or number, and the remedy: an interface with an
unknown node set, fewer than three nodes, collinear nodes, nodes of another interface, or a master
point farther from them than ten times the part's size; a load point without nodes or on a rigid
interface; too few or too many modes; K singular beyond its six rigid motions; insufficient memory.
@throws std::invalid_argument for stress and stiffening, if the model was read as matrices or has
elements without them.
@throws Cancelled if progress requests it. **/
ReducedBody reduce(const FeModel& model, const ReductionOptions& options,
                   const ProgressCallback& progress = {}, ReductionTimings* timings = nullptr);

/** Reports modes added or left out to keep equal frequencies together, see
ReductionOptions::numModes; "" if there are none. **/
std::string describeEqualModes(const ReducedBody& body, const ReductionOptions& options);

/** Returns warnings about input that reduce() accepts but is probably unintended: a master point
far from its nodes.
@throws std::invalid_argument as reduce() for interfaces. **/
std::vector<std::string> listInterfaceWarnings(const FeModel& model,
                                               const ReductionOptions& options);

}  // namespace simflex
