#pragma once
/** @file
Makers of the kinds of probes (private to this room). Each takes the probe's entry in the model file
and fills in unit, columns and calculation. **/

#include <memory>
#include <string>
#include <vector>

#include "simflex/model/probes/Probe.h"

namespace simflex {
namespace model {

/** What a probe is made from. **/
struct ProbeSource {
    std::shared_ptr<const Model> model;
    ModelValue entry;  ///< the map under `probes`
};

/** position velocity acceleration angular_velocity angular_acceleration orientation distance
distance_rate **/
bool isFrameProbe(const ModelValue& entry);
Probe makeFrameProbe(const ProbeSource& source);

/** displacement largest_displacement modes center_of_mass **/
Probe makeDisplacementProbe(const ProbeSource& source);
Probe makeLargestDisplacementProbe(const ProbeSource& source);
Probe makeModesProbe(const ProbeSource& source);
Probe makeMassCenterProbe(const ProbeSource& source);

/** stress strain **/
Probe makeStressProbe(const ProbeSource& source);
Probe makeStrainProbe(const ProbeSource& source);

/** coordinate rate joint_error reaction friction driving **/
Probe makeCoordinateProbe(const ProbeSource& source);
Probe makeRateProbe(const ProbeSource& source);
Probe makeJointErrorProbe(const ProbeSource& source);
Probe makeReactionProbe(const ProbeSource& source);
Probe makeFrictionProbe(const ProbeSource& source);
Probe makeDrivingProbe(const ProbeSource& source);

/** energy momentum **/
Probe makeEnergyProbe(const ProbeSource& source);
Probe makeMomentumProbe(const ProbeSource& source);

/** Makes the probe `name`, or has made it already.
@throws ModelError that points to `formula`, which names it, if there is none. **/
using FindProbe = std::function<Probe(const ModelValue& formula, const std::string& name)>;

/** state, function (of time), expression (of time, states and other probes) **/
Probe makeStateProbe(const ProbeSource& source);
Probe makeFunctionProbe(const ProbeSource& source);
Probe makeExpressionProbe(const ProbeSource& source, const FindProbe& findProbe);

/** @name Parts of the above **/
/**@{**/
/** Energies of a system: kinetic, potential, strain, total, work, balance. **/
double calcEnergy(const Model& model, const Moment& moment, const std::string& kind);
/** λ of one joint among those of all. **/
SimTK::Vector getMultipliers(const Model& model, const Joint& joint, const Moment& moment);
/** Coordinates of a joint as columns, of all or (number ≥ 0) of one. **/
Probe makeJointCoordinates(const std::shared_ptr<const Model>& model, const Joint& joint,
                           int number);
/** Coordinates of a rigid body's mobilizer as columns. **/
Probe makeBodyCoordinates(const std::shared_ptr<const Model>& model, const Model::BodyEntry& body);
Probe makeJointRates(const std::shared_ptr<const Model>& model, const Joint& joint, int number);
/** One number, or columns x, y, z. **/
Probe makeOfSignals(const std::shared_ptr<const Model>& model, const std::string& unit,
                    const std::vector<Signal>& signals);
/** Makes of a probe with columns x, y, z what the key `component` of the entry asks for: one of
them, the norm, or all. **/
Probe selectComponent(const ModelValue& entry, Probe probe);
/** The flexible body that a value names. @throws ModelError if it is rigid. **/
const FlexibleBody& findFlexible(const Model& model, const ModelValue& name);
/**@}**/

}  // namespace model
}  // namespace simflex
