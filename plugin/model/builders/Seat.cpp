#include "simflex/model/builders/Seat.h"

#include "simflex/model/file/NearestName.h"

namespace simflex {
namespace model {

FrameOnBody findSeat(const ModelValue& value, const ModelFrames& frames) {
    const FrameOnBody frame = frames.find(value);
    const ReducedBody* part = frame.body < 0 ? nullptr : frames.getPart(frame.body);
    if (!part || !frame.interface.empty() || frame.node) return frame;
    const std::string& body = frames.getBodyNames()[size_t(frame.body)];
    std::vector<std::string> names;
    for (const ReducedBody::Interface& interface : part->interfaces)
        names.push_back(body + "." + interface.name);
    value.fail("'" + body + "' is flexible and can be held at its interfaces and nodes only: " +
               (names.empty() ? "" : joinNames(names) + ", or ") + "{on: " + body +
               ", node: NUMBER}");
}

}  // namespace model
}  // namespace simflex
