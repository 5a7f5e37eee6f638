#include "ModalStress.h"

#include <algorithm>
#include <numeric>
#include <stdexcept>

#include "simflex/fe/NodeSelection.h"
#include "simflex/fe/elements/ElementStress.h"
#include "simflex/part/MeshFaces.h"

namespace simflex {
namespace {

std::vector<int> findSkin(const Mesh& mesh) {
    std::vector<int> nodes;
    for (const MeshFace& face : extractBoundaryFaces(mesh))
        for (const auto* ofFace : {&face.corners, &face.middles})
            std::copy_if(ofFace->begin(), ofFace->end(), std::back_inserter(nodes),
                         [](int node) { return node >= 0; });
    return nodes;
}

}  // namespace

std::vector<int> findStressNodes(const std::string& part, const Mesh& mesh,
                                 const StressOptions& options) {
    std::vector<int> nodes;
    switch (options.nodes) {
        case StressOptions::Nodes::Skin:
            nodes = findSkin(mesh);
            break;
        case StressOptions::Nodes::All:
            nodes.resize(size_t(mesh.numNodes()));
            std::iota(nodes.begin(), nodes.end(), 0);
            break;
        case StressOptions::Nodes::Sets:
            for (const std::string& selection : options.sets) try {
                    const auto chosen = selectNodes(mesh, selection);
                    nodes.insert(nodes.end(), chosen.begin(), chosen.end());
                } catch (const std::invalid_argument& error) {
                    throw std::invalid_argument("part '" + part +
                                                "': nodes for stress: " + error.what());
                }
            break;
    }
    std::sort(nodes.begin(), nodes.end());
    nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
    // Nodes that are only tied to elements have no stress.
    std::vector<char> isOfElement(size_t(mesh.numNodes()), 0);
    for (const ElementBlock& block : mesh.elements)
        for (const int node : block.nodes) isOfElement[size_t(node)] = 1;
    nodes.erase(std::remove_if(nodes.begin(), nodes.end(),
                               [&](int node) { return !isOfElement[size_t(node)]; }),
                nodes.end());
    return nodes;
}

ReducedBody::ModalStress calcModalStress(const FeModel& model, const ReducedBody& body,
                                         const StressOptions& options,
                                         const ProgressCallback& progress) {
    reportProgress(progress, "modal stress", 0);
    ReducedBody::ModalStress modal;
    modal.nodes = findStressNodes(body.name, model.mesh, options);
    const ElementStress elements(model);
    modal.stress.resize(6 * modal.nodes.size() * size_t(body.numModes));
    modal.strain.resize(modal.stress.size());
    elements.calcAtNodes(modal.nodes, body.Phi.data(), body.numModes, modal.stress.data(),
                         modal.strain.data(), progress);
    return modal;
}

}  // namespace simflex
