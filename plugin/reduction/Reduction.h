#pragma once
/** @file
Reduces a finite element model to a ReducedBody by the Craig–Bampton method.

1. Interfaces are tied to their master points: rigidly (RBE2), u_slave = u_I + θ_I × (x − x_I), or
   distributing (RBE3), the master being the rigid motion that fits the nodes best.
2. Basis Ψ: constraint modes, one per boundary degree of freedom; static attachment modes of load
   points, of inertia relief and at frequencies (see StaticLoads.h); the lowest normal modes with
   all interfaces held, K_ii φ = ω² M_ii φ.
3. The small pencil (ΨᵀKΨ, ΨᵀMΨ) is solved, its six zeros are dropped, the rest is projected off
   the analytic rigid motions R and made orthonormal again: ΦᵀMΦ = 1, ΦᵀKΦ = Ω², RᵀMΦ = 0.
4. The second-order invariants of the mean-axis frame (see ReducedBody).

    ReductionOptions options;
    options.name = "crank";
    options.interfaces = {{"shaft", "SHAFT"}, {"pin", "PIN"}};
    options.numModes = 50;                                  // 12 constraint + 38 normal
    ReducedBody crank = reduce(readCalculixDeck("crank.inp"), options);   // 44 modes
    writeReducedBody("crank.h5", crank);

Source: R. R. Craig, M. C. C. Bampton, Coupling of substructures for dynamic analyses, AIAA
Journal 6 (1968) 1313–1319; A. A. Shabana, Dynamics of Multibody Systems, ch. 5–6. **/

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

/** One joint seat: which nodes are tied to which master point, and how. **/
struct InterfaceOptions {
    InterfaceOptions() = default;
    InterfaceOptions(std::string interfaceName, std::string whichNodes,
                     TieType tieType = TieType::Rigid)
        : name(std::move(interfaceName)), nodes(std::move(whichNodes)), tie(tieType) {}

    std::string name;   ///< as joints will call it
    std::string nodes;  ///< a node set of the model or a shape, see selectNodes()
    TieType tie = TieType::Rigid;
    std::optional<std::array<double, 3>>
        master;  ///< deck coordinates [m]; default: findMiddle() of the nodes
};

/** A place where forces will act that is no interface. Its static (attachment) modes, one a
direction, make the part bend under them as the full model does. **/
struct LoadPoint {
    std::string nodes;         ///< share the force evenly; see selectNodes()
    std::string axes = "xyz";  ///< directions, of the deck
};

/** Where stress and strain of the modes are kept. They come from the displacements by the
model's elements, as CalculiX has them (averaged at a node over its elements, different materials
too). **/
struct StressOptions {
    enum class Nodes { Skin, All, Sets };
    Nodes nodes = Nodes::Skin;      ///< Skin: those of faces of one element only
    std::vector<std::string> sets;  ///< for Nodes::Sets, see selectNodes()
};

struct ReductionOptions {
    std::string name = "part";
    std::vector<InterfaceOptions> interfaces;
    std::vector<LoadPoint> loadPoints;
    /** Asks for inertia-relief modes, twelve (six without interfaces): static shapes under linear
    fields of acceleration, with which weight, angular acceleration and centrifugal load are carried
    exactly. **/
    bool hasInertiaRelief = false;
    /** Frequencies at which the part is to answer exactly to harmonic motions of its interfaces
    and forces at its load points, but for damping [Hz]; a mode for each of these. **/
    std::vector<double> frequencies;
    /** Craig–Bampton modes before the six rigid ones are removed: 6 per interface, one per
    direction of each load point, those of inertia relief and frequencies, the rest normal modes;
    the part gets numModes − 6. Without interfaces: free-free modes, the six rigid ones among them.
    One more where the next normal mode has within a per cent the frequency of the last one, so that
    pairs, as of round parts, stay together. **/
    int numModes = 50;
    /** If given, all normal modes up to this frequency are taken instead of numModes [Hz]. **/
    std::optional<double> highestFrequency;
    /** So many of the part's frequencies are compared with the full model's, which are found to
    full accuracy for this: ReductionReport::fullFrequencies; and ReductionReport::staticErrors
    is found. **/
    int numCheckedModes = 0;
    bool hasStiffening = false;  ///< asks for ReducedBody::stiffening
    /** So many normal modes more, and inertia relief, has ReducedBody::finer; 0: there is none. **/
    int numFurtherModes = 0;
    /** Memory that the reduction may take beyond the model; what it will take is known before K is
    factored [bytes]. If not given: what the machine has left. **/
    std::optional<double> memoryLimit;
    /** Factors and finds modes in another way, over many machines for instance (SlepcSolver.h).
    Null: the library's own. **/
    std::shared_ptr<StiffnessSolver> solver;
    /** Asks for ReducedBody::modalStress. **/
    std::optional<StressOptions> stress;
    /** If not null, the factor, constraint modes and normal modes are kept there and taken from
    there, so that a reduction that was stopped goes on where it was, to the same bits. **/
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
    double stress = 0;      ///< of the modes
    double total = 0;
    int numDofs = 0;            ///< of the finite element model
    long numFactorEntries = 0;  ///< nonzeros of the Cholesky factor
    int numLanczosBlocks = 0;   ///< of eight vectors that Lanczos solved for
};

/** Reduces a part, with ReducedBody::derivatives if the model was read with parameters
(CalculixOptions::derivatives). O(factor) + O(numModes²·numDofs). The same model and options give the same bits.
@param timings  if not null, receives the time of each phase.
@throws std::invalid_argument naming part, interface or number, and the cure: an interface with
    an unknown node set, fewer than three nodes, collinear nodes, nodes of another interface, a
    master point more than ten times the part's size away from them; a load point without nodes or
on a rigid interface; too few or too many modes; K singular beyond its six rigid motions; more
memory than there is.
@throws std::invalid_argument for stress and stiffening, if the model was read as matrices or has
    elements that have none.
@throws Cancelled if progress asks to stop. **/
ReducedBody reduce(const FeModel& model, const ReductionOptions& options,
                   const ProgressCallback& progress = {}, ReductionTimings* timings = nullptr);

/** Says that a part has one mode more than asked for, if so: see ReductionOptions::numModes. **/
std::string describeTwin(const ReducedBody& body, const ReductionOptions& options);

/** What reduce() takes and people hardly mean: a master point far from its nodes.
@throws std::invalid_argument as reduce(), of interfaces. **/
std::vector<std::string> listInterfaceWarnings(const FeModel& model,
                                               const ReductionOptions& options);

}  // namespace simflex
