#include <cmath>

#include "simflex/forces/Bushing.h"
#include "simflex/forces/ContactStop.h"
#include "simflex/forces/TorsionSpring.h"
#include "simflex/forces/TwoPointSpringDamper.h"
#include "simflex/model/builders/JointBuilder.h"
#include "simflex/model/builders/LoadBuilder.h"

namespace simflex {
namespace model {

using namespace SimTK;

namespace {

/** Six along the diagonal. **/
Mat66 readDiagonal(const ModelValue& value) {
    if (!value.isGiven()) return Mat66(0);
    const std::vector<double> numbers = value.getNumbers();
    if (numbers.size() != 6)
        value.fail(
            "it has six numbers, against turning about and shifting along x, y and z; there "
            "are " +
            std::to_string(numbers.size()));
    return Bushing::diagonal(Vec6(numbers.data()));
}

}  // namespace

void addConnectors(const ModelValue& file, const ModelFrames& frames, const Placement& placement,
                   ModelSystem& system) {
    const ModelValue connectors = file.get("connectors");
    for (const std::string& name : connectors.getKeys()) {
        const ModelValue value = connectors.get(name);
        const std::string type = value.get("type").getText();
        const FramePair pair = readBetween(value.get("between"), frames);
        const ModelValue stiffness = value.get("stiffness"), damping = value.get("damping");
        withPlace(value.get("between"), [&] {
            const Attachment F = frames.attach(pair.F, system), M = frames.attach(pair.M, system);
            if (type == "bushing") {
                Bushing(system.flexible, F, M, readDiagonal(stiffness), readDiagonal(damping));
                return;
            }
            const double k = stiffness.getNumber();
            if (type == "stop") {
                if (!(k > 0)) stiffness.fail("the stiffness of a stop must be more than 0");
                ContactStop(system.flexible, F, M, k, value.get("dissipation").getNumber());
            } else if (type == "torsion_spring") {
                TorsionSpring(system.flexible, F, M, k, damping.getNumber(),
                              value.get("free_angle").getNumber());
            } else {
                const ModelValue length = value.get("free_length");
                const Vec3 apart = placement.calcPose(pair.F).p() - placement.calcPose(pair.M).p();
                TwoPointSpringDamper(system.flexible, F, M, k, damping.getNumber(),
                                     length.isGiven() ? length.getNumber() : apart.norm());
            }
        });
    }
}

}  // namespace model
}  // namespace simflex
