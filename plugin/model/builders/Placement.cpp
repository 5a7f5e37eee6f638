#include "simflex/model/builders/Placement.h"

#include <algorithm>

#include "simflex/base/DependencyOrder.h"
#include "simflex/model/builders/ModelGeometry.h"

namespace simflex {
namespace model {

using namespace SimTK;

Placement::Placement(const ModelValue& file, const ModelFrames& frames)
    : m_bodies(file.get("bodies")), m_frames(frames) {
    const size_t count = frames.getBodyNames().size();
    m_poses.resize(count);
    m_mobilizers.resize(count);
    m_places.resize(count);
    for (size_t i = 0; i < count; ++i) {
        const ModelValue body = m_bodies.get(frames.getBodyNames()[i]);
        if (!frames.getPart(int(i))) m_mobilizers[i] = readMobilizer(body.get("mobilizer"), frames);
    }
    for (size_t i = 0; i < count; ++i) place(int(i));
}

void Placement::place(int body) {
    if (isPlaced(body)) return;
    const auto findOpen = [&](int i) -> std::optional<int> {
        if (!m_places[size_t(i)]) m_places[size_t(i)] = readPlace(i);
        for (const int other : {m_mobilizers[size_t(i)].parent.body, m_places[size_t(i)]->at.body})
            if (other >= 0 && !isPlaced(other)) return other;
        return {};
    };
    const auto finish = [&](int i) {
        Mobilizer& mobilizer = m_mobilizers[size_t(i)];
        m_poses[size_t(i)] = calcPlace(i);
        if (m_places[size_t(i)]->isGiven)
            countFromPlace(mobilizer, calcPose(mobilizer.parent), *m_poses[size_t(i)]);
        m_order.push_back(i);
    };
    const auto failCircle = [&](const std::vector<int>& circle) {
        const std::vector<std::string>& names = m_frames.getBodyNames();
        const std::string& first = names[size_t(circle.front())];
        std::string text;
        for (const int i : circle) text += names[size_t(i)] + " -> ";
        const ModelValue value = m_bodies.get(first);
        const ModelValue place = value.get("place");
        (place.isGiven() ? place : value)
            .fail("the places of bodies refer to each other in a circle: " + text + first +
                  "; give one of them a position");
    };
    finishInOrder(body, findOpen, finish, failCircle);
}

Placement::Place Placement::readPlace(int body) const {
    const ModelValue place = m_bodies.get(m_frames.getBodyNames()[size_t(body)]).get("place");
    Place result;
    result.own.body = body;
    if (!place.isGiven()) return result;
    result.isGiven = true;
    result.offset = readPose(place);
    if (place.has("frame")) result.own = m_frames.find(place.get("frame"), body);
    if (result.own.body != body)
        place.get("frame").fail("it is on " + m_frames.describe(result.own) +
                                "; `frame` is one of the body's own, `at` the other");
    if (place.has("at")) result.at = m_frames.find(place.get("at"));
    if (result.at.body == body)
        place.get("at").fail("a body cannot be placed at a frame of its own");
    return result;
}

Transform Placement::calcPlace(int body) const {
    const Place& place = *m_places[size_t(body)];
    if (place.isGiven) return calcPose(place.at) * place.offset * ~m_frames.calcPose(place.own);
    const Mobilizer& mobilizer = m_mobilizers[size_t(body)];
    if (mobilizer.isFree()) return Transform();
    return calcPose(mobilizer.parent) * mobilizer.X_PF * ~mobilizer.X_BM;
}

Transform Placement::calcPose(const FrameOnBody& frame) const {
    const Transform X = m_frames.calcPose(frame);
    return frame.body < 0 ? X : getPose(frame.body) * X;
}

double Placement::calcSize() const {
    Vec3 low(Infinity), high(-Infinity);
    const auto add = [&](const Vec3& p) {
        for (int a = 0; a < 3; ++a)
            low[a] = std::min(low[a], p[a]), high[a] = std::max(high[a], p[a]);
    };
    for (size_t i = 0; i < m_poses.size(); ++i) {
        add(getPose(int(i)) * m_frames.calcBodyFrame(int(i)).p());
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
