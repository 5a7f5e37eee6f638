#pragma once
/** @file
Analyses a Simbody system once, before any evaluation (private header). It and the SimbodyBridge
alone know the system. **/

#include <memory>
#include <string>
#include <vector>

#include "simflex/solver/equations/Blocks.h"
#include "simflex/solver/equations/ErrorNorm.h"
#include "simflex/solver/equations/FunctionsOfTime.h"
#include "simflex/solver/equations/SimbodyBridge.h"
#include "simflex/solver/equations/Topology.h"

namespace simflex {

class TopologyBuilder {
public:
    /** What an Evaluation is made of. **/
    struct Result {
        std::shared_ptr<const Topology> topology;
        std::unique_ptr<Blocks> blocks;
        std::unique_ptr<FunctionsOfTime> functions;
        std::unique_ptr<SimbodyBridge> simbody;
        std::unique_ptr<ErrorNorm> errorNorm;
    };

    /** @param state  gives instance variables (gravity, disabled elements, locks) and is copied
    @param differentiated  foreign forces whose Jacobian is wanted
    @throws std::invalid_argument that names what cannot be supported. **/
    static Result build(const SimTK::MultibodySystem& system, const SimTK::State& state,
                        Topology::Setting setting,
                        const std::vector<ForceSelection>& differentiated);

private:
    TopologyBuilder(const SimTK::MultibodySystem& system, const SimTK::State& state,
                    Topology::Setting setting);

    void analyse(const SimTK::State& state, const std::vector<ForceSelection>& differentiated);
    void refuseUnsupported(const SimTK::State& state) const;
    void collectGravityAndForces(const SimTK::State& state,
                                 const std::vector<ForceSelection>& differentiated);
    /** Lets the blocks apply one of Simbody's force elements, if they can. **/
    bool takeGravity(const SimTK::Force& force);
    bool takeMobilityForce(const SimTK::Force& force);
    void makeBlocks(const SimTK::State& state);
    void makeBatches();
    void makeJoints();
    /** The system's enabled constraints that are not joints. **/
    std::vector<SimTK::ConstraintIndex> findSimbodyConstraints(const SimTK::State& state) const;
    void makeSimbodyConstraints();
    void makeFrictions();
    void makePrescribedMotion();
    void makeForceElements();
    /** The private States without what is evaluated by blocks. **/
    void preparePrivateStates(const SimTK::State& state);
    void makeLoadedBlocks();
    void makeForceDifferences(const std::vector<ForceSelection>& selections);
    void makeParts();

    FrameRef makeFrame(const Attachment& attachment);
    PrescribedMotion::Mobilizer findMobilizer(SimTK::MobilizedBodyIndex body) const;
    /** Simbody's speeds and what they move. **/
    std::vector<ForceDifferences::Speed> listSimbodySpeeds() const;
    /** Simbody's speeds of a differenced force, as rows of its own block. **/
    std::vector<int> listOwnRows(const ForceDifferences& differences, int block) const;
    /** True if a differenced force acts on the block in a way that an arrow has no columns for:
    on its modes, or where no frame of its part stands for the columns. **/
    bool hasDifferencedModes(int block) const;
    /** True for the modes of a body that is rigid: they have no speeds here. **/
    bool isHeld(SimTK::MobilizedBodyIndex body) const;
    bool sharesPart(int block, int other) const;
    /** The part of a block that needs these shapes, a new one if none suits. **/
    int findPart(int b, const std::vector<const FrameShapes*>& used);

    const SimTK::MultibodySystem& m_system;
    std::string m_owner;  ///< for messages
    std::shared_ptr<Topology> m_shared;
    Result m_result;
    Topology& m_topology;
    Blocks& m_blocks;
    FunctionsOfTime& m_functions;
    SimbodyBridge& m_simbody;
};

/** @throws std::invalid_argument naming `method` if the system has changed since realizeTopology(),
or the State is empty, or has values that are not finite numbers. **/
void requireTopology(const SimTK::MultibodySystem& system, const SimTK::State& state,
                     const std::string& method);

}  // namespace simflex
