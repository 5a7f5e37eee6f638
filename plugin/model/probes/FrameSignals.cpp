#include "simflex/model/probes/FrameSignals.h"

namespace simflex {
namespace model {

namespace {

constexpr FrameSignalKind FrameKinds[] = {{"position", "m", &Signal::displacement},
                                          {"velocity", "m/s", &Signal::displacementRate},
                                          {"angular_velocity", "rad/s", &Signal::angularVelocity}};
constexpr DistanceSignalKind DistanceKinds[] = {{"distance", "m", &Signal::distance},
                                                {"distance_rate", "m/s", &Signal::distanceRate}};

template <class Kind, size_t count>
const Kind* findKind(const Kind (&kinds)[count], const ModelValue& entry) {
    for (const Kind& kind : kinds)
        if (entry.has(kind.key)) return &kind;
    return nullptr;
}

Signal makeNorm(const std::vector<Signal>& components) {
    return Signal::function(components, [](SimTK::Real, const SimTK::Real* x, SimTK::Real* slopes) {
        const SimTK::Real norm = SimTK::Vec3::getAs(x).norm();
        for (int i = 0; slopes && i < 3; ++i) slopes[i] = norm > 0 ? x[i] / norm : 0;
        return norm;
    });
}

}  // namespace

const FrameSignalKind* findFrameSignalKind(const ModelValue& entry) {
    return findKind(FrameKinds, entry);
}

const DistanceSignalKind* findDistanceSignalKind(const ModelValue& entry) {
    return findKind(DistanceKinds, entry);
}

std::vector<Signal> makeFrameSignals(const FrameSignalKind& kind, const ModelValue& entry,
                                     const Attachment& F, const Attachment& M) {
    std::vector<Signal> all;
    for (int axis = 0; axis < 3; ++axis)
        all.push_back(kind.make(F, M, SimTK::CoordinateAxis(axis)));
    const std::string component = entry.get("component").getText();
    if (component == "all") return all;
    if (component == "norm") return {makeNorm(all)};
    return {all[size_t(component[0] - 'x')]};
}

}  // namespace model
}  // namespace simflex
