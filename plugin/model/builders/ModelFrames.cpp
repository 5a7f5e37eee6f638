#include "simflex/model/builders/ModelFrames.h"

#include <algorithm>

#include "simflex/base/DependencyOrder.h"
#include "simflex/model/builders/ModelGeometry.h"

namespace simflex {
namespace model {

using namespace SimTK;

namespace {

Vec3 toVec3(const std::array<double, 3>& a) {
    return Vec3(a[0], a[1], a[2]);
}

bool hasInterface(const ReducedBody& part, const std::string& name) {
    for (const ReducedBody::Interface& interface : part.interfaces)
        if (interface.name == name) return true;
    return false;
}

std::vector<std::string> listInterfaces(const ReducedBody& part) {
    std::vector<std::string> names;
    for (const ReducedBody::Interface& interface : part.interfaces) names.push_back(interface.name);
    return names;
}

}  // namespace

FrameOnBody FrameOnBody::moved(const Transform& X) const {
    FrameOnBody result = *this;
    result.X_base = X_base * X;
    return result;
}

ModelFrames::ModelFrames(const ModelValue& file, const Parts& parts) : m_file(file) {
    const ModelValue bodies = file.get("bodies");
    for (const std::string& name : bodies.getKeys()) {
        m_numbers[name] = int(m_names.size());
        m_names.push_back(name);
        const ModelValue part = bodies.get(name).get("part");
        if (!part.isGiven()) {
            m_parts.emplace_back();
            continue;
        }
        const auto found = parts.find(part.getText());
        if (found == parts.end())
            part.failUnknown("part", part.getText(), file.get("parts").getKeys());
        m_parts.push_back(found->second);
    }
    for (const std::string& name : file.get("frames").getKeys())
        if (m_numbers.count(name))
            file.get("frames").get(name).fail("there is a body of this name too");
}

int ModelFrames::findBody(const ModelValue& name) const {
    const auto found = m_numbers.find(name.getText());
    if (found == m_numbers.end()) name.failUnknown("body", name.getText(), m_names);
    return found->second;
}

std::vector<std::string> ModelFrames::listKnown(int own) const {
    std::vector<std::string> known{"ground"};
    if (own >= 0 && getPart(own))
        for (const std::string& interface : listInterfaces(*getPart(own)))
            known.push_back(interface);
    for (const std::string& frame : m_file.get("frames").getKeys()) known.push_back(frame);
    for (size_t i = 0; i < m_names.size(); ++i) {
        known.push_back(m_names[i]);
        if (!m_parts[i]) continue;
        for (const std::string& interface : listInterfaces(*m_parts[i]))
            known.push_back(m_names[i] + "." + interface);
    }
    return known;
}

FrameOnBody ModelFrames::find(const std::string& name, const Unknown& fail, int own) const {
    FrameOnBody frame;
    if (name == "ground") return frame;
    if (own >= 0 && getPart(own) && hasInterface(*getPart(own), name)) {
        frame.body = own;
        frame.interface = name;
        return frame;
    }
    if (m_file.get("frames").has(name)) {
        resolve(name);
        return m_resolved.at(name);
    }
    const size_t dot = name.find('.');
    const auto body = m_numbers.find(name.substr(0, dot));
    if (body == m_numbers.end()) fail("frame", name, listKnown(own));
    frame.body = body->second;
    if (dot == std::string::npos) return frame;
    frame.interface = name.substr(dot + 1);
    const ReducedBody* part = getPart(frame.body);
    if (!part) fail("frame of the rigid body '" + body->first + "' called", name, listKnown(own));
    if (!hasInterface(*part, frame.interface))
        fail("interface of '" + body->first + "' called", frame.interface, listInterfaces(*part));
    return frame;
}

void ModelFrames::resolve(const std::string& frame) const {
    if (m_resolved.count(frame)) return;
    const ModelValue frames = m_file.get("frames");
    const auto findOpen = [&](const std::string& name) -> std::optional<std::string> {
        ModelValue on = frames.get(name);
        while (on.isMap()) on = on.get("on");
        const std::string other = on.getText();
        if (other == "ground" || !frames.has(other) || m_resolved.count(other)) return {};
        return other;
    };
    const auto finish = [&](const std::string& name) { m_resolved[name] = find(frames.get(name)); };
    const auto failCircle = [&](const std::vector<std::string>& circle) {
        std::string text;
        for (const std::string& name : circle) text += name + " -> ";
        frames.get(circle.front()).fail("frames are on each other: " + text + circle.front());
    };
    finishInOrder(frame, findOpen, finish, failCircle);
}

FrameOnBody ModelFrames::findMap(const ModelValue& value, int own) const {
    FrameOnBody frame = find(value.get("on"), own);
    const ModelValue node = value.get("node");
    if (node.isGiven()) {
        if (frame.body < 0 || !getPart(frame.body) || !frame.interface.empty() || frame.node)
            node.fail("only flexible bodies have nodes: `on` must be the name of one");
        frame.node = node.getInteger();
        const std::vector<int>& numbers = getPart(frame.body)->mesh.nodeNumbers;
        if (std::find(numbers.begin(), numbers.end(), *frame.node) == numbers.end())
            node.fail("'" + m_names[size_t(frame.body)] + "' has no node " +
                      std::to_string(*frame.node) + "; they are from " +
                      std::to_string(*std::min_element(numbers.begin(), numbers.end())) + " to " +
                      std::to_string(*std::max_element(numbers.begin(), numbers.end())));
        frame.X_base = Transform();
    }
    return frame.moved(readPose(value));
}

FrameOnBody ModelFrames::find(const ModelValue& frame, int own) const {
    if (frame.isMap()) return findMap(frame, own);
    return find(
        frame.getText(),
        [&](const std::string& what, const std::string& name,
            const std::vector<std::string>& known) { frame.failUnknown(what, name, known); },
        own);
}

Transform ModelFrames::calcBodyFrame(int body) const {
    const ReducedBody* part = getPart(body);
    return part ? Transform(toVec3(part->centerOfMass)) : Transform();
}

Transform ModelFrames::calcPose(const FrameOnBody& frame) const {
    if (frame.body < 0) return frame.X_base;
    const ReducedBody* part = getPart(frame.body);
    if (!frame.interface.empty())
        return Transform(toVec3(part->centerOfMass) +
                         toVec3(part->getInterface(frame.interface).position)) *
               frame.X_base;
    if (frame.node) {
        const std::vector<int>& numbers = part->mesh.nodeNumbers;
        const size_t i =
            size_t(std::find(numbers.begin(), numbers.end(), *frame.node) - numbers.begin());
        const double* s = &part->mesh.positions[3 * i];
        return Transform(toVec3(part->centerOfMass) + Vec3(s[0], s[1], s[2])) * frame.X_base;
    }
    return frame.X_base;
}

Attachment ModelFrames::attach(const FrameOnBody& frame, const ModelSystem& system) const {
    if (frame.body < 0) return Attachment(system.matter.getGround(), frame.X_base);
    const Model::BodyEntry& body = system.bodies[size_t(frame.body)];
    if (!frame.interface.empty()) return body.flexible->interface(frame.interface, frame.X_base);
    if (frame.node) return body.flexible->node(*frame.node, frame.X_base);
    return Attachment(body.mobod, body.X_BP * frame.X_base);
}

std::string ModelFrames::describe(const FrameOnBody& frame) const {
    if (frame.body < 0) return "ground";
    const std::string& name = m_names[size_t(frame.body)];
    if (!frame.interface.empty()) return name + "." + frame.interface;
    return frame.node ? name + " node " + std::to_string(*frame.node) : name;
}

}  // namespace model
}  // namespace simflex
