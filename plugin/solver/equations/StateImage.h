#pragma once
/** @file
What stands in a SimTK::State, in a checkpoint (private header): t, q, u, z, weights of z, locks,
disabled Motions, constraints and forces, the choice of quaternions, and discrete variables of
numbers and of the usual collections of them. Discrete variables of other types (a force element's
or constraint's parameters, say) are opaque: they are taken from the State given for reading, and a
change of one since the integration started cannot be written. **/

#include <string>
#include <vector>

#include "Simbody.h"
#include "simflex/base/Checkpoint.h"

namespace simflex {

class StateImage {
public:
    explicit StateImage(const SimTK::MultibodySystem& system) : m_system(system) {}

    /** Remembers how often opaque variables were changed. **/
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

/** Variables that are updated at the ends of steps: contacts, cables' last paths, Measure::Delay.
@param state  realized to Stage::Instance **/
std::vector<SimTK::DiscreteVarKey> listAutoUpdates(const SimTK::State& state);

/** Variables that no more than motions and forces depend on: all but those of Stage::Instance and
before. **/
std::vector<SimTK::DiscreteVarKey> listLaterVariables(const SimTK::State& state);

/** Writes these variables of one State into another of the same system. **/
void copyVariables(const std::vector<SimTK::DiscreteVarKey>& keys, const SimTK::State& from,
                   SimTK::State& to);

/** copyState() with what Stage::Instance computes anew. **/
SimTK::State makeFreshState(const SimTK::MultibodySystem& system, const SimTK::State& state);

}  // namespace simflex
