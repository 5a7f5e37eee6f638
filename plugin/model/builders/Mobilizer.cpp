#include "simflex/model/builders/Mobilizer.h"

#include <cmath>

#include "simflex/model/builders/ModelGeometry.h"

namespace simflex {
namespace model {

using namespace SimTK;

Mobilizer readMobilizer(const ModelValue& value, const ModelFrames& frames) {
    Mobilizer mobilizer;
    if (!value.isGiven()) return mobilizer;
    mobilizer.type = value.get("type").getText();
    if (value.has("parent")) {
        mobilizer.parent = frames.find(value.get("parent"));
        if (mobilizer.parent.body >= 0 && frames.getPart(mobilizer.parent.body))
            value.get("parent").fail(
                "'" + frames.getBodyNames()[size_t(mobilizer.parent.body)] +
                "' is flexible, and mobilizers stand on rigid bodies: leave the mobilizer out and "
                "hold the body by a joint to " +
                frames.describe(mobilizer.parent));
    }
    mobilizer.X_PF = readPose(value.get("inboard"));
    mobilizer.X_BM = readPose(value.get("outboard"));
    const ModelValue pitch = value.get("pitch");
    if (mobilizer.type == "screw") {
        mobilizer.pitch = pitch.getNumber();
        if (mobilizer.pitch == 0) pitch.fail("the pitch of a screw must not be 0");
    }
    return mobilizer;
}

void countFromPlace(Mobilizer& mobilizer, const Transform& X_GP, const Transform& X_GB) {
    const std::string& type = mobilizer.type;
    const Transform X_FM = ~(X_GP * mobilizer.X_PF) * X_GB * mobilizer.X_BM;
    const Vec3& p = X_FM.p();
    const Mat33& R = X_FM.R().asMat33();
    Vec3 way(0);
    if (type == "slider") way[0] = p[0];
    if (type == "cylinder" || type == "screw") way[2] = p[2];
    if (type == "planar") way = Vec3(p[0], p[1], 0);
    if (type == "translation") way = p;
    Rotation turnOfF, turnOfM;
    if (type == "pin" || type == "cylinder" || type == "screw" || type == "planar")
        turnOfM = Rotation(std::atan2(R(1, 0), R(0, 0)), ZAxis);
    if (type == "universal") {  // about x of F, then y of M
        turnOfF = Rotation(std::atan2(R(2, 1), R(1, 1)), XAxis);
        turnOfM = Rotation(std::atan2(R(0, 2), R(0, 0)), YAxis);
    }
    mobilizer.X_PF = mobilizer.X_PF * Transform(turnOfF, way);
    mobilizer.X_BM = mobilizer.X_BM * Transform(~turnOfM);
}

MobilizedBody addMobilizedBody(const Mobilizer& mobilizer, MobilizedBody& parent,
                               const Transform& X_PF, const Body& body) {
    const Transform& X_BM = mobilizer.X_BM;
    const std::string& type = mobilizer.type;
    if (type == "pin") return MobilizedBody::Pin(parent, X_PF, body, X_BM);
    if (type == "slider") return MobilizedBody::Slider(parent, X_PF, body, X_BM);
    if (type == "ball") return MobilizedBody::Ball(parent, X_PF, body, X_BM);
    if (type == "weld") return MobilizedBody::Weld(parent, X_PF, body, X_BM);
    if (type == "universal") return MobilizedBody::Universal(parent, X_PF, body, X_BM);
    if (type == "planar") return MobilizedBody::Planar(parent, X_PF, body, X_BM);
    if (type == "cylinder") return MobilizedBody::Cylinder(parent, X_PF, body, X_BM);
    if (type == "translation") return MobilizedBody::Translation(parent, X_PF, body, X_BM);
    if (type == "screw") return MobilizedBody::Screw(parent, X_PF, body, X_BM, mobilizer.pitch);
    return MobilizedBody::Free(parent, X_PF, body, X_BM);
}

}  // namespace model
}  // namespace simflex
