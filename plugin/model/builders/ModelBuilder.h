#pragma once
/** @file
Puts the system of a model together (private header). **/

#include "simflex/model/builders/InitialValues.h"

namespace simflex {
namespace model {

/** Keeps what the parts of a model are found by. **/
class ModelBuilder {
public:
    /** @throws ModelError. **/
    ModelBuilder(const ModelValue& file, const ModelOptions& options);

    const ModelValue& getFile() const { return m_file; }
    const ModelFrames& getFrames() const { return m_frames; }

    /** The system, with its topology realized. **/
    std::unique_ptr<ModelSystem> build() const;

    /** Bodies as placed, with their own initial values; joints are not assembled. **/
    SimTK::State makePlacedState(const ModelSystem& system) const;
    /** Gives joints the initial coordinates and rates of the file, which assembles them. **/
    void setStarts(const ModelSystem& system, SimTK::State& state) const;

    /** Tells `note` of bodies that nothing holds and `warn` of joints that are apart as placed, of
    rotations in degrees and of an accuracy as coarse as the model: to be called before setStarts()
    closes joints. **/
    void noteDoubts(const ModelSystem& system, const SimTK::State& placed) const;

private:
    void noteOpenCoupler(const Model::JointEntry& coupler, const SimTK::State& placed) const;
    void warnOfBothSides() const;
    void warnOfAccuracy(const ModelSystem& system, double size) const;

    ModelValue m_file;
    ModelOptions m_options;
    Parts m_parts;
    ModelFrames m_frames;
    Placement m_placement;
};

}  // namespace model
}  // namespace simflex
