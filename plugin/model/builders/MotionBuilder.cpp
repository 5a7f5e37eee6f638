#include "simflex/model/builders/MotionBuilder.h"

#include <map>

#include "simflex/body/JointEquations.h"
#include "simflex/forces/Signal.h"
#include "simflex/model/builders/ModelGeometry.h"

namespace simflex {
namespace model {

using namespace SimTK;

namespace {

/** Rotation whose x and y axes are the given axes of F or M. **/
Rotation makeAxes(int x, int y) {
    const UnitVec3 u{CoordinateAxis(x)}, v{CoordinateAxis(y)};
    Mat33 columns;
    columns.col(0) = u.asVec3();
    columns.col(1) = v.asVec3();
    columns.col(2) = u % v;
    return Rotation(columns, true);
}

Joint addRotation(const JointCoordinate& angle, const FramePair& pair,
                  const Joint::MotionFunction& motion, const std::string& name,
                  const ModelFrames& frames, ModelSystem& system) {
    // PrescribedRotation uses atan2(y_F·x_M, x_F·x_M): two axes of one frame, one of the other.
    const int sF = angle.sine[0], sM = angle.sine[1], cF = angle.cosine[0], cM = angle.cosine[1];
    const auto turned = [&](const FrameOnBody& frame, int x, int y) {
        return frames.attach(frame.moved(Transform(makeAxes(x, y))), system);
    };
    const auto other = [](int axis) { return (axis + 1) % 3; };
    if (sM == cM)
        return Joint::PrescribedRotation(system.flexible, turned(pair.F, cF, sF),
                                         turned(pair.M, cM, other(cM)), motion, name);
    return Joint::PrescribedRotation(system.flexible, turned(pair.M, cM, sM),
                                     turned(pair.F, cF, other(cF)), motion, name);
}

}  // namespace

Joint::MotionFunction makeMotionFunction(const Expression& expression) {
    return [expression](Real time) {
        const std::array<double, 3> motion = expression.calcMotion(time);
        return Vec3(motion[0], motion[1], motion[2]);
    };
}

const FramePair& findJointFrames(const ModelValue& name, const JointBuilder& joints,
                                 const ModelSystem& system) {
    findEntry(system.joints, "joint", name.getText(), name);
    const FramePair* pair = joints.findFrames(name.getText());
    if (!pair) name.fail("'" + name.getText() + "' is a gear or coupler: name a joint it turns");
    return *pair;
}

void checkCoordinate(const Joint& joint, int index) {
    const int count = joint.getNumCoordinates();
    if (index < 0 || index >= count)
        throw std::invalid_argument(
            "joint '" + joint.getName() + "' has no coordinate " + std::to_string(index) +
            (count == 0   ? "; joints of its type have none"
             : count == 1 ? "; it has one, number 0"
                          : "; they are 0 to " + std::to_string(count - 1)));
}

Joint addJointMotion(const Joint& joint, const FramePair& pair, int index,
                     const Joint::MotionFunction& motion, const std::string& name,
                     const ModelFrames& frames, ModelSystem& system) {
    checkCoordinate(joint, index);
    const JointCoordinate coordinate = Joint::Coordinate(joint, index).getCoordinate();
    if (coordinate.isAngle()) return addRotation(coordinate, pair, motion, name, frames, system);
    return Joint::PrescribedTranslation(system.flexible, frames.attach(pair.F, system),
                                        frames.attach(pair.M, system),
                                        CoordinateAxis(coordinate.sine[0]), motion, name);
}

void addMotions(const ModelValue& file, const ModelFrames& frames, const JointBuilder& joints,
                ModelSystem& system) {
    const ModelValue motions = file.get("motions");
    std::map<std::pair<std::string, int>, std::string> led;
    for (const std::string& name : motions.getKeys()) {
        const ModelValue value = motions.get(name);
        const bool hasJoint = value.has("joint"), hasAngle = value.has("angle");
        const ModelValue function = value.get(hasAngle ? "angle" : "position");
        const Expression expression = function.getExpression();
        const Joint::MotionFunction motion = makeMotionFunction(expression);
        if (hasJoint) {
            const ModelValue jointName = value.get("joint");
            const FramePair& pair = findJointFrames(jointName, joints, system);
            const Joint& joint =
                findEntry(system.joints, "joint", jointName.getText(), jointName).joint;
            const int index = value.get("coordinate").getInteger();
            const auto isNew = led.emplace(std::make_pair(jointName.getText(), index), name);
            if (!isNew.second)
                value.fail("coordinate " + std::to_string(index) + " of '" + jointName.getText() +
                           "' is driven by motion '" + isNew.first->second + "' already");
            system.motions.push_back(
                {name,
                 withPlace(value.has("coordinate") ? value.get("coordinate") : jointName,
                           [&] {
                               return addJointMotion(joint, pair, index, motion, name, frames,
                                                     system);
                           }),
                 expression});
            continue;
        }
        const FramePair pair = readBetween(value.get("between"), frames);
        const Joint joint = withPlace(value.get("between"), [&]() -> Joint {
            const Attachment M = frames.attach(pair.M, system);
            if (hasAngle)
                return Joint::PrescribedRotation(system.flexible, frames.attach(pair.F, system), M,
                                                 motion, name);
            const UnitVec3 axis =
                value.has("axis") ? readDirection(value.get("axis")) : UnitVec3(XAxis);
            const Attachment F =
                frames.attach(pair.F.moved(Transform(Rotation(axis, XAxis))), system);
            return Joint::PrescribedTranslation(system.flexible, F, M, XAxis, motion, name);
        });
        system.motions.push_back({name, joint, expression});
    }
}

void countTurns(const ModelValue& file, ModelSystem& system) {
    const ModelValue motions = file.get("motions");
    const auto findLead = [&](const std::string& joint, int coordinate) -> Joint::MotionFunction {
        for (const std::string& name : motions.getKeys()) {
            const ModelValue motion = motions.get(name);
            if (motion.has("joint") && motion.get("joint").getText() == joint &&
                motion.get("coordinate").getInteger() == coordinate)
                return makeMotionFunction(
                    motion.get(motion.has("angle") ? "angle" : "position").getExpression());
        }
        return {};
    };
    // Couplers come last, since their angles belong to other joints.
    for (const bool areCouplers : {false, true})
        for (const Model::JointEntry& entry : system.joints) {
            if (entry.joint.getEquations().isCoupler() != areCouplers) continue;
            for (int k = 0; k < entry.joint.getNumCoordinates(); ++k)
                Signal::turnedAngle(system.flexible, entry.joint, k, 0, findLead(entry.name, k));
        }
}

}  // namespace model
}  // namespace simflex
