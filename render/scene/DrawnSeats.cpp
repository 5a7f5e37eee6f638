#include "DrawnSeats.h"

#include <algorithm>
#include <cmath>

#include "simflex/body/FlexibleBody.h"
#include "simflex/body/FlexibleBodySubsystem.h"

namespace simflex {

using SimTK::Vec3;

namespace {

const ReducedBody::Interface* findInterface(const ReducedBody& part, const Vec3& s) {
    for (const auto& interface : part.interfaces)
        if (Vec3(interface.position[0], interface.position[1], interface.position[2]) == s)
            return &interface;
    return nullptr;
}

FlexibleBody getBody(const SimTK::SimbodyMatterSubsystem& matter, const Attachment& frame) {
    return FlexibleBodySubsystem::find(matter.getSystem())->getBody(frame.getFlexibleBodyIndex());
}

}  // namespace

SymbolSize calcSeatSize(const SimTK::SimbodyMatterSubsystem& matter,
                        const std::vector<const Attachment*>& frames, double scale) {
    SymbolSize size{0.05 * scale, 0.05 * scale};
    for (const Attachment* frame : frames) {
        if (!frame->isFlexible()) continue;
        const ReducedBody& part = getBody(matter, *frame).getPart();
        const FlexibleFrame& seat = frame->getFlexibleFrame();
        const auto* const interface = findInterface(part, seat.shapes->s);
        if (!interface || interface->nodes.empty()) continue;
        const Vec3 origin = seat.shapes->s + seat.X_IA.p(), z(seat.X_IA.R().z());
        double sum = 0, reach = 0;
        for (const int node : interface->nodes) {
            const auto p = part.mesh.position(node);
            const Vec3 away = Vec3(p[0], p[1], p[2]) - origin;
            const double along = SimTK::dot(away, z);
            sum += (away - along * z).norm();
            reach = std::max(reach, std::abs(along));
        }
        const auto limit = [&](double value) {
            return std::min(0.12 * scale, std::max(0.012 * scale, value));
        };
        return {limit(sum / double(interface->nodes.size())), limit(reach)};
    }
    return size;
}

}  // namespace simflex
