/** @file
Probes of how frames move. **/

#include <map>

#include "simflex/body/FrameAcceleration.h"
#include "simflex/forces/Signal.h"
#include "simflex/model/probes/ProbeKinds.h"

namespace simflex {
namespace model {

using SimTK::Rotation;
using SimTK::SpatialVec;
using SimTK::Transform;
using SimTK::Vec3;

namespace {

/** Of M in F, in F's axes, rates as seen from F. **/
FrameMotion calcRelativeMotion(const FrameMotion& F, const FrameMotion& M) {
    const Vec3 &omega = F.V[0], &alpha = F.A[0];
    const Vec3 p = M.X.p() - F.X.p(), v = M.V[1] - F.V[1], a = M.A[1] - F.A[1];
    const Vec3 rate = v - omega % p, turning = M.V[0] - omega;
    FrameMotion motion;
    motion.X = ~F.X * M.X;
    motion.V = SpatialVec(~F.X.R() * turning, ~F.X.R() * rate);
    motion.A = SpatialVec(~F.X.R() * (M.A[0] - alpha - omega % turning),
                          ~F.X.R() * (a - alpha % p - omega % (omega % p) - 2 * (omega % rate)));
    return motion;
}

enum class Needs { Velocities, Accelerations };

struct FrameQuantity {
    const char* unit;
    Needs needs;
    Vec3 (*take)(const FrameMotion& motion);
};

const std::map<std::string, FrameQuantity>& getQuantities() {
    using Motion = FrameMotion;
    static const std::map<std::string, FrameQuantity> quantities{
        {"position", {"m", Needs::Velocities, [](const Motion& m) { return m.X.p(); }}},
        {"velocity", {"m/s", Needs::Velocities, [](const Motion& m) { return m.V[1]; }}},
        {"acceleration", {"m/s^2", Needs::Accelerations, [](const Motion& m) { return m.A[1]; }}},
        {"orientation",
         {"rad", Needs::Velocities,
          [](const Motion& m) { return m.X.R().convertRotationToBodyFixedXYZ(); }}},
        {"angular_velocity", {"rad/s", Needs::Velocities, [](const Motion& m) { return m.V[0]; }}},
        {"angular_acceleration",
         {"rad/s^2", Needs::Accelerations, [](const Motion& m) { return m.A[0]; }}}};
    return quantities;
}

/** The quantity that an entry asks for, or null. **/
const std::pair<const std::string, FrameQuantity>* findQuantity(const ModelValue& entry) {
    for (const auto& quantity : getQuantities())
        if (entry.has(quantity.first)) return &quantity;
    return nullptr;
}

}  // namespace

namespace {

Probe makeDistance(const ProbeSource& source, const char* key, const char* unit,
                   Signal (*make)(const Attachment&, const Attachment&)) {
    const ModelValue frames = source.entry.get(key);
    const Signal signal =
        make(source.model->findFrame(frames.at(0)), source.model->findFrame(frames.at(1)));
    Probe probe;
    probe.unit = unit;
    probe.columns = {""};
    probe.calc = [model = source.model, signal](const Moment& moment, double* values) {
        *values = signal.calcValue(model->getFlexibleBodies(), moment.state);
    };
    return probe;
}

}  // namespace

Probe makeDistanceProbe(const ProbeSource& source) {
    return makeDistance(source, "distance", "m", &Signal::distance);
}

Probe makeDistanceRateProbe(const ProbeSource& source) {
    return makeDistance(source, "distance_rate", "m/s", &Signal::distanceRate);
}

bool isFrameProbe(const ModelValue& entry) {
    return findQuantity(entry) != nullptr;
}

Probe makeFrameProbe(const ProbeSource& source) {
    const auto& [key, quantity] = *findQuantity(source.entry);
    std::vector<Attachment> frames{source.model->findFrame(source.entry.get(key))};
    if (source.entry.get("relative_to").isGiven())
        frames.push_back(source.model->findFrame(source.entry.get("relative_to")));
    Probe probe;
    probe.unit = quantity.unit;
    probe.columns = {"x", "y", "z"};
    probe.calc = [model = source.model, frames, quantity = quantity](const Moment& moment,
                                                                     double* values) {
        std::vector<FrameMotion> motions;
        if (quantity.needs == Needs::Accelerations)
            motions =
                calcFrameMotions(model->getFlexibleBodies(), moment.state, moment.uDot, frames);
        else
            for (const Attachment& frame : frames)
                motions.push_back(frame.calcMotion(moment.state));
        const Vec3 value = quantity.take(
            frames.size() > 1 ? calcRelativeMotion(motions[1], motions[0]) : motions[0]);
        for (int k = 0; k < 3; ++k) values[k] = value[k];
    };
    return selectComponent(source.entry, std::move(probe));
}

}  // namespace model
}  // namespace simflex
