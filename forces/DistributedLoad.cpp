#include "simflex/forces/DistributedLoad.h"

#include <stdexcept>

#include "simflex/body/FlexibleBodySubsystemGuts.h"
#include "simflex/forces/ElementParameters.h"

namespace simflex {

using namespace SimTK;

namespace {

std::string nameDistributedLoad(const FlexibleBody& body, const std::string& name) {
    return name.empty() ? "DistributedLoad on '" + body.getName() + "'" : "'" + name + "'";
}

}  // namespace

DistributedLoad::DistributedLoad(FlexibleBodySubsystem& subsystem, const FlexibleBody& body,
                                 const LoadShape& shape, Scale scale, const std::string& called) {
    const std::string name = nameDistributedLoad(body, called);
    const int n = body.getNumModes();
    if (!scale) throw std::invalid_argument(name + ": no function given");
    if (shape.modal.size() != n || shape.torquePerMode.nrow() != 3 ||
        shape.torquePerMode.ncol() != n)
        throw std::invalid_argument(name + ": the load shape is of " +
                                    std::to_string(shape.modal.size()) + " modes, the body has " +
                                    std::to_string(n));
    BodyLoad load;
    load.force = shape.force;
    load.torque = shape.torque;
    load.modal.resize(n);
    load.torquePerMode.resize(3, n);
    for (int i = 0; i < n; ++i) {
        checkFinite(name, "a modal force", shape.modal[i]);
        load.modal[i] = shape.modal[i];
        for (int a = 0; a < 3; ++a) load.torquePerMode(a, i) = shape.torquePerMode(a, i);
    }
    load.scale = std::move(scale);
    subsystem.updGuts().addLoad(body.getIndex(), std::move(load));
}

DistributedLoad::DistributedLoad(FlexibleBodySubsystem& subsystem, const FlexibleBody& body,
                                 const LoadShape& shape, Real scale, const std::string& name)
    : DistributedLoad(
          subsystem, body, shape, [scale](Real) { return scale; }, name) {
    checkFinite(nameDistributedLoad(body, name), "the scale", scale);
}

}  // namespace simflex
