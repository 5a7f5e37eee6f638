#pragma once
/** @file
Contents of a SimTK::State in a checkpoint (private header): t, q, u, z, weights of z, locks,
disabled Motions, constraints and forces, the choice of quaternions, and discrete variables of
numbers and of the usual collections of them. Discrete variables of other types (a force element's
or constraint's parameters, say) are opaque: they are copied from the State given for reading, and
changes of them since the start of the integration cannot be written. **/

#include <string>
#include <vector>

#include "Simbody.h"
#include "simflex/base/Checkpoint.h"

namespace simflex {

class StateImage {
public:
    explicit StateImage(const SimTK::MultibodySystem& system) : m_system(system) {}

    /** Records the versions of opaque variables. **/
    void startFrom(const SimTK::State& state);
    /** @throws std::runtime_error that names an opaque variable that changed since startFrom(). **/
    void requireWritable(const SimTK::State& state) const;

    void write(const SimTK::State& state, Checkpoint& checkpoint) const;
    /** @param state  with opaque variables as at startFrom() **/
    void read(Checkpoint& checkpoint, SimTK::State& state) const;

private:
    struct OpaqueVariable {
        SimTK::DiscreteVarKey key;
        long long version;
    };

    bool isOpaque(const SimTK::State& state, const SimTK::DiscreteVarKey& key) const;
    void visitSwitches(Checkpoint& checkpoint, SimTK::State& state) const;
    void visitVariables(Checkpoint& checkpoint, SimTK::State& state) const;

    const SimTK::MultibodySystem& m_system;
    std::vector<OpaqueVariable> m_opaque;
};

/** Variables updated at the ends of steps: contacts, cables' last paths, Measure::Delay.
@param state  realized to Stage::Instance **/
std::vector<SimTK::DiscreteVarKey> listAutoUpdates(const SimTK::State& state);

/** Variables on which only motions and forces depend: all but those of Stage::Instance and
before. **/
std::vector<SimTK::DiscreteVarKey> listLaterVariables(const SimTK::State& state);

/** Copies these variables from one State to another of the same system. **/
void copyVariables(const std::vector<SimTK::DiscreteVarKey>& keys, const SimTK::State& from,
                   SimTK::State& to);

/** copyState() with the results of Stage::Instance recomputed. **/
SimTK::State makeFreshState(const SimTK::MultibodySystem& system, const SimTK::State& state);

}  // namespace simflex
