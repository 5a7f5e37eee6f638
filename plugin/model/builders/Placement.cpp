#include "simflex/model/builders/Placement.h"

#include <algorithm>

#include "simflex/model/builders/ModelGeometry.h"

namespace simflex {
namespace model {

using namespace SimTK;

Placement::Placement(const ModelValue& file, const ModelFrames& frames)
    : m_bodies(file.get("bodies")), m_frames(frames) {
    const size_t count = frames.getBodyNames().size();
    m_poses.resize(count);
    m_mobilizers.resize(count);
    m_marks.resize(count, Mark::Open);
    for (size_t i = 0; i < count; ++i) {
        const ModelValue body = m_bodies.get(frames.getBodyNames()[i]);
        if (!frames.getPart(int(i))) m_mobilizers[i] = readMobilizer(body.get("mobilizer"), frames);
    }
    for (size_t i = 0; i < count; ++i) place(int(i));
}

void Placement::place(int body) {
    if (m_marks[size_t(body)] == Mark::Placed) return;
    const std::string& name = m_frames.getBodyNames()[size_t(body)];
    if (m_marks[size_t(body)] == Mark::Placing) {
        std::string circle;
        for (auto i = std::find(m_path.begin(), m_path.end(), body); i != m_path.end(); ++i)
            circle += m_frames.getBodyNames()[size_t(*i)] + " -> ";
        const ModelValue value = m_bodies.get(name);
        const ModelValue place = value.get("place");
        (place.isGiven() ? place : value)
            .fail("the places of bodies refer to each other in a circle: " + circle + name +
                  "; give one of them a position");
    }
    m_marks[size_t(body)] = Mark::Placing;
    m_path.push_back(body);
    m_poses[size_t(body)] = calcPlace(body);
    if (m_bodies.get(name).get("place").isGiven())
        countFromPlace(m_mobilizers[size_t(body)], calcPose(m_mobilizers[size_t(body)].parent),
                       m_poses[size_t(body)]);
    m_path.pop_back();
    m_marks[size_t(body)] = Mark::Placed;
    m_order.push_back(body);
}

Transform Placement::follow(const FrameOnBody& frame) {
    if (frame.body >= 0) place(frame.body);
    return calcPose(frame);
}

Transform Placement::calcPlace(int body) {
    const ModelValue value = m_bodies.get(m_frames.getBodyNames()[size_t(body)]);
    const ModelValue place = value.get("place");
    const Mobilizer& mobilizer = m_mobilizers[size_t(body)];
    const Transform X_GP = follow(mobilizer.parent);  // also places the parent first
    if (!place.isGiven())
        return mobilizer.isFree() ? Transform() : X_GP * mobilizer.X_PF * ~mobilizer.X_BM;
    const Transform offset = readPose(place);
    const bool hasFrame = place.has("frame"), hasAt = place.has("at");
    if (!hasFrame && !hasAt) return offset;
    FrameOnBody own;
    own.body = body;
    if (hasFrame) own = m_frames.find(place.get("frame"), body);
    if (own.body != body)
        place.get("frame").fail("it is on " + m_frames.describe(own) +
                                "; `frame` is one of the body's own, `at` the other");
    FrameOnBody other;
    if (hasAt) other = m_frames.find(place.get("at"));
    if (other.body == body) place.get("at").fail("a body cannot be placed at a frame of its own");
    return follow(other) * offset * ~m_frames.calcPose(own);
}

Transform Placement::calcPose(const FrameOnBody& frame) const {
    const Transform X = m_frames.calcPose(frame);
    return frame.body < 0 ? X : m_poses[size_t(frame.body)] * X;
}

double Placement::calcSize() const {
    Vec3 low(Infinity), high(-Infinity);
    const auto add = [&](const Vec3& p) {
        for (int a = 0; a < 3; ++a)
            low[a] = std::min(low[a], p[a]), high[a] = std::max(high[a], p[a]);
    };
    for (size_t i = 0; i < m_poses.size(); ++i) {
        add(m_poses[i] * m_frames.calcBodyFrame(int(i)).p());
        if (!m_frames.getPart(int(i))) continue;
        for (const ReducedBody::Interface& interface : m_frames.getPart(int(i))->interfaces) {
            FrameOnBody frame;
            frame.body = int(i);
            frame.interface = interface.name;
            add(calcPose(frame).p());
        }
    }
    return m_poses.empty() ? LeastSize : std::max(LeastSize, (high - low).norm());
}

}  // namespace model
}  // namespace simflex
