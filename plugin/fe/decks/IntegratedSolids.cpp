#include "IntegratedSolids.h"

#include <Eigen/Dense>
#include <map>
#include <optional>
#include <stdexcept>
#include <tuple>
#include <unordered_map>

#include "DeckVocabulary.h"
#include "ElasticLaw.h"
#include "simflex/fe/MatrixEntries.h"
#include "simflex/fe/SolidElements.h"
#include "simflex/fe/Vec3d.h"

namespace simflex {
namespace {

struct SolidMaterial {
    ElasticMatrix law{};  ///< [Pa]
    double rho = 0;       ///< [kg/m³]
};

/** What a share of an element is made of. **/
struct SolidZone {
    const std::vector<IntegrationPoint>* points;
    const SolidMaterial* material;
    const Orientation* orientation;  ///< null: the material's axes are the deck's
};

/** Of a deck whose materials are settled. **/
std::map<std::string, SolidMaterial> readSolidMaterials(const DeckModel& deck) {
    std::map<std::string, SolidMaterial> materials;
    SolidMaterial* material = nullptr;
    for (const DeckCard& card : deck.materials) {
        if (card.keyword == "MATERIAL") material = &materials[card.get("NAME")];
        if (material && card.keyword == "DENSITY")
            material->rho = readDeckNumber(card, card.data.at(0), 0, "the density");
        if (material && card.keyword == "ELASTIC") material->law = parseElasticLaw(card);
    }
    return materials;
}

/** K and m of one element. **/
class SolidIntegral {
public:
    Eigen::MatrixXd K, m;

    /** @param x  its nodes by columns **/
    void integrate(const Eigen::Matrix3Xd& x, const std::vector<SolidZone>& zones, int number) {
        const Eigen::Index n = x.cols();
        K.setZero(3 * n, 3 * n);
        m.setZero(n, n);
        m_B.setZero(6, 3 * n);
        for (const SolidZone& zone : zones)
            for (const IntegrationPoint& point : *zone.points) add(x, zone, point, number);
    }

private:
    void add(const Eigen::Matrix3Xd& x, const SolidZone& zone, const IntegrationPoint& point,
             int number) {
        const Eigen::Index n = x.cols();
        const Eigen::Map<const Eigen::Matrix<double, 3, Eigen::Dynamic>> natural(
            point.gradients[0].data(), 3, n);
        const Eigen::Map<const Eigen::VectorXd> N(point.values.data(), n);
        const Eigen::Matrix3d jacobian = x * natural.transpose();  // ∂x/∂ξ
        const double determinant = jacobian.determinant();
        if (!(determinant > 0))
            throw std::invalid_argument("the solid of element " + std::to_string(number) +
                                        " is turned inside out: its section is too large for how "
                                        "it bends");
        const Eigen::Matrix3Xd G = jacobian.transpose().inverse() * natural;
        for (Eigen::Index k = 0; k < n; ++k)
            for (Eigen::Index row = 0; row < 6; ++row) {
                const auto [a, b] = TensorPairs[row];
                m_B(row, 3 * k + a) = G(b, k);
                m_B(row, 3 * k + b) = G(a, k);
            }
        ElasticMatrix law = zone.material->law;
        if (zone.orientation) {
            const Eigen::Vector3d at = x * N;
            law = turnElasticLaw(law, zone.orientation->calcAxes({at[0], at[1], at[2]}));
        }
        const Eigen::Map<const Eigen::Matrix<double, 6, 6, Eigen::RowMajor>> D(law[0].data());
        const double volume = point.weight * determinant;
        m_DB.noalias() = volume * (D * m_B);
        K.noalias() += m_B.transpose() * m_DB;
        m.noalias() += zone.material->rho * volume * N * N.transpose();
    }

    Eigen::Matrix<double, 6, Eigen::Dynamic> m_B, m_DB;
};

/** What the elements of a deck are made of. **/
class SolidZones {
public:
    explicit SolidZones(const DeckModel& deck)
        : m_deck(deck),
          m_materials(readSolidMaterials(deck)),
          m_full(makeBeamIntegrationPoints(makeFullSection())) {
        for (const auto& section : deck.walls)
            m_walls.push_back(makeBeamIntegrationPoints(section));
        for (const DeckCard& card : deck.sections) {
            if (card.keyword == "ORIENTATION") m_orientations.emplace(card.get("NAME"), card);
            if (card.keyword != "SOLIDSECTION") continue;
            const auto members = deck.elementSets.find(card.get("ELSET"));
            if (members == deck.elementSets.end()) continue;
            for (const int number : members->second) m_sectionOf[number] = &card;
        }
    }

    std::vector<SolidZone> list(int number, ElementType type) {
        const auto layers = m_deck.layersOf.find(number);
        if (layers != m_deck.layersOf.end()) return listLayers(layers->second, type);
        const DeckCard& section = *m_sectionOf.at(number);
        const auto walls = m_deck.wallsOf.find(number);
        return {{walls == m_deck.wallsOf.end() ? &m_full : &m_walls[walls->second],
                 &m_materials.at(section.get("MATERIAL")),
                 section.has("ORIENTATION") ? &m_orientations.at(section.get("ORIENTATION"))
                                            : nullptr}};
    }

private:
    std::vector<SolidZone> listLayers(const std::vector<DeckLayer>& layers, ElementType type) {
        double total = 0, below = 0;
        for (const DeckLayer& layer : layers) total += layer.thickness;
        std::vector<SolidZone> zones;
        for (const DeckLayer& layer : layers) {
            const double from = 2 * below / total - 1;
            below += layer.thickness;
            const auto [rule, isNew] = m_layers.insert({{type, from, 2 * below / total - 1}, {}});
            if (isNew) rule->second = makeLayerPoints(type, from, 2 * below / total - 1);
            zones.push_back(
                {&rule->second, &m_materials.at(layer.material),
                 layer.orientation.empty() ? nullptr : &m_orientations.at(layer.orientation)});
        }
        return zones;
    }

    const DeckModel& m_deck;
    std::map<std::string, SolidMaterial> m_materials;
    std::map<std::string, Orientation> m_orientations;
    std::unordered_map<int, const DeckCard*> m_sectionOf;
    std::vector<IntegrationPoint> m_full;
    std::vector<std::vector<IntegrationPoint>> m_walls;
    std::map<std::tuple<ElementType, double, double>, std::vector<IntegrationPoint>> m_layers;
};

}  // namespace

bool isIntegratedSolid(const std::string& type) {
    return type == BeamSolid || type == LayeredHex || type == LayeredWedge;
}

void addIntegratedSolids(const DeckModel& deck, FeModel& model) {
    std::optional<SolidZones> zones;
    MatrixEntries entriesOfK, entriesOfM;
    SolidIntegral integral;
    for (const auto& [type, solids] : deck.solids) {
        if (!isIntegratedSolid(type)) continue;
        if (!zones) zones.emplace(deck);
        for (const auto& solid : solids) {
            std::vector<int> nodes;
            Eigen::Matrix3Xd x(3, Eigen::Index(solid.nodes.size()));
            for (const int number : solid.nodes) {
                const auto position = model.mesh.position(model.mesh.indexOf(number));
                x.col(Eigen::Index(nodes.size())) << position[0], position[1], position[2];
                nodes.push_back(model.mesh.indexOf(number));
            }
            integral.integrate(x, zones->list(solid.number, getSolid(type)), solid.number);
            for (int i = 0; i < 3 * int(nodes.size()); ++i)
                for (int j = 0; j <= i; ++j) {
                    entriesOfK.add(3 * nodes[size_t(i / 3)] + i % 3,
                                   3 * nodes[size_t(j / 3)] + j % 3, integral.K(i, j));
                    if (i % 3 || j % 3) continue;
                    entriesOfM.add(nodes[size_t(i / 3)], nodes[size_t(j / 3)],
                                   integral.m(i / 3, j / 3));
                }
        }
    }
    if (!zones) return;
    const int numNodes = model.mesh.numNodes();
    model.K = addEntries(model.K, std::move(entriesOfK), 3 * numNodes);
    model.m = addEntries(model.m, std::move(entriesOfM), numNodes);
}

}  // namespace simflex
