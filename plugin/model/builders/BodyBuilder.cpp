#include "simflex/model/builders/BodyBuilder.h"

#include <algorithm>

#include "simflex/forces/ModalDamping.h"
#include "simflex/model/builders/RigidBodies.h"

namespace simflex {
namespace model {

using namespace SimTK;

namespace {

void addDamping(const ModelValue& value, const ModelOptions& options,
                FlexibleBodySubsystem& flexible, const FlexibleBody& body) {
    if (!value.isGiven()) return;
    withPlace(value, [&] {
        if (value.isMap()) {
            const std::vector<double> rayleigh = value.get("rayleigh").getNumbers();
            ModalDamping::rayleigh(flexible, body, rayleigh[0], rayleigh[1]);
        } else if (value.isScalar()) {
            if (value.getText() == "by_frequency")
                ModalDamping::byFrequency(flexible, body);
            else
                ModalDamping(flexible, body, value.getNumber());
        } else {
            std::vector<double> ratios = value.getNumbers();
            // The additional modes of the finer twin come last.
            if (options.bodies == ModelOptions::Bodies::Finer && !ratios.empty())
                ratios.resize(std::max(ratios.size(), size_t(body.getNumModes())), ratios.back());
            if (int(ratios.size()) != body.getNumModes())
                value.fail("there are " + std::to_string(ratios.size()) + " damping ratios; '" +
                           body.getName() + "' has " + std::to_string(body.getNumModes()) +
                           " modes");
            ModalDamping(flexible, body, Vector(int(ratios.size()), ratios.data()));
        }
    });
}

FlexibleBody addFlexibleBody(const ModelValue& value,
                             const std::shared_ptr<const ReducedBody>& part,
                             const ModelOptions& options, ModelSystem& system) {
    if (value.has("color")) readColor(value.get("color"));
    FlexibleBody body = withPlace(
        value.get("part"), [&] { return FlexibleBody(system.flexible, part, value.getName()); });
    const ModelValue stiffening = value.get("stiffening");
    if (value.has("stiffening"))
        withPlace(stiffening, [&] { body.setStiffeningDisabledByDefault(!stiffening.getBool()); });
    if (options.bodies == ModelOptions::Bodies::Rigid ||
        (value.has("rigid") && value.get("rigid").getBool()))
        body.setRigidByDefault(true);
    addDamping(value.get("damping"), options, system.flexible, body);
    return body;
}

}  // namespace

void addBodies(const ModelValue& file, const ModelFrames& frames, const Placement& placement,
               const Parts& parts, const ModelOptions& options, ModelSystem& system) {
    const std::vector<std::string>& names = frames.getBodyNames();
    system.bodies.resize(names.size());
    for (const int i : placement.getOrder()) {
        const ModelValue value = file.get("bodies").get(names[size_t(i)]);
        Model::BodyEntry& entry = system.bodies[size_t(i)];
        entry.name = names[size_t(i)];
        entry.X_BP = ~frames.calcBodyFrame(i);
        if (frames.getPart(i)) {
            const auto& part = parts.at(value.get("part").getText());
            entry.flexible = addFlexibleBody(value, part, options, system);
            entry.mobod = entry.flexible->getFrame();
            continue;
        }
        const Mobilizer& mobilizer = placement.getMobilizer(i);
        MobilizedBody parent = mobilizer.parent.body < 0
                                   ? MobilizedBody(system.matter.updGround())
                                   : system.bodies[size_t(mobilizer.parent.body)].mobod;
        entry.mobod =
            addMobilizedBody(mobilizer, parent, frames.calcPose(mobilizer.parent) * mobilizer.X_PF,
                             makeRigidBody(value));
        system.flexible.nameBody(entry.mobod.getMobilizedBodyIndex(), entry.name);
    }
}

}  // namespace model
}  // namespace simflex
