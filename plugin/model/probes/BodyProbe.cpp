/** @file
Probes of deformation and stress. **/

#include <algorithm>
#include <cmath>

#include "simflex/body/StressRecovery.h"
#include "simflex/model/probes/ProbeKinds.h"
#include "simflex/part/MeshFaces.h"

namespace simflex {
namespace model {

using SimTK::Array_;
using SimTK::State;
using SimTK::SymMat33;
using SimTK::Vec3;
using SimTK::Vector;

namespace {

void put(const Vec3& vector, double* values) {
    for (int k = 0; k < 3; ++k) values[k] = vector[k];
}

/** A number computed from a tensor. **/
using TensorValue = double (*)(const SymMat33& tensor);

struct TensorKind {
    const char* name;
    TensorValue calc;
};

const TensorKind TensorKinds[] = {
    {"von_mises", [](const SymMat33& s) { return double(calcVonMises(s)); }},
    {"signed_von_mises", [](const SymMat33& s) { return double(calcSignedVonMises(s)); }},
    {"principal_1", [](const SymMat33& s) { return double(calcPrincipalValues(s)[0]); }},
    {"principal_2", [](const SymMat33& s) { return double(calcPrincipalValues(s)[1]); }},
    {"principal_3", [](const SymMat33& s) { return double(calcPrincipalValues(s)[2]); }},
    {"xx", [](const SymMat33& s) { return double(s(0, 0)); }},
    {"yy", [](const SymMat33& s) { return double(s(1, 1)); }},
    {"zz", [](const SymMat33& s) { return double(s(2, 2)); }},
    {"xy", [](const SymMat33& s) { return double(s(1, 0)); }},
    {"zx", [](const SymMat33& s) { return double(s(2, 0)); }},
    {"yz", [](const SymMat33& s) { return double(s(2, 1)); }},
};

TensorValue findTensorKind(const ModelValue& what) {
    const std::string name = what.getText();
    std::vector<std::string> known;
    for (const TensorKind& kind : TensorKinds) {
        if (name == kind.name) return kind.calc;
        known.push_back(kind.name);
    }
    what.failUnknown("kind of stress or strain", name, known);
}

enum class Tensor { Stress, Strain };

/** Value of largest magnitude, with its sign. **/
double findWorst(const Array_<SymMat33>& tensors, TensorValue calc) {
    double worst = 0;
    for (const SymMat33& tensor : tensors) {
        const double value = calc(tensor);
        if (std::isnan(value)) return value;
        if (std::abs(value) > std::abs(worst)) worst = value;
    }
    return worst;
}

/** Numbers of the nodes whose tensors a probe at one node averages. **/
std::vector<int> findTensorNodes(const FlexibleBody& body, const ModelValue& map) {
    const ModelValue node = map.get("node"), sideKey = map.get("side");
    const int number = node.getInteger();
    const Mesh& mesh = body.getPart().mesh;
    const auto write = [&](const std::vector<int>& nodes) {
        std::string text;
        for (const int other : nodes)
            if (mesh.nodeNumbers[size_t(other)] != number)
                text +=
                    (text.empty() ? "" : ", ") + std::to_string(mesh.nodeNumbers[size_t(other)]);
        return text;
    };
    if (!sideKey.isGiven()) {
        const auto expanded = mesh.expandedNodes.find(number);
        if (expanded == mesh.expandedNodes.end()) return {number};
        if (!listNodesOnSide(mesh, number, ShellSide::Top).empty())
            node.fail("node " + std::to_string(number) +
                      " is a shell's, which has stress on its sides; add 'side: top', 'side: "
                      "bottom' or 'side: middle'");
        node.fail("node " + std::to_string(number) +
                  " is a beam's, which has stress at the nodes around it: " +
                  write(expanded->second) + "; give one of these");
    }
    const std::string side = sideKey.getText();
    std::vector<int> numbers;
    for (const auto& [name, which] :
         {std::pair("bottom", ShellSide::Bottom), std::pair("top", ShellSide::Top)}) {
        if (side != name && side != "middle") continue;
        const std::vector<int> nodes = listNodesOnSide(mesh, number, which);
        if (nodes.empty())
            sideKey.fail("node " + std::to_string(number) + " of '" + body.getName() +
                         "' is no node of a shell in the deck, or its part was reduced by an "
                         "earlier version");
        if (nodes.size() > 1)
            sideKey.fail("shells of several normals or thicknesses meet at node " +
                         std::to_string(number) + "; instead of 'side', give one of the nodes " +
                         write(nodes) + " on its " + name);
        numbers.push_back(mesh.nodeNumbers[size_t(nodes[0])]);
    }
    return numbers;
}

Probe makeTensorProbe(const ProbeSource& source, const ModelValue& map, Tensor tensor) {
    const ModelValue name = map.get("body");
    const FlexibleBody& body = findFlexible(*source.model, name);
    const bool isWorst = map.get("worst").isGiven() && map.get("worst").getBool();
    if (isWorst == map.get("node").isGiven())
        map.fail(isWorst ? "has both 'node' and 'worst'; give one of them"
                         : "needs the number of a node ('node: 118') or 'worst: true'");
    if (isWorst && map.get("side").isGiven())
        map.get("side").fail("'worst' takes all sides; leave 'side' out");
    std::shared_ptr<StressRecovery> recovery;
    std::vector<int> nodes;
    if (!isWorst) nodes = findTensorNodes(body, map);
    try {
        recovery = isWorst ? std::make_shared<StressRecovery>(body)
                           : std::make_shared<StressRecovery>(body, nodes);
        recovery->checkStress();
    } catch (const std::exception& error) {
        (isWorst ? name : map.get("node")).fail(error.what());
    }
    const TensorValue calc = findTensorKind(map.get("what"));
    // Equivalent strain is √(2/3 e:e) of the deviator e: in a bar with ν = ½ the axial strain.
    const bool isEquivalent = map.get("what").getText().find("von_mises") != std::string::npos;
    const double factor = tensor == Tensor::Strain && isEquivalent ? 2.0 / 3 : 1;
    Probe probe;
    probe.unit = tensor == Tensor::Stress ? "Pa" : "";
    probe.columns = {""};
    probe.calc = [model = source.model, recovery, calc, tensor, factor, isWorst](
                     const Moment& moment, double* values) {
        thread_local Array_<SymMat33> tensors;
        if (tensor == Tensor::Stress)
            recovery->calcStress(moment.state, tensors);
        else
            recovery->calcStrain(moment.state, tensors);
        if (!isWorst && tensors.size() == 2) {  // both sides of a shell
            const SymMat33 mean = (tensors[0] + tensors[1]) * SimTK::Real(0.5);
            tensors.assign(1, mean);
        }
        *values = factor * findWorst(tensors, calc);
    };
    return probe;
}

}  // namespace

const FlexibleBody& findFlexible(const Model& model, const ModelValue& name) {
    const Model::BodyEntry& body = model.findBody(name);
    if (!body.flexible) {
        std::string flexible;
        for (const Model::BodyEntry& other : model.getBodies())
            if (other.flexible) flexible += (flexible.empty() ? "" : ", ") + other.name;
        name.fail("body '" + body.name + "' has no part that could deform; flexible bodies are: " +
                  (flexible.empty() ? "none" : flexible));
    }
    return *body.flexible;
}

namespace {

FlexibleFramePose calcPose(const Attachment& frame, const Vector& xi, const State& state) {
    return FrameAtXi(frame.getFlexibleFrame(), xi.size() > 0 ? &xi[0] : nullptr,
                     frame.getFrameOrder(state))
        .getPose();
}

/** Position of one frame of a body in another, minus the same undeformed: the deflection of a tip
relative to its support. **/
Probe makeDeflectionProbe(const ProbeSource& source, const Attachment& frame) {
    const ModelValue support = source.entry.get("relative_to");
    const Attachment base = source.model->findFrame(support);
    if (!base.isFlexible() || base.getFlexibleBodyIndex() != frame.getFlexibleBodyIndex())
        support.fail(
            "a displacement is relative to an interface or node of the same body, '" +
            source.model->getFlexibleBodies().getBody(frame.getFlexibleBodyIndex()).getName() +
            "', not to " + base.getName());
    Probe probe;
    probe.unit = "m";
    probe.columns = {"x", "y", "z"};
    probe.calc = [model = source.model, frame, base](const Moment& moment, double* values) {
        const Vector xi = model->getFlexibleBodies()
                              .getBody(frame.getFlexibleBodyIndex())
                              .getModalCoordinates(moment.state);
        const auto calcPlace = [&](const Vector& modes) {
            const FlexibleFramePose F = calcPose(base, modes, moment.state),
                                    M = calcPose(frame, modes, moment.state);
            return ~F.R_BA * (M.r - F.r);
        };
        put(calcPlace(xi) - calcPlace(Vector(xi.size(), SimTK::Real(0))), values);
    };
    return selectComponent(source.entry, std::move(probe));
}

}  // namespace

Probe makeDisplacementProbe(const ProbeSource& source) {
    const ModelValue what = source.entry.get("displacement");
    const bool isRelative = source.entry.get("relative_to").isGiven();
    Probe probe;
    probe.unit = "m";
    probe.columns = {"x", "y", "z"};
    if (what.isMap() && what.has("body")) {
        const FlexibleBody body = findFlexible(*source.model, what.get("body"));
        const int node = what.get("node").getInteger();
        try {
            StressRecovery(body, std::vector<int>{node});
        } catch (const std::exception& error) {
            what.get("node").fail(error.what());
        }
        if (isRelative) return makeDeflectionProbe(source, Attachment::onNode(body, node));
        probe.calc = [model = source.model, body, node](const Moment& moment, double* values) {
            put(body.calcNodeDisplacement(moment.state, node), values);
        };
        return selectComponent(source.entry, std::move(probe));
    }
    const Attachment frame = source.model->findFrame(what);
    if (!frame.isFlexible())
        what.fail(frame.getName() +
                  " does not deform; name an interface (BODY.INTERFACE) or a node of a flexible "
                  "body");
    if (isRelative) return makeDeflectionProbe(source, frame);
    probe.calc = [model = source.model, frame](const Moment& moment, double* values) {
        const FlexibleBody body = model->getFlexibleBodies().getBody(frame.getFlexibleBodyIndex());
        const Vector xi = body.getModalCoordinates(moment.state);
        const Vector rest(xi.size(), SimTK::Real(0));
        put(calcPose(frame, xi, moment.state).r - calcPose(frame, rest, moment.state).r, values);
    };
    return selectComponent(source.entry, std::move(probe));
}

Probe makeLargestDisplacementProbe(const ProbeSource& source) {
    const FlexibleBody body = findFlexible(*source.model, source.entry.get("largest_displacement"));
    Probe probe;
    probe.unit = "m";
    probe.columns = {""};
    probe.calc = [model = source.model, body](const Moment& moment, double* values) {
        *values = body.calcLargestDisplacement(moment.state);
    };
    return probe;
}

Probe makeModesProbe(const ProbeSource& source) {
    const FlexibleBody body = findFlexible(*source.model, source.entry.get("modes"));
    const ModelValue select = source.entry.get("select");
    std::vector<int> modes;
    Probe probe;
    probe.unit = "m kg^0.5";
    for (int k = 0; !select.isGiven() && k < body.getNumModes(); ++k) modes.push_back(k);
    for (int k = 0; select.isGiven() && k < select.getSize(); ++k) {
        const int mode = select.at(k).getInteger();
        if (mode < 1 || mode > body.getNumModes())
            select.at(k).fail("there is no mode " + std::to_string(mode) + "; '" + body.getName() +
                              "' has modes 1 to " + std::to_string(body.getNumModes()));
        modes.push_back(mode - 1);
    }
    for (const int mode : modes)
        probe.columns.push_back(select.isGiven() && modes.size() == 1 ? ""
                                                                      : std::to_string(mode + 1));
    probe.calc = [model = source.model, body, modes](const Moment& moment, double* values) {
        const Vector xi = body.getModalCoordinates(moment.state);
        for (const int mode : modes) *values++ = xi[mode];
    };
    return probe;
}

Probe makeMassCenterProbe(const ProbeSource& source) {
    const ModelValue isWanted = source.entry.get("center_of_mass");
    if (!isWanted.getBool()) isWanted.fail("write true, or leave the probe out");
    Probe probe;
    probe.unit = "m";
    probe.columns = {"x", "y", "z"};
    probe.calc = [model = source.model](const Moment& moment, double* values) {
        put(model->getMatter().calcSystemMassCenterLocationInGround(moment.state), values);
    };
    return selectComponent(source.entry, std::move(probe));
}

Probe makeStressProbe(const ProbeSource& source) {
    return makeTensorProbe(source, source.entry.get("stress"), Tensor::Stress);
}

Probe makeStrainProbe(const ProbeSource& source) {
    return makeTensorProbe(source, source.entry.get("strain"), Tensor::Strain);
}

}  // namespace model
}  // namespace simflex
