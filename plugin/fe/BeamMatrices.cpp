#include "BeamMatrices.h"

#include <Eigen/Dense>
#include <cmath>
#include <stdexcept>
#include <unordered_map>

#include "MatrixEntries.h"
#include "SolidElements.h"

namespace simflex {
namespace {

constexpr int NumNodes = 20;
using ElementMatrix = Eigen::Matrix<double, 3 * NumNodes, 3 * NumNodes>;

struct BeamMaterial {
    double lambda = 0, mu = 0, rho = 0;  ///< Lamé's constants [Pa], density [kg/m³]
};

double readCardNumber(const DeckCard& card, size_t field) {
    if (card.data.empty() || card.data[0].fields.size() <= field)
        throw std::invalid_argument(card.where() + card.title + " has too few numbers");
    if (card.data.size() > 1)
        throw std::invalid_argument(card.where(card.data[1].line) + card.title +
                                    " depends on temperature, which simflex does not do in beams");
    return parseDeckNumber(card.data[0].fields[field], card.where(card.data[0].line));
}

std::unordered_map<std::string, BeamMaterial> readMaterials(const DeckModel& deck) {
    std::unordered_map<std::string, BeamMaterial> materials;
    BeamMaterial* material = nullptr;
    for (const DeckCard& card : deck.materials) {
        if (card.keyword == "MATERIAL") material = &materials[card.get("NAME")];
        if (material && card.keyword == "DENSITY") material->rho = readCardNumber(card, 0);
        if (!material || card.keyword != "ELASTIC" || card.data.empty()) continue;
        const double E = readCardNumber(card, 0), nu = readCardNumber(card, 1);
        material->mu = E / (2 * (1 + nu));
        material->lambda = E * nu / ((1 + nu) * (1 - 2 * nu));
    }
    return materials;
}

/** BeamMaterial of each element; of several sections the last. **/
std::unordered_map<int, BeamMaterial> findMaterials(const DeckModel& deck) {
    const auto materials = readMaterials(deck);
    std::unordered_map<int, BeamMaterial> result;
    for (const DeckCard& card : deck.sections) {
        if (card.keyword != "SOLIDSECTION") continue;
        const auto material = materials.find(card.get("MATERIAL"));
        if (material == materials.end())
            throw std::invalid_argument(card.where() + "the deck has no material " +
                                        card.get("MATERIAL"));
        const auto members = deck.elementSets.find(card.get("ELSET"));
        if (members == deck.elementSets.end()) continue;
        for (const int number : members->second) result[number] = material->second;
    }
    return result;
}

/** Adds one element; x holds its nodes by columns. **/
void integrate(const Eigen::Matrix<double, 3, NumNodes>& x, const BeamMaterial& material,
               const std::vector<IntegrationPoint>& rule, int number, ElementMatrix& K,
               Eigen::Matrix<double, NumNodes, NumNodes>& m) {
    K.setZero();
    m.setZero();
    for (const IntegrationPoint& point : rule) {
        Eigen::Matrix<double, NumNodes, 3> natural;
        Eigen::Matrix<double, NumNodes, 1> N;
        for (int k = 0; k < NumNodes; ++k) {
            N[k] = point.values[size_t(k)];
            for (int a = 0; a < 3; ++a) natural(k, a) = point.gradients[size_t(k)][size_t(a)];
        }
        const Eigen::Matrix3d jacobian = x * natural;  // ∂x/∂ξ
        const double determinant = jacobian.determinant();
        if (!(determinant > 0))
            throw std::invalid_argument("the solid of beam " + std::to_string(number) +
                                        " is turned inside out: its section is too large for how "
                                        "it bends");
        const Eigen::Matrix<double, NumNodes, 3> G = natural * jacobian.inverse();
        const double volume = point.weight * determinant;
        m += material.rho * volume * N * N.transpose();
        // λ ∂_a N_i ∂_b N_j + μ (∂_b N_i ∂_a N_j + δ_ab ∇N_i·∇N_j)
        const Eigen::Matrix<double, NumNodes, NumNodes> laplace = G * G.transpose();
        for (int i = 0; i < NumNodes; ++i)
            for (int j = 0; j < NumNodes; ++j)
                for (int a = 0; a < 3; ++a)
                    for (int b = 0; b < 3; ++b)
                        K(3 * i + a, 3 * j + b) +=
                            volume *
                            (material.lambda * G(i, a) * G(j, b) +
                             material.mu * (G(i, b) * G(j, a) + (a == b ? laplace(i, j) : 0)));
    }
}

}  // namespace

void addBeamMatrices(const DeckModel& deck, FeModel& model) {
    const auto beams = deck.solids.find(BeamSolid);
    if (beams == deck.solids.end()) return;
    const auto materials = findMaterials(deck);
    const auto full = makeBeamIntegrationPoints(makeFullSection());
    std::vector<std::vector<IntegrationPoint>> rules;
    for (const auto& section : deck.walls) rules.push_back(makeBeamIntegrationPoints(section));
    MatrixEntries entriesOfK, entriesOfM;
    ElementMatrix K;
    Eigen::Matrix<double, NumNodes, NumNodes> m;
    for (const auto& beam : beams->second) {
        std::array<int, NumNodes> nodes;
        Eigen::Matrix<double, 3, NumNodes> x;
        for (int k = 0; k < NumNodes; ++k) {
            nodes[size_t(k)] = model.mesh.indexOf(beam.nodes[size_t(k)]);
            const auto position = model.mesh.position(nodes[size_t(k)]);
            x.col(k) << position[0], position[1], position[2];
        }
        const auto walls = deck.wallsOf.find(beam.number);
        const auto& rule = walls == deck.wallsOf.end() ? full : rules[walls->second];
        integrate(x, materials.at(beam.number), rule, beam.number, K, m);
        for (int i = 0; i < 3 * NumNodes; ++i)
            for (int j = 0; j <= i; ++j) {
                entriesOfK.add(3 * nodes[size_t(i / 3)] + i % 3, 3 * nodes[size_t(j / 3)] + j % 3,
                               K(i, j));
                if (i % 3 || j % 3) continue;
                entriesOfM.add(nodes[size_t(i / 3)], nodes[size_t(j / 3)], m(i / 3, j / 3));
            }
    }
    const int numNodes = model.mesh.numNodes();
    model.K = addEntries(model.K, std::move(entriesOfK), 3 * numNodes);
    model.m = addEntries(model.m, std::move(entriesOfM), numNodes);
}

}  // namespace simflex
