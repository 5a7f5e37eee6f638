/** @file
Probes of energy and momentum. **/

#include "simflex/model/probes/ProbeKinds.h"

namespace simflex {
namespace model {

using SimTK::SpatialVec;
using SimTK::State;
using SimTK::Vec3;

namespace {

double calcBodyKineticEnergy(const Model::BodyEntry& body, const State& state) {
    if (body.flexible) return body.flexible->calcKineticEnergy(state);
    const SpatialVec& V_GB = body.mobod.getBodyVelocity(state);
    return 0.5 * (~V_GB * (body.mobod.getBodySpatialInertiaInGround(state) * V_GB));
}

/** Momentum (angular about Ground's origin, linear). **/
SpatialVec calcBodyMomentum(const Model::BodyEntry& body, const State& state) {
    if (body.flexible) return body.flexible->calcMomentum(state);
    const SpatialVec atOrigin =
        body.mobod.getBodySpatialInertiaInGround(state) * body.mobod.getBodyVelocity(state);
    const Vec3& p = body.mobod.getBodyTransform(state).p();
    return {atOrigin[0] + p % atOrigin[1], atOrigin[1]};
}

}  // namespace

double calcEnergy(const Model& model, const Moment& moment, const std::string& kind) {
    const FlexibleBodySubsystem& subsystem = model.getFlexibleBodies();
    const auto getKinetic = [&] {
        if (!moment.kineticEnergy) moment.kineticEnergy = subsystem.calcKineticEnergy(moment.state);
        return *moment.kineticEnergy;
    };
    const auto getPotential = [&] {
        // This is complete: all forces of a model are gravity or of simflex/forces.
        if (!moment.potentialEnergy)
            moment.potentialEnergy = subsystem.calcPotentialEnergy(moment.state);
        return *moment.potentialEnergy;
    };
    if (kind == "work") return moment.work;
    if (kind == "kinetic") return getKinetic();
    if (kind == "strain") {
        double strain = 0;
        for (const Model::BodyEntry& body : model.getBodies())
            if (body.flexible) strain += body.flexible->calcStrainEnergy(moment.state);
        return strain;
    }
    if (kind == "potential") return getPotential();
    const double total = getKinetic() + getPotential();
    return kind == "balance" ? total - moment.work : total;
}

Probe makeEnergyProbe(const ProbeSource& source) {
    const ModelValue kind = source.entry.get("energy"), bodyName = source.entry.get("body");
    Probe probe;
    probe.unit = "J";
    probe.columns = {""};
    if (!bodyName.isGiven()) {
        probe.calc = [model = source.model, kind = kind.getText()](const Moment& moment,
                                                                   double* values) {
            *values = calcEnergy(*model, moment, kind);
        };
        return probe;
    }
    const Model::BodyEntry body = source.model->findBody(bodyName);
    if (kind.getText() == "kinetic")
        probe.calc = [model = source.model, body](const Moment& moment, double* values) {
            *values = calcBodyKineticEnergy(body, moment.state);
        };
    else if (kind.getText() == "strain")
        probe.calc = [model = source.model, body](const Moment& moment, double* values) {
            *values = body.flexible ? body.flexible->calcStrainEnergy(moment.state) : 0.0;
        };
    else
        kind.fail("'" + kind.getText() +
                  "' energy belongs to the whole system; of one body there are: kinetic, strain");
    return probe;
}

Probe makeMomentumProbe(const ProbeSource& source) {
    const ModelValue kind = source.entry.get("momentum"), bodyName = source.entry.get("body");
    const int row = kind.getText() == "angular" ? 0 : 1;
    Probe probe;
    probe.unit = row == 0 ? "kg m^2/s" : "kg m/s";
    probe.columns = {"x", "y", "z"};
    if (bodyName.isGiven()) {
        const Model::BodyEntry body = source.model->findBody(bodyName);
        probe.calc = [model = source.model, body, row](const Moment& moment, double* values) {
            const SpatialVec momentum = calcBodyMomentum(body, moment.state);
            for (int k = 0; k < 3; ++k) values[k] = momentum[row][k];
        };
    } else {
        probe.calc = [model = source.model, row](const Moment& moment, double* values) {
            const SpatialVec momentum = model->getFlexibleBodies().calcMomentum(moment.state);
            for (int k = 0; k < 3; ++k) values[k] = momentum[row][k];
        };
    }
    return selectComponent(source.entry, std::move(probe));
}

}  // namespace model
}  // namespace simflex
