/** @file
Probes of the motion of frames. **/

#include "simflex/body/FrameAcceleration.h"
#include "simflex/model/probes/FrameSignals.h"
#include "simflex/model/probes/ProbeKinds.h"

namespace simflex {
namespace model {

using SimTK::Rotation;
using SimTK::SpatialVec;
using SimTK::Transform;
using SimTK::Vec3;

namespace {

/** Motion of M relative to F, in axes of F, with rates as seen from F. **/
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

enum class Needs { Poses, Accelerations };

struct FrameQuantity {
    const char* key;
    const char* unit;
    Needs needs;
    Vec3 (*take)(const FrameMotion& motion);
};

/** Quantities that are not available as signals. **/
constexpr FrameQuantity FrameQuantities[] = {
    {"acceleration", "m/s^2", Needs::Accelerations, [](const FrameMotion& m) { return m.A[1]; }},
    {"orientation", "rad", Needs::Poses,
     [](const FrameMotion& m) { return m.X.R().convertRotationToBodyFixedXYZ(); }},
    {"angular_acceleration", "rad/s^2", Needs::Accelerations,
     [](const FrameMotion& m) { return m.A[0]; }}};

/** The quantity of an entry, or null. **/
const FrameQuantity* findQuantity(const ModelValue& entry) {
    for (const FrameQuantity& quantity : FrameQuantities)
        if (entry.has(quantity.key)) return &quantity;
    return nullptr;
}

/** The frame that the entry's key names, and the reference frame if there is one. **/
std::vector<Attachment> findFrames(const ProbeSource& source, const char* key) {
    std::vector<Attachment> frames{source.model->findFrame(source.entry.get(key))};
    const ModelValue reference = source.entry.get("relative_to");
    if (reference.isGiven()) frames.push_back(source.model->findFrame(reference));
    return frames;
}

}  // namespace

Probe makeOfSignals(const std::shared_ptr<const Model>& model, const std::string& unit,
                    const std::vector<Signal>& signals) {
    Probe probe;
    probe.unit = unit;
    probe.columns = signals.size() == 1 ? std::vector<std::string>{""}
                                        : std::vector<std::string>{"x", "y", "z"};
    probe.signals = signals;
    probe.calc = [model, signals](const Moment& moment, double* values) {
        for (const Signal& signal : signals)
            *values++ = signal.calcValue(model->getFlexibleBodies(), moment.state);
    };
    return probe;
}

bool isFrameProbe(const ModelValue& entry) {
    return findFrameSignalKind(entry) || findDistanceSignalKind(entry) || findQuantity(entry);
}

Probe makeFrameProbe(const ProbeSource& source) {
    if (const DistanceSignalKind* kind = findDistanceSignalKind(source.entry)) {
        const ModelValue frames = source.entry.get(kind->key);
        return makeOfSignals(source.model, kind->unit,
                             {kind->make(source.model->findFrame(frames.at(0)),
                                         source.model->findFrame(frames.at(1)))});
    }
    if (const FrameSignalKind* kind = findFrameSignalKind(source.entry)) {
        const std::vector<Attachment> frames = findFrames(source, kind->key);
        const Attachment F =
            frames.size() > 1 ? frames[1] : Attachment(source.model->getMatter().getGround());
        return makeOfSignals(source.model, kind->unit,
                             makeFrameSignals(*kind, source.entry, F, frames[0]));
    }
    const FrameQuantity& quantity = *findQuantity(source.entry);
    Probe probe;
    probe.unit = quantity.unit;
    probe.columns = {"x", "y", "z"};
    probe.calc = [model = source.model, frames = findFrames(source, quantity.key), quantity](
                     const Moment& moment, double* values) {
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
