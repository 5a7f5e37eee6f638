#include <algorithm>
#include <cmath>

#include "simflex/forces/Bushing.h"
#include "simflex/forces/ContactStop.h"
#include "simflex/forces/StateForces.h"
#include "simflex/forces/TorsionSpring.h"
#include "simflex/forces/TwoPointSpringDamper.h"
#include "simflex/model/builders/JointBuilder.h"
#include "simflex/model/builders/LoadBuilder.h"

namespace simflex {
namespace model {

using namespace SimTK;

namespace {

/** Reads six numbers as a diagonal matrix. **/
Mat66 readDiagonal(const ModelValue& value) {
    if (!value.isGiven()) return Mat66(0);
    const std::vector<double> numbers = value.getNumbers();
    if (numbers.size() != 6)
        value.fail(
            "it must have six numbers, for rotation about and translation along x, y and z; there "
            "are " +
            std::to_string(numbers.size()));
    return Bushing::diagonal(Vec6(numbers.data()));
}

Signal reverse(const Signal& force) {
    return Signal::function({force}, [](Real, const Real* x, Real* slopes) {
        if (slopes) *slopes = -1;
        return -*x;
    });
}

void addMotor(const ModelValue& value, SignalBuilder& signals, ModelSystem& system) {
    const ModelValue what = value.get("joint");
    const Signal position = signals.makeCoordinate(what), rate = signals.makeCoordinateRate(what);
    const auto [joint, coordinate] = signals.findCoordinateOf(what);
    const bool isAngle = findCoordinate(joint, coordinate).coordinate.isAngle();
    const Signal force = signals.make(value.get("law"), {{isAngle ? "angle" : "length", position},
                                                         {isAngle ? "speed" : "rate", rate}});
    CoordinateForce(system.flexible, joint, coordinate, force, value.getName());
}

/** Adds a spring, torsion spring or actuator whose force is a formula. **/
void addLaw(const ModelValue& value, const std::string& type, const Attachment& F,
            const Attachment& M, SignalBuilder& signals, ModelSystem& system) {
    const std::string name = value.getName();
    const ModelValue law = value.get("law");
    if (type == "torsion_spring") {
        const JointCoordinate angle = JointCoordinate::makeAngleAboutZ();
        const Signal torque =
            signals.make(law, {{"angle", Signal::turnedAngle(system.flexible, angle, F, M,
                                                             "turns of connector '" + name + "'")},
                               {"speed", Signal::coordinateRate(angle, F, M)}});
        CoordinateForce(system.flexible, angle, F, M, reverse(torque), name);
        return;
    }
    const Signal force = signals.make(
        law, {{"length", Signal::distance(F, M)}, {"rate", Signal::distanceRate(F, M)}});
    LineForce(system.flexible, F, M, type == "actuator" ? reverse(force) : force, name);
}

}  // namespace

void addConnectors(const ModelValue& file, const ModelFrames& frames, const Placement& placement,
                   SignalBuilder& signals, ModelSystem& system) {
    const ModelValue connectors = file.get("connectors");
    for (const std::string& name : connectors.getKeys()) {
        const ModelValue value = connectors.get(name);
        const std::string type = value.get("type").getText();
        if (type == "motor") {
            if (!value.has("law"))
                value.fail("its torque is missing, for example law: \"-20*speed\"");
            addMotor(value, signals, system);
            continue;
        }
        const FramePair pair = readBetween(value.get("between"), frames);
        const ModelValue stiffness = value.get("stiffness"), damping = value.get("damping");
        if (!stiffness.isGiven() && !value.has("law") && type != "actuator")
            value.fail("'stiffness' is missing, which '" + type + "' needs" +
                       (type == "stop" || type == "bushing" ? "" : ", or its force as a 'law'"));
        withPlace(value.get("between"), [&] {
            const Attachment F = frames.attach(pair.F, system), M = frames.attach(pair.M, system);
            if (type == "bushing") {
                Bushing(system.flexible, F, M, readDiagonal(stiffness), readDiagonal(damping),
                        name);
                return;
            }
            if (value.has("law")) {
                addLaw(value, type, F, M, signals, system);
                return;
            }
            if (type == "actuator")
                value.fail("its force is missing, for example law: \"1000 - 50*rate\"");
            const double k = stiffness.getNumber();
            if (type == "stop") {
                if (!(k > 0)) stiffness.fail("the stiffness of a stop must be more than 0");
                ContactStop(system.flexible, F, M, k, value.get("dissipation").getNumber(), name);
            } else if (type == "torsion_spring") {
                TorsionSpring(system.flexible, F, M, k, damping.getNumber(),
                              value.get("free_angle").getNumber(), name);
            } else {
                const ModelValue length = value.get("free_length");
                const Vec3 apart = placement.calcPose(pair.F).p() - placement.calcPose(pair.M).p();
                TwoPointSpringDamper(system.flexible, F, M, k, damping.getNumber(),
                                     length.isGiven() ? length.getNumber() : apart.norm(), name);
            }
        });
    }
}

}  // namespace model
}  // namespace simflex
