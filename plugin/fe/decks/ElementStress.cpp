#include "ElementStress.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>
#include <unordered_map>

#include "DeckBuilder.h"
#include "DeckVocabulary.h"
#include "IntegratedSolids.h"
#include "simflex/base/ParallelFor.h"
#include "simflex/fe/Vec3d.h"

namespace simflex {
namespace {

constexpr const char* Names[6] = {"xx", "yy", "zz", "xy", "xz", "yz"};
constexpr int Group = 8;  // fields side by side
using Lanes = std::array<double, Group>;

DeckModel readDeck(const std::string& source) {
    try {
        return buildDeckModel(source, readModelCards(source));
    } catch (const std::exception& error) {
        throw std::invalid_argument(
            "stress needs the CalculiX deck that the part was read from, with its elements and "
            "materials; '" +
            source + "' cannot be read as one: " + error.what() +
            ". Reduce the part from a deck, or without stress.");
    }
}

}  // namespace

ElementStress::ElementStress(const FeModel& model) : m_model(model) {
    const DeckModel deck = readDeck(model.source);
    if (deck.mesh.nodeNumbers != model.mesh.nodeNumbers ||
        deck.mesh.positions != model.mesh.positions)
        throw std::runtime_error(model.source +
                                 ": the deck's nodes are not those that K and M were assembled "
                                 "for; the file has changed in between. Reduce it again.");

    if (!deck.hinged.empty())
        throw std::invalid_argument(model.source +
                                    ": stress of a part with trusses or membranes is not known; "
                                    "reduce without stress, or use beams and shells");

    std::map<std::string, ElasticMatrix> laws;
    std::string name;
    for (const DeckCard& card : deck.materials) {
        if (card.keyword == "MATERIAL") name = card.get("NAME");
        if (card.keyword == "ELASTIC") laws[name] = parseElasticLaw(card);
    }
    std::map<std::string, int> orientations;
    for (const DeckCard& card : deck.sections)
        if (card.keyword == "ORIENTATION") {
            orientations[card.get("NAME")] = int(m_orientations.size());
            m_orientations.emplace_back(card);
        }
    std::unordered_map<int, int> materialOf;  // element number → index; the last section holds
    for (const DeckCard& card : deck.sections) {
        if (card.keyword != "SOLIDSECTION") continue;
        const auto law = laws.find(card.get("MATERIAL"));
        if (law == laws.end())
            throw std::invalid_argument(card.where() + "the deck has no *ELASTIC of material " +
                                        card.get("MATERIAL"));
        Material material;
        material.law = law->second;
        if (card.has("ORIENTATION")) {
            const auto found = orientations.find(card.get("ORIENTATION"));
            if (found == orientations.end())
                throw std::invalid_argument(card.where() + "the deck has no *ORIENTATION " +
                                            card.get("ORIENTATION"));
            const Orientation& orientation = m_orientations[size_t(found->second)];
            if (orientation.isCylindrical())
                material.cylindrical = found->second;
            else
                material.law = turnElasticLaw(material.law, orientation.calcAxes({}));
        }
        const auto set = deck.elementSets.find(card.get("ELSET"));
        if (set == deck.elementSets.end()) continue;  // of no solids
        for (const int number : set->second) materialOf[number] = int(m_materials.size());
        m_materials.push_back(material);
    }

    std::unordered_map<int, int> indexOf;
    indexOf.reserve(model.mesh.nodeNumbers.size());
    for (const int number : model.mesh.nodeNumbers) indexOf.emplace(number, int(indexOf.size()));
    for (const auto& [calculixType, solids] : deck.solids) {
        const ElementType shape = getSolid(calculixType);
        Type& type = m_types[calculixType];
        if (calculixType == LayeredHex || calculixType == LayeredWedge)
            throw std::invalid_argument(model.source +
                                        ": stress of layered shells is not known; reduce without "
                                        "stress, or mesh each layer by solids");
        if (calculixType == BeamSolid)
            throw std::invalid_argument(model.source +
                                        ": stress of B32R beams is not known; use B32, or reduce "
                                        "without stress");
        type.points = makeIntegrationPoints(calculixType, shape);
        if (calculixType == "C3D8R") type.averaged = makeIntegrationPoints("C3D8", shape);
        type.extrapolation = makeExtrapolation(calculixType, shape);
        for (const auto& solid : solids) {
            const auto material = materialOf.find(solid.number);
            if (material == materialOf.end())
                throw std::invalid_argument(model.source + ": element " +
                                            std::to_string(solid.number) +
                                            " is in no *SOLID SECTION, so it has no stress");
            Element element{solid.number, &type, material->second, {}};
            for (const int number : solid.nodes) element.nodes.push_back(indexOf.at(number));
            m_elements.push_back(std::move(element));
        }
    }
}

void ElementStress::locate(const Element& element, std::vector<Place>& places) const {
    std::vector<Vec3d> positions;
    for (const int node : element.nodes) positions.push_back(m_model.mesh.position(node));
    const Type& type = *element.type;
    const Material& material = m_materials[size_t(element.material)];
    places.resize(type.points.size());
    for (size_t p = 0; p < places.size(); ++p) {
        Place& place = places[p];
        place.volume = calcGradients(positions, type.points[p], place.gradients);
        place.law = material.law;
        if (material.cylindrical < 0) continue;
        Vec3d at{};
        for (size_t k = 0; k < positions.size(); ++k)
            for (size_t a = 0; a < 3; ++a) at[a] += type.points[p].values[k] * positions[k][a];
        place.law =
            turnElasticLaw(material.law, m_orientations[size_t(material.cylindrical)].calcAxes(at));
    }
    if (type.averaged.empty()) return;
    Place& only = places[0];
    only.volume = 0;
    only.gradients.assign(positions.size(), Vec3d{0, 0, 0});
    std::vector<Vec3d> gradients;
    for (const IntegrationPoint& point : type.averaged) {
        const double volume = calcGradients(positions, point, gradients);
        only.volume += volume;
        for (size_t k = 0; k < positions.size(); ++k)
            for (size_t a = 0; a < 3; ++a) only.gradients[k][a] += volume * gradients[k][a];
    }
    for (Vec3d& gradient : only.gradients)
        for (double& component : gradient) component /= only.volume;
}

void ElementStress::checkAgainstStiffness() const {
    constexpr double Tolerance = 1e-5;  // K has some 14 digits, of slender parts many cancel
    ElasticMatrix expected{};
    std::vector<Place> places;
    for (const Element& element : m_elements) {
        locate(element, places);
        for (const Place& place : places)
            for (size_t i = 0; i < 6; ++i)
                for (size_t j = 0; j < 6; ++j) expected[i][j] += place.volume * place.law[i][j];
    }
    // The six uniform strains about the mesh's middle.
    const SymmetricMatrix& K = m_model.K;
    const int numNodes = m_model.mesh.numNodes();
    Vec3d middle{};
    for (int node = 0; node < numNodes; ++node)
        for (size_t a = 0; a < 3; ++a) middle[a] += m_model.mesh.position(node)[a] / numNodes;
    std::array<std::vector<double>, 6> u, Ku;
    for (size_t c = 0; c < 6; ++c) {
        u[c].assign(size_t(K.size), 0);
        Ku[c].assign(size_t(K.size), 0);
        const size_t a = size_t(TensorPairs[c][0]), b = size_t(TensorPairs[c][1]);
        for (int node = 0; node < numNodes; ++node) {
            const Vec3d x = m_model.mesh.position(node);
            u[c][3 * size_t(node) + a] += (a == b ? 1 : 0.5) * (x[b] - middle[b]);
            if (a != b) u[c][3 * size_t(node) + b] += 0.5 * (x[a] - middle[a]);
        }
    }
    for (int column = 0; column < K.size; ++column)
        for (auto e = K.columnStarts[size_t(column)]; e < K.columnStarts[size_t(column) + 1]; ++e) {
            const size_t i = size_t(K.rows[size_t(e)]), j = size_t(column);
            const double value = K.values[size_t(e)];
            for (size_t c = 0; c < 6; ++c) {
                Ku[c][i] += value * u[c][j];
                if (i != j) Ku[c][j] += value * u[c][i];
            }
        }
    for (size_t c = 0; c < 6; ++c)
        for (size_t d = 0; d <= c; ++d) {
            double found = 0;
            for (size_t dof = 0; dof < size_t(K.size); ++dof) found += u[c][dof] * Ku[d][dof];
            if (std::abs(found - expected[c][d]) <=
                Tolerance * std::sqrt(expected[c][c] * expected[d][d]))
                continue;
            std::ostringstream text;
            text << m_model.source << ": uniform strains " << Names[c] << " and " << Names[d]
                 << " have an energy of " << found << " J by the stiffness matrix, but "
                 << expected[c][d]
                 << " J by the deck's elements and materials as simflex reads them, so that the "
                    "stress would be wrong. Has the deck changed since? Else reduce without "
                    "stress, and report the deck.";
            throw std::invalid_argument(text.str());
        }
}

void ElementStress::calcGroup(const std::vector<int>& rowOf, const std::vector<int>& touched,
                              size_t numRows, const double* fields, int count, float* stress,
                              float* strain) const {
    const size_t numDofs = 3 * size_t(m_model.mesh.numNodes());
    std::vector<Lanes> sums(12 * numRows, Lanes{});  // strain, stress
    std::vector<int> numElements(numRows, 0);
    std::vector<Place> places;
    std::vector<Lanes> u, atPoints;
    for (const int index : touched) {
        const Element& element = m_elements[size_t(index)];
        const size_t n = element.nodes.size();
        locate(element, places);
        u.resize(3 * n);
        for (size_t k = 0; k < n; ++k)
            for (size_t a = 0; a < 3; ++a) {
                const double* from = fields + 3 * size_t(element.nodes[k]) + a;
                for (int f = 0; f < Group; ++f)
                    u[3 * k + a][size_t(f)] = f < count ? from[size_t(f) * numDofs] : 0;
            }
        atPoints.assign(12 * places.size(), Lanes{});
        for (size_t p = 0; p < places.size(); ++p) {
            Lanes H[3][3] = {};  // ∂u_a/∂x_b
            for (size_t k = 0; k < n; ++k)
                for (size_t a = 0; a < 3; ++a)
                    for (size_t b = 0; b < 3; ++b) {
                        const double g = places[p].gradients[k][b];
                        for (size_t f = 0; f < Group; ++f) H[a][b][f] += g * u[3 * k + a][f];
                    }
            Lanes *epsilon = &atPoints[12 * p], *sigma = epsilon + 6;
            for (size_t c = 0; c < 6; ++c) {
                const auto [a, b] = TensorPairs[c];
                for (size_t f = 0; f < Group; ++f) epsilon[c][f] = 0.5 * (H[a][b][f] + H[b][a][f]);
            }
            for (size_t c = 0; c < 6; ++c)
                for (size_t d = 0; d < 6; ++d) {
                    const double stiffness = (d < 3 ? 1 : 2) * places[p].law[c][d];
                    for (size_t f = 0; f < Group; ++f) sigma[c][f] += stiffness * epsilon[d][f];
                }
        }
        for (size_t k = 0; k < n; ++k) {
            const int row = rowOf[size_t(element.nodes[k])];
            if (row < 0) continue;
            ++numElements[size_t(row)];
            for (size_t p = 0; p < places.size(); ++p) {
                const double share = element.type->extrapolation[k * places.size() + p];
                for (size_t c = 0; c < 12; ++c)
                    for (size_t f = 0; f < Group; ++f)
                        sums[12 * size_t(row) + c][f] += share * atPoints[12 * p + c][f];
            }
        }
    }
    for (int f = 0; f < count; ++f)
        for (size_t row = 0; row < numRows; ++row)
            for (size_t c = 0; c < 6; ++c) {
                const size_t at = 6 * (numRows * size_t(f) + row) + c;
                strain[at] = float(sums[12 * row + c][size_t(f)] / numElements[row]);
                stress[at] = float(sums[12 * row + 6 + c][size_t(f)] / numElements[row]);
            }
}

void ElementStress::calcAtNodes(const std::vector<int>& nodes, const double* fields, int count,
                                float* stress, float* strain,
                                const ProgressCallback& progress) const {
    std::vector<int> rowOf(size_t(m_model.mesh.numNodes()), -1);
    for (size_t k = 0; k < nodes.size(); ++k) rowOf.at(size_t(nodes[k])) = int(k);
    std::vector<int> touched;
    for (size_t e = 0; e < m_elements.size(); ++e) {
        const auto& own = m_elements[e].nodes;
        if (std::any_of(own.begin(), own.end(), [&](int node) { return rowOf[size_t(node)] >= 0; }))
            touched.push_back(int(e));
    }
    const size_t numDofs = 3 * size_t(m_model.mesh.numNodes()), numRows = nodes.size();
    const int numGroups = (count + Group - 1) / Group;
    const double mostRoom = 1 << 30, room = double(12 * sizeof(Lanes) * numRows);  // of a thread
    const int threads =
        std::max(1, std::min(omp_get_max_threads(), int(std::min(1e3, mostRoom / (1 + room)))));
    for (int first = 0; first < numGroups; first += threads) {
        reportProgress(progress, "modal stress", double(first) / numGroups);
        const int last = std::min(numGroups, first + threads);
        parallelFor(last - first, threads, [&](int k) {
            const size_t field = size_t(first + k) * Group;
            calcGroup(rowOf, touched, numRows, fields + field * numDofs,
                      std::min(Group, count - int(field)), stress + 6 * numRows * field,
                      strain + 6 * numRows * field);
        });
    }
}

std::vector<ElementStress::PointStress> ElementStress::calcAtPoints(const double* field) const {
    std::vector<PointStress> result;
    std::vector<Place> places;
    for (const Element& element : m_elements) {
        locate(element, places);
        for (size_t p = 0; p < places.size(); ++p) {
            PointStress at;
            at.element = element.number;
            at.point = int(p) + 1;
            double H[3][3] = {};
            for (size_t k = 0; k < element.nodes.size(); ++k)
                for (size_t a = 0; a < 3; ++a)
                    for (size_t b = 0; b < 3; ++b)
                        H[a][b] +=
                            places[p].gradients[k][b] * field[3 * size_t(element.nodes[k]) + a];
            for (size_t c = 0; c < 6; ++c) {
                const auto [a, b] = TensorPairs[c];
                at.strain[c] = 0.5 * (H[a][b] + H[b][a]);
            }
            for (size_t c = 0; c < 6; ++c)
                for (size_t d = 0; d < 6; ++d)
                    at.stress[c] += (d < 3 ? 1 : 2) * places[p].law[c][d] * at.strain[d];
            result.push_back(at);
        }
    }
    return result;
}

}  // namespace simflex
