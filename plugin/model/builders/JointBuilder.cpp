#include "simflex/model/builders/JointBuilder.h"

#include <algorithm>
#include <cmath>

#include "simflex/forces/JointFriction.h"
#include "simflex/model/builders/ModelGeometry.h"
#include "simflex/model/builders/Seat.h"

namespace simflex {
namespace model {

using namespace SimTK;

namespace {

bool isCoupling(const std::string& type) {
    return type == "gear" || type == "coupler";
}

double readNonZero(const ModelValue& value) {
    const double number = value.getNumber();
    if (number == 0) value.fail("it must not be 0");
    return number;
}

void addFriction(const ModelValue& value, const Joint& joint, ModelSystem& system) {
    FrictionCoefficients read;
    read.coulomb = value.get("coulomb").getNumber();
    const ModelValue breakaway = value.get("static");
    if (value.has("static")) read.breakaway = breakaway.getNumber();
    read.viscous = value.get("viscous").getNumber();
    read.radius = value.get("radius").getNumber();
    read.axialRadius = value.get("axial_radius").getNumber();
    if (read.coulomb == 0 && read.viscous == 0 && !(read.breakaway > 0))
        value.fail("it has none: give 'coulomb', 'static' or 'viscous'");
    withPlace(value, [&] { JointFriction(system.flexible, joint, read); });
}

}  // namespace

FramePair readBetween(const ModelValue& between, const ModelFrames& frames) {
    FramePair pair{findSeat(between.at(0), frames), findSeat(between.at(1), frames)};
    if (pair.F.body == pair.M.body)
        between.fail(
            "both frames are on " +
            (pair.F.body < 0 ? "ground" : "'" + frames.getBodyNames()[size_t(pair.F.body)] + "'") +
            "; they must be on two bodies");
    return pair;
}

const FramePair* JointBuilder::findFrames(const std::string& name) const {
    const auto found = m_pairs.find(name);
    return found == m_pairs.end() ? nullptr : &found->second;
}

FramePair JointBuilder::turn(const ModelValue& axis, const std::string& type,
                             const FramePair& pair) const {
    if (!axis.isGiven()) return pair;
    const UnitVec3 direction = readDirection(axis);
    // The smallest rotation of Ground's axes that yields the given axis.
    const UnitVec3 from(type == "slider" || type == "universal" ? XAxis : ZAxis);
    const Vec3 across = from % direction;
    const double sine = across.norm(), cosine = dot(from, direction);
    Rotation R_GJ;
    if (sine > 1e-12)
        R_GJ = Rotation(std::atan2(sine, cosine), UnitVec3(across));
    else if (cosine < 0)
        R_GJ = Rotation(Pi, YAxis);
    const auto turned = [&](const FrameOnBody& frame) {
        return frame.moved(Transform(~m_placement.calcPose(frame).R() * R_GJ));
    };
    return {turned(pair.F), turned(pair.M)};
}

namespace {

/** Axes of F along which M can translate. **/
std::vector<int> listFreeAxes(const std::string& type) {
    if (type == "slider") return {0};
    if (type == "cylinder" || type == "screw" || type == "point_on_line") return {2};
    if (type == "planar" || type == "point_in_plane") return {0, 1};
    return {};
}

}  // namespace

Vec3 JointBuilder::calcWayAsPlaced(const std::string& type, const FramePair& pair) const {
    const Vec3 p_FM = (~m_placement.calcPose(pair.F) * m_placement.calcPose(pair.M)).p();
    Vec3 way(0);
    for (const int axis : listFreeAxes(type)) way[axis] = p_FM[axis];
    return way;
}

Joint JointBuilder::addJoint(const ModelValue& value, const std::string& type,
                             ModelSystem& system) {
    const std::string& name = value.getName();
    FramePair pair = turn(value.get("axis"), type, readBetween(value.get("between"), m_frames));
    if (value.get("as_placed").getBool()) {
        pair.M = pair.M.moved(~m_placement.calcPose(pair.M) * m_placement.calcPose(pair.F));
    } else if (value.get("axis").isGiven()) {
        // Displacements, too, count from the placed position of M.
        const Vec3 way = calcWayAsPlaced(type, pair);
        pair.F = pair.F.moved(Transform(way));
        system.namedOrigins[name] = -way;
    }
    m_pairs[name] = pair;
    FlexibleBodySubsystem& flexible = system.flexible;
    return withPlace(value.get("between"), [&]() -> Joint {
        const Attachment F = m_frames.attach(pair.F, system), M = m_frames.attach(pair.M, system);
        if (type == "ball") return Joint::Ball(flexible, F, M, name);
        if (type == "pin") return Joint::Pin(flexible, F, M, name);
        if (type == "slider") return Joint::Slider(flexible, F, M, name);
        if (type == "weld") return Joint::Weld(flexible, F, M, name);
        if (type == "cylinder") return Joint::Cylinder(flexible, F, M, name);
        if (type == "universal") return Joint::Universal(flexible, F, M, name);
        if (type == "planar") return Joint::Planar(flexible, F, M, name);
        if (type == "point_on_line") return Joint::PointOnLine(flexible, F, M, name);
        if (type == "point_in_plane") return Joint::PointInPlane(flexible, F, M, name);
        if (type == "screw")
            return Joint::Screw(flexible, F, M, readNonZero(value.get("pitch")), name);
        double length =
            (m_placement.calcPose(pair.F).p() - m_placement.calcPose(pair.M).p()).norm();
        const ModelValue given = value.get("length");
        if (value.has("length"))
            length = given.getNumber();
        else if (length == 0)
            value.fail("its ends are at one point at the placement: give the length of the rod");
        return Joint::Rod(flexible, F, M, length, name);
    });
}

Joint JointBuilder::addCoupling(const ModelValue& value, const std::string& type,
                                ModelSystem& system) {
    const std::string& name = value.getName();
    const auto readCoordinate = [&](const ModelValue& of) {
        const ModelValue joint = of.isMap() ? of.get("joint") : of;
        if (joint.getText() == name) joint.fail("a joint cannot couple itself");
        if (!m_pairs.count(joint.getText()) && m_joints.has(joint.getText()))
            joint.fail("'" + joint.getText() + "' is a gear or coupler: name the joint it turns");
        const Joint& of_joint = findEntry(system.joints, "joint", joint.getText(), joint).joint;
        return withPlace(of, [&] {
            return Joint::Coordinate(of_joint,
                                     of.has("coordinate") ? of.get("coordinate").getInteger() : 0);
        });
    };
    if (type == "gear") {
        const ModelValue wheels = value.get("wheels"), teeth = value.get("teeth");
        const Joint::Coordinate A = readCoordinate(wheels.at(0)), B = readCoordinate(wheels.at(1));
        const double phase = value.get("phase").getNumber();
        const auto describe = [](const ModelValue& wheel) {
            return (wheel.isMap() ? wheel.get("joint") : wheel).getText() +
                   (wheel.has("coordinate") && wheel.get("coordinate").getInteger() > 0
                        ? " " + std::to_string(wheel.get("coordinate").getInteger())
                        : "");
        };
        if (describe(wheels.at(0)) == describe(wheels.at(1)))
            wheels.fail("'" + describe(wheels.at(0)) +
                        "' cannot mesh with itself; name the joints of two wheels");
        return withPlace(value, [&] {
            return Joint::Gear(system.flexible, A, teeth.at(0).getInteger(), B,
                               teeth.at(1).getInteger(), phase, name);
        });
    }
    std::vector<Joint::Coupler::Term> terms;
    const ModelValue list = value.get("terms");
    for (int i = 0; i < list.getSize(); ++i) {
        const ModelValue term = list.at(i);
        terms.push_back({readCoordinate(term), readNonZero(term.get("coefficient"))});
    }
    const double constant = value.get("constant").getNumber();
    return withPlace(value, [&] { return Joint::Coupler(system.flexible, terms, constant, name); });
}

void JointBuilder::addTo(ModelSystem& system) {
    for (const bool couplings : {false, true})
        for (const std::string& name : m_joints.getKeys()) {
            const ModelValue value = m_joints.get(name);
            const std::string type = value.get("type").getText();
            if (isCoupling(type) != couplings) continue;
            const Joint joint =
                couplings ? addCoupling(value, type, system) : addJoint(value, type, system);
            system.joints.push_back({name, joint});
            if (value.has("friction")) addFriction(value.get("friction"), joint, system);
        }
    // Restore the file's order.
    const std::vector<std::string> keys = m_joints.getKeys();
    const auto rank = [&](const Model::JointEntry& entry) {
        return std::find(keys.begin(), keys.end(), entry.name);
    };
    std::stable_sort(system.joints.begin(), system.joints.end(),
                     [&](const auto& a, const auto& b) { return rank(a) < rank(b); });
}

}  // namespace model
}  // namespace simflex
