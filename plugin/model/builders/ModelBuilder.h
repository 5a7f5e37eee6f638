#pragma once
/** @file
Builds the system of a model (private header). **/

#include "simflex/model/builders/InitialValues.h"

namespace simflex {
namespace model {

/** Builds a system from the parts, frames and places that it keeps. **/
class ModelBuilder {
public:
    /** @throws ModelError. **/
    ModelBuilder(const ModelValue& file, const ModelOptions& options);

    const ModelValue& getFile() const { return m_file; }
    const ModelFrames& getFrames() const { return m_frames; }

    /** Builds the system and realizes its topology. **/
    std::unique_ptr<ModelSystem> build() const;

    /** Makes a State with bodies as placed and their own initial values; joints are not assembled.
     **/
    SimTK::State makePlacedState(const ModelSystem& system) const;
    /** Sets the initial coordinates and rates of joints, which assembles them. **/
    void setStarts(const ModelSystem& system, SimTK::State& state) const;

    /** Reports unconstrained bodies to `note`; reports joints open as placed, rotations in degrees
    and an accuracy too coarse for the model's size to `warn`. Must be called before setStarts()
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
