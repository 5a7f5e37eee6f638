#pragma once
/** @file
Newton systems of random multibody graphs: the solver's matrices without the mechanics.

    std::mt19937 random(7);
    const NewtonSystem system = makeRandomNewtonSystem(random, {Graph::Grid, 25});
**/

#include <random>

#include "simflex/solver/NewtonSystem.h"

namespace simflex::test {

/** Graph of the bodies connected by joints. **/
enum class Graph {
    Chain,   ///< in sequence, the first to Ground
    Tree,    ///< each to a random earlier one
    Star,    ///< all to the first
    Ring,    ///< a chain closed on itself
    Grid,    ///< a square lattice, two joints per body
    Random,  ///< random pairs, including Ground
};

struct RandomSystemOptions {
    Graph graph = Graph::Random;
    int numBodies = 5;
    int mostModes = 60;
    bool hasGeneralBlocks = true;   ///< some J_b are unsymmetric, as with gyroscopic terms
    bool hasCompliantRows = false;  ///< some joints are springs: −D of NewtonSystem
    int numCopiedRows = 0;          ///< rows that repeat an earlier one: redundant but consistent
    int numCouplers = 0;            ///< rows over up to four bodies, some twice on one of them
};

/** Bodies are flexible (arrow, of a few shared parts, a third with columns of their own), flexible
with a general J_b, rigid or late; joints have 1 to 6 rows. Without copied rows G has full rank
wherever a joint's bodies have enough speeds. **/
NewtonSystem makeRandomNewtonSystem(std::mt19937& random, const RandomSystemOptions& options);

/** Adds imaginary parts wherever allowed, symmetric where the real ones are. Repeated rows remain
consistent. **/
ComplexNewtonSystem makeComplex(std::mt19937& random, const NewtonSystem& real);

}  // namespace simflex::test
