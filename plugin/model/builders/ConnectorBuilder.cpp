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

/** A key that only some types have. **/
void allow(const ModelValue& connector, const char* key, bool isAllowed) {
    if (connector.has(key) && !isAllowed)
        connector.get(key).fail("a connector of type " + connector.get("type").getText() +
                                " has none");
}

double readNotNegative(const ModelValue& value, double missing) {
    if (!value.isGiven()) return missing;
    const double number = value.getNumber();
    if (!(number >= 0)) value.fail("it is " + std::to_string(number) + "; it must not be negative");
    return number;
}

/** Six along the diagonal. **/
Mat66 readDiagonal(const ModelValue& value) {
    if (!value.isGiven()) return Mat66(0);
    const std::vector<double> numbers = value.getNumbers();
    if (numbers.size() != 6)
        value.fail(
            "it has six numbers, against turning about and shifting along x, y and z; there "
            "are " +
            std::to_string(numbers.size()));
    for (const double number : numbers)
        if (!(number >= 0))
            value.fail("one of them is " + std::to_string(number) + "; none may be negative");
    return Bushing::diagonal(Vec6(numbers.data()));
}

}  // namespace

void addConnectors(const ModelValue& file, const ModelFrames& frames, const Placement& placement,
                   ModelSystem& system) {
    const ModelValue connectors = file.get("connectors");
    for (const std::string& name : connectors.getKeys()) {
        const ModelValue value = connectors.get(name);
        const std::string type = value.get("type").getText();
        allow(value, "free_length", type == "spring");
        allow(value, "free_angle", type == "torsion_spring");
        allow(value, "dissipation", type == "stop");
        allow(value, "damping", type != "stop");
        const FramePair pair = readBetween(value.get("between"), frames);
        const ModelValue stiffness = value.get("stiffness"), damping = value.get("damping");
        if (!stiffness.isGiven() && !damping.isGiven())
            value.fail("give its stiffness, or damping");
        withPlace(value.get("between"), [&] {
            const Attachment F = frames.attach(pair.F, system), M = frames.attach(pair.M, system);
            if (type == "bushing") {
                Bushing(system.flexible, F, M, readDiagonal(stiffness), readDiagonal(damping));
                return;
            }
            const double k = readNotNegative(stiffness, 0);
            if (type == "stop") {
                const ModelValue dissipation = value.get("dissipation");
                if (!(k > 0)) stiffness.fail("the stiffness of a stop must be more than 0");
                ContactStop(system.flexible, F, M, k, readNotNegative(dissipation, 0));
                return;
            }
            const double c = readNotNegative(damping, 0);
            if (type == "torsion_spring") {
                const double angle =
                    value.has("free_angle") ? value.get("free_angle").getNumber() : 0;
                TorsionSpring(system.flexible, F, M, k, c, angle);
                return;
            }
            if (type != "spring")
                value.get("type").fail("there is no connector of type '" + type + "'");
            const double distance =
                (placement.calcPose(pair.F).p() - placement.calcPose(pair.M).p()).norm();
            TwoPointSpringDamper(system.flexible, F, M, k, c,
                                 readNotNegative(value.get("free_length"), distance));
        });
    }
}

}  // namespace model
}  // namespace simflex
