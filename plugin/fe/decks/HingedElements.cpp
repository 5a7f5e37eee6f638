#include "HingedElements.h"

#include <Eigen/Dense>
#include <cmath>
#include <map>
#include <stdexcept>

#include "DeckModel.h"
#include "simflex/fe/FaceShapes.h"
#include "simflex/fe/MatrixEntries.h"
#include "simflex/fe/Vec3d.h"

namespace simflex {
namespace {

/** An integration point of a line or face. **/
struct HingedPoint {
    double xi, eta, weight;
};

struct HingedMaterial {
    double E = 0, nu = 0, rho = 0;
    bool isIsotropic = true;
};

const std::map<std::string, int> HingedTypes = {{"T3D2", 2}, {"T3D3", 3}, {"M3D3", 3}, {"M3D4", 4},
                                                {"M3D6", 6}, {"M3D8", 8}, {"M3D8R", 8}};

std::vector<std::pair<double, double>> makeLine(int count) {
    const double two = 1 / std::sqrt(3.0), three = std::sqrt(0.6);
    if (count == 2) return {{-two, 1}, {two, 1}};
    return {{-three, 5.0 / 9}, {0, 8.0 / 9}, {three, 5.0 / 9}};
}

std::vector<HingedPoint> makeSquare(int count) {
    std::vector<HingedPoint> points;
    for (const auto& [y, wy] : makeLine(count))
        for (const auto& [x, wx] : makeLine(count)) points.push_back({x, y, wx * wy});
    return points;
}

/** Triangle rules: exact for polynomials of degree 2 with 3 points, of degree 4 with 6 (Strang,
Fix, An Analysis of the Finite Element Method). **/
std::vector<HingedPoint> makeTriangle(int count) {
    std::vector<HingedPoint> points;
    const auto add = [&](double a, double weight) {
        for (const auto& [x, y] :
             {std::pair(a, a), std::pair(1 - 2 * a, a), std::pair(a, 1 - 2 * a)})
            points.push_back({x, y, weight / 2});
    };
    if (count == 3) {
        add(1.0 / 6, 1.0 / 3);
    } else {
        add(0.091576213509771, 0.109951743655322);
        add(0.445948490915965, 0.223381589678011);
    }
    return points;
}

/** Integration points of K and of m. **/
std::array<std::vector<HingedPoint>, 2> makeRules(const std::string& type) {
    if (type == "T3D2" || type == "T3D3") {
        std::array<std::vector<HingedPoint>, 2> rules;
        for (const size_t k : {0, 1})
            for (const auto& [x, w] : makeLine(type == "T3D2" || k == 0 ? 2 : 3))
                rules[k].push_back({x, 0, w});
        return rules;
    }
    if (type == "M3D3") return {makeTriangle(3), makeTriangle(3)};
    if (type == "M3D6") return {makeTriangle(3), makeTriangle(6)};
    if (type == "M3D8") return {makeSquare(3), makeSquare(3)};
    if (type == "M3D8R") return {makeSquare(2), makeSquare(3)};
    return {makeSquare(2), makeSquare(2)};
}

/** Shape functions of a truss; the second of three nodes is the middle one. **/
FaceShapes calcLineShapes(int numNodes, double x) {
    FaceShapes shapes;
    if (numNodes == 2) {
        shapes.N = {0.5 * (1 - x), 0.5 * (1 + x)};
        shapes.dXi = {-0.5, 0.5};
    } else {
        shapes.N = {0.5 * x * (x - 1), 1 - x * x, 0.5 * x * (x + 1)};
        shapes.dXi = {x - 0.5, -2 * x, x + 0.5};
    }
    return shapes;
}

std::map<std::string, HingedMaterial> readHingedMaterials(const DeckModel& deck) {
    std::map<std::string, HingedMaterial> materials;
    HingedMaterial* material = nullptr;
    for (const DeckCard& card : deck.materials) {
        if (card.keyword == "MATERIAL") material = &materials[card.get("NAME")];
        if (material && card.keyword == "DENSITY")
            material->rho = readDeckNumber(card, card.data.at(0), 0, "the density");
        if (!material || card.keyword != "ELASTIC") continue;
        material->isIsotropic = !card.has("TYPE") || card.get("TYPE").compare(0, 3, "ISO") == 0;
        if (!material->isIsotropic) continue;
        material->E = readDeckNumber(card, card.data.at(0), 0, "Young's modulus");
        material->nu = readDeckNumber(card, card.data.at(0), 1, "Poisson's ratio");
    }
    return materials;
}

[[noreturn]] void refuseHinged(const HingedElement& element, const std::string& why) {
    throw std::invalid_argument(element.where + "element " + std::to_string(element.number) +
                                ", a " + element.type + ", " + why);
}

/** Computes K (3n×3n) and m (n×n) of an element with nodes at x. **/
void integrateHinged(const HingedElement& element, const std::vector<Vec3d>& x,
                     const HingedMaterial& material,
                     const std::array<std::vector<HingedPoint>, 2>& rules, Eigen::MatrixXd& K,
                     Eigen::MatrixXd& m) {
    const Eigen::Index n = Eigen::Index(x.size());
    const bool isLine = isTruss(element.type);
    K.setZero(3 * n, 3 * n);
    m.setZero(n, n);
    Eigen::Matrix3d D = Eigen::Matrix3d::Zero();
    const double nu = material.nu, plane = material.E / (1 - nu * nu);
    D << plane, nu * plane, 0, nu * plane, plane, 0, 0, 0, 0.5 * (1 - nu) * plane;
    for (const size_t kind : {0, 1})
        for (const HingedPoint& at : rules[kind]) {
            const FaceShapes shapes =
                isLine ? calcLineShapes(int(n), at.xi) : calcFaceShapes(int(n), at.xi, at.eta);
            Eigen::Matrix<double, 3, 2> tangents = Eigen::Matrix<double, 3, 2>::Zero();
            for (size_t k = 0; k < x.size(); ++k)
                for (Eigen::Index a = 0; a < 3; ++a) {
                    tangents(a, 0) += shapes.dXi[k] * x[k][size_t(a)];
                    tangents(a, 1) += shapes.dEta[k] * x[k][size_t(a)];
                }
            const Eigen::Vector3d e1 = tangents.col(0).normalized();
            Eigen::Vector3d e2 = tangents.col(1) - e1.dot(tangents.col(1)) * e1;
            const double area = tangents.col(0).norm() * (isLine ? 1 : e2.norm());
            if (!(area > 0)) refuseHinged(element, "has no size; do its nodes coincide?");
            const Vec3d chord = minus(x.back(), x.front());
            if (isLine && !(dot(chord, {e1[0], e1[1], e1[2]}) > 0))
                refuseHinged(
                    element,
                    "folds back; do its nodes coincide, or is the middle one not the second?");
            const double volume = at.weight * area * element.size;
            if (kind == 1) {
                const Eigen::Map<const Eigen::VectorXd> N(shapes.N.data(), n);
                m += material.rho * volume * N * N.transpose();
                continue;
            }
            Eigen::MatrixXd B;  // strains for nodal translations
            if (isLine) {
                B.setZero(1, 3 * n);
                for (Eigen::Index k = 0; k < n; ++k)
                    B.block<1, 3>(0, 3 * k) = shapes.dXi[size_t(k)] / area * e1.transpose();
                K += volume * material.E * B.transpose() * B;
                continue;
            }
            e2.normalize();
            Eigen::Matrix2d J;  // ∂(along e1, along e2)/∂(ξ, η)
            J << e1.dot(tangents.col(0)), e1.dot(tangents.col(1)), 0, e2.dot(tangents.col(1));
            const Eigen::Matrix2d inverse = J.inverse();
            B.setZero(3, 3 * n);
            for (Eigen::Index k = 0; k < n; ++k) {
                const Eigen::Vector2d g =
                    inverse.transpose() *
                    Eigen::Vector2d(shapes.dXi[size_t(k)], shapes.dEta[size_t(k)]);
                B.block<1, 3>(0, 3 * k) = g[0] * e1.transpose();
                B.block<1, 3>(1, 3 * k) = g[1] * e2.transpose();
                B.block<1, 3>(2, 3 * k) = g[1] * e1.transpose() + g[0] * e2.transpose();
            }
            K += volume * B.transpose() * D * B;
        }
}

}  // namespace

int numHingedNodesOf(const std::string& type) {
    const auto found = HingedTypes.find(type);
    return found == HingedTypes.end() ? 0 : found->second;
}

bool isTruss(const std::string& type) {
    return type[0] == 'T';
}

void addHingedElements(const DeckModel& deck, FeModel& model) {
    if (deck.hinged.empty()) return;
    const auto materials = readHingedMaterials(deck);
    std::map<std::string, std::array<std::vector<HingedPoint>, 2>> rules;
    MatrixEntries entriesOfK, entriesOfM;
    Eigen::MatrixXd K, m;
    for (const HingedElement& element : deck.hinged) {
        const HingedMaterial& material = materials.at(element.material);
        if (!material.isIsotropic)
            refuseHinged(element, "is of material " + element.material +
                                      ", which is not isotropic: simflex does not support that in "
                                      "trusses and membranes; use beams or shells");
        std::vector<int> nodes;
        std::vector<Vec3d> x;
        for (const int number : element.nodes) {
            nodes.push_back(model.mesh.indexOf(number));
            x.push_back(model.mesh.position(nodes.back()));
        }
        const auto [rule, isNew] = rules.try_emplace(element.type);
        if (isNew) rule->second = makeRules(element.type);
        integrateHinged(element, x, material, rule->second, K, m);
        for (int i = 0; i < 3 * int(nodes.size()); ++i)
            for (int j = 0; j <= i; ++j) {
                entriesOfK.add(3 * nodes[size_t(i / 3)] + i % 3, 3 * nodes[size_t(j / 3)] + j % 3,
                               K(i, j));
                if (i % 3 || j % 3) continue;
                entriesOfM.add(nodes[size_t(i / 3)], nodes[size_t(j / 3)], m(i / 3, j / 3));
            }
    }
    model.K = addEntries(model.K, std::move(entriesOfK), 3 * model.mesh.numNodes());
    model.m = addEntries(model.m, std::move(entriesOfM), model.mesh.numNodes());
}

}  // namespace simflex
