#include "FeElements.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "simflex/fe/Vec3d.h"

namespace simflex {
namespace {

using Matrix38 = Eigen::Matrix<double, 3, 8>;

/** Hourglass modes ηζ, ξζ, ξη, ξηζ at the nodes of a hexahedron. **/
const Eigen::Matrix<double, 8, 4>& getHourglassModes() {
    static const Eigen::Matrix<double, 8, 4> modes =
        (Eigen::Matrix<double, 8, 4>() << 1, 1, 1, -1,  //
         1, -1, -1, 1,                                  //
         -1, -1, 1, -1,                                 //
         -1, 1, -1, 1,                                  //
         -1, -1, 1, 1,                                  //
         -1, 1, -1, -1,                                 //
         1, 1, 1, 1,                                    //
         1, -1, -1, -1)
            .finished();
    return modes;
}

/** Returns node positions, one per column. **/
Eigen::Matrix3Xd takePositions(const Mesh& mesh, const int* nodes, int count) {
    Eigen::Matrix3Xd x(3, count);
    for (int k = 0; k < count; ++k)
        x.col(k) = Eigen::Map<const Eigen::Vector3d>(&mesh.positions[3 * size_t(nodes[k])]);
    return x;
}

template <class Matrix>
bool areEqual(const Matrix& A, const Matrix& B) {
    return A.rows() == B.rows() && A.cols() == B.cols() && A == B;
}

Eigen::Map<const Eigen::Matrix3Xd> naturalGradients(const IntegrationPoint& point) {
    return {point.gradients[0].data(), 3, Eigen::Index(point.gradients.size())};
}

/** Of an isotropic law G |γt|² for the shear of a beam with the tangent t, or the rest. **/
void keepStrains(bool isShear, const Eigen::Vector3d& along, ElasticMatrix& law) {
    Eigen::Map<Eigen::Matrix<double, 6, 6, Eigen::RowMajor>> D(law[0].data());
    const double G = D(3, 3);
    const Eigen::Vector3d t = along.normalized();
    Eigen::Matrix<double, 3, 6> gamma;  // 2 (1 − ttᵀ) ε t
    for (Eigen::Index row = 0; row < 6; ++row) {
        const auto [a, b] = TensorPairs[row];
        Eigen::Vector3d part = Eigen::Vector3d::Zero();
        part[a] += t[b];
        part[b] += t[a];
        gamma.col(row) = part - part.dot(t) * t;
    }
    const Eigen::Matrix<double, 6, 6> shear = G * (gamma.transpose() * gamma);
    if (isShear)
        D = shear;
    else
        D -= shear;
}

}  // namespace

void ElementPoint::calcStrainMatrix(Eigen::Matrix<double, 6, Eigen::Dynamic>& strain) const {
    if (B.cols() > 0) {
        strain = B;
        return;
    }
    strain.setZero(6, 3 * G.cols());
    for (Eigen::Index k = 0; k < G.cols(); ++k)
        for (Eigen::Index row = 0; row < 6; ++row) {
            const auto [a, b] = TensorPairs[row];
            strain(row, 3 * k + a) = G(b, k);
            strain(row, 3 * k + b) = G(a, k);
        }
}

bool ElementPoint::hasSameStiffness(const ElementPoint& other) const {
    return volume == other.volume && D == other.D && areEqual(G, other.G) && areEqual(B, other.B);
}

bool ElementPoint::hasSameMass(const ElementPoint& other) const {
    return volume == other.volume && density == other.density && areEqual(N, other.N);
}

bool ElementPoints::haveSameStiffness(const ElementPoints& other) const {
    return areEqual(hourglass, other.hourglass) &&
           std::equal(points.begin(), points.end(), other.points.begin(), other.points.end(),
                      [](const auto& a, const auto& b) { return a.hasSameStiffness(b); });
}

bool ElementPoints::haveSameMass(const ElementPoints& other) const {
    return std::equal(points.begin(), points.end(), other.points.begin(), other.points.end(),
                      [](const auto& a, const auto& b) { return a.hasSameMass(b); });
}

int FeElements::addMaterial(const Material& material) {
    m_materials.push_back(material);
    return int(m_materials.size()) - 1;
}

int FeElements::addOrientation(const Orientation& orientation) {
    m_orientations.push_back(orientation);
    return int(m_orientations.size()) - 1;
}

int FeElements::addMakeup(const std::string& type, const std::vector<ElementLayer>& layers,
                          const BeamRule& section) {
    Makeup makeup{type, section.isRound ? std::string("round") : type, {}};
    const ElementType shape = getSolid(type);
    const auto addZone = [&](const ElementLayer& layer, double from, double to, const auto& make) {
        Rule& rule = m_rules[{type, from, to}];
        if (!rule) rule = std::make_shared<const std::vector<IntegrationPoint>>(make());
        makeup.zones.push_back({rule, layer.material, layer.orientation, from, to});
    };
    if (isShell(type) || type == LayeredHex || type == LayeredWedge) {
        double total = 0, below = 0;
        for (const ElementLayer& layer : layers) total += layer.thickness;
        for (const ElementLayer& layer : layers) {
            const double from = 2 * below / total - 1;
            below += layer.thickness;
            const double to = 2 * below / total - 1;
            if (isShell(type))
                makeup.zones.push_back({nullptr, layer.material, layer.orientation, from, to});
            else
                addZone(layer, from, to, [&] { return makeLayerPoints(shape, from, to); });
        }
    } else if (!section.points.empty()) {
        const ElementLayer& own = layers.at(0);
        const auto addPoints = [&](const std::vector<SectionPoint>& points, Strains strains) {
            makeup.zones.push_back(
                {std::make_shared<const std::vector<IntegrationPoint>>(makeBeamPoints(points)),
                 own.material, own.orientation, -1, 1, strains});
        };
        const bool isSplit = !section.shear.empty() && m_materials[size_t(own.material)].young;
        addPoints(section.points, isSplit ? Strains::AllButShear : Strains::All);
        if (isSplit) addPoints(section.shear, Strains::Shear);
    } else {
        addZone(layers.at(0), -1, 1, [&] {
            return type == BeamSolid ? makeBeamPoints(makeFullSection())
                                     : makeIntegrationPoints(type, shape);
        });
    }
    if (hasExtrapolation(type) && !m_extrapolations.count(makeup.extrapolation))
        m_extrapolations[makeup.extrapolation] =
            section.isRound ? makeRoundExtrapolation() : makeExtrapolation(type, shape);
    m_makeups.push_back(std::move(makeup));
    return int(m_makeups.size()) - 1;
}

void FeElements::addElement(int number, int makeup, const std::vector<int>& nodes) {
    m_elements.back().number = number;
    m_elements.back().makeup = makeup;
    m_nodes.insert(m_nodes.end(), nodes.begin(), nodes.end());
    m_elements.push_back({0, 0, m_nodes.size()});
}

void FeElements::convertUnits(double length, double stress, double density) {
    m_length *= length;
    m_stress *= stress;
    m_density *= density;
    for (double& k : beside.K.values) k *= stress * length;
}

double FeElements::calcWaveSpeed() const {
    std::vector<double> speeds;
    for (int e = 0; e < size(); ++e) {
        const Material& material = m_materials[size_t(makeupOf(e).zones[0].material)];
        const double modulus = material.young ? *material.young : material.law[0][0];
        speeds.push_back(std::sqrt(modulus * m_stress / (material.density * m_density)));
    }
    if (speeds.empty()) return 0;
    const auto middle = speeds.begin() + long(speeds.size() / 2);
    std::nth_element(speeds.begin(), middle, speeds.end());
    return *middle;
}

ElasticMatrix FeElements::calcLaw(int material, int orientation, const Vec3d& at) const {
    ElasticMatrix law = m_materials[size_t(material)].law;
    if (orientation >= 0)
        law = turnElasticLaw(
            law, m_orientations[size_t(orientation)].calcAxes(scaled(at, 1 / m_length)));
    if (m_stress != 1)
        for (auto& row : law)
            for (double& entry : row) entry *= m_stress;
    return law;
}

void FeElements::calcPoints(int element, const Mesh& mesh, ElementPoints& points) const {
    const std::string& type = typeOf(element);
    points.hourglass.resize(0, 0);
    if (isShell(type)) {
        calcShell(element, mesh, points);
    } else if (type == "C3D8R") {
        calcUniform(element, mesh, points);
    } else {
        calcAtZones(element, makeupOf(element).zones, mesh, points);
        if (type == IncompatibleSolid) addIncompatibleModes(element, mesh, points);
    }
}

void FeElements::calcAtZones(int element, const std::vector<Zone>& zones, const Mesh& mesh,
                             ElementPoints& points) const {
    const int* nodes = nodesOf(element);
    size_t count = 0;
    for (const Zone& zone : zones) count += zone.points->size();
    points.points.resize(count);
    points.hasOneLaw = zones.size() == 1;
    ElementPoint* to = points.points.data();
    for (const Zone& zone : zones) {
        const bool isCylindrical =
            zone.orientation >= 0 && m_orientations[size_t(zone.orientation)].isCylindrical();
        if (isCylindrical) points.hasOneLaw = false;
        ElasticMatrix law{};
        if (!isCylindrical) law = calcLaw(zone.material, zone.orientation, {});
        for (const IntegrationPoint& point : *zone.points) {
            const auto natural = naturalGradients(point);
            const Eigen::Index n = natural.cols();
            Eigen::Matrix3d jacobian = Eigen::Matrix3d::Zero();  // ∂x/∂ξ
            Eigen::Vector3d at = Eigen::Vector3d::Zero();
            for (Eigen::Index k = 0; k < n; ++k) {
                const Eigen::Map<const Eigen::Vector3d> x(&mesh.positions[3 * size_t(nodes[k])]);
                jacobian.noalias() += x * natural.col(k).transpose();
                at += point.values[size_t(k)] * x;
            }
            const double determinant = jacobian.determinant();
            if (!(determinant > 0))
                throw std::invalid_argument(
                    "the solid of element " + std::to_string(numberOf(element)) +
                    " is turned inside out; of a shell or beam its thickness or section is too "
                    "large for how it bends");
            to->volume = point.weight * determinant;
            to->density = zone.strains == Strains::Shear
                              ? 0
                              : m_materials[size_t(zone.material)].density * m_density;
            to->N = Eigen::Map<const Eigen::VectorXd>(point.values.data(), n);
            to->G.noalias() = jacobian.inverse().transpose() * natural;
            to->B.resize(6, 0);
            to->D = isCylindrical ? calcLaw(zone.material, zone.orientation, {at[0], at[1], at[2]})
                                  : law;
            if (zone.strains != Strains::All)
                keepStrains(zone.strains == Strains::Shear, jacobian.col(0), to->D);
            ++to;
        }
    }
}

void FeElements::calcUniform(int element, const Mesh& mesh, ElementPoints& points) const {
    static const Rule full = std::make_shared<const std::vector<IntegrationPoint>>(
        makeIntegrationPoints("C3D8", ElementType::Hex8));
    constexpr double Coefficient = 0.0005;
    const Zone& own = makeupOf(element).zones[0];
    calcAtZones(element, {{full, own.material, own.orientation}}, mesh, points);
    ElementPoint mean = points.points[0];
    mean.volume = 0;
    mean.G.setZero();
    for (const ElementPoint& point : points.points) {
        mean.volume += point.volume;
        mean.G += point.volume * point.G;
    }
    mean.G /= mean.volume;
    mean.N.setConstant(1.0 / 8);
    const Matrix38 x = takePositions(mesh, nodesOf(element), 8);
    const Eigen::Vector3d at = x.rowwise().mean();
    mean.D = calcLaw(own.material, own.orientation, {at[0], at[1], at[2]});
    const std::optional<double> young = m_materials[size_t(own.material)].young;
    const double modulus = young ? *young * m_stress : mean.D[0][0];
    const auto& h = getHourglassModes();
    Eigen::Matrix<double, 8, 4> gamma = h - mean.G.transpose() * (x * h);
    if (m_hasCalculixSlips) gamma = h - mean.G.row(2).transpose() * (x.row(2) * h);
    points.hourglass.noalias() =
        Coefficient * modulus * mean.volume * mean.G.squaredNorm() * (gamma * gamma.transpose());
    points.points.assign(1, mean);
    points.hasOneLaw = true;
}

void FeElements::addIncompatibleModes(int element, const Mesh& mesh, ElementPoints& points) const {
    static const IntegrationPoint center =
        makeIntegrationPoints("C3D8R", ElementType::Hex8).front();
    const auto& rule = *makeupOf(element).zones[0].points;
    const Matrix38 x = takePositions(mesh, nodesOf(element), 8);
    const Eigen::Matrix3d J0 = x * naturalGradients(center).transpose();
    const Eigen::Matrix3d rows = J0.inverse();
    const double volume0 = J0.determinant();
    for (size_t p = 0; p < points.points.size(); ++p) {
        ElementPoint& point = points.points[p];
        const double scale = m_hasCalculixSlips ? 1 : volume0 * rule[p].weight / point.volume;
        Eigen::Matrix3d G;
        Eigen::Vector3d N;
        for (Eigen::Index a = 0; a < 3; ++a) {
            const double xi = rule[p].xi[size_t(a)];
            G.col(a) = -2 * xi * scale * rows.row(a).transpose();
            N[a] = 1 - xi * xi;
        }
        point.G.conservativeResize(3, 11);
        point.G.leftCols<8>().colwise() -= G.rowwise().sum() / 8;
        point.G.rightCols<3>() = G;
        point.N.conservativeResize(11);
        point.N.head<8>().array() -= N.sum() / 8;
        point.N.tail<3>() = N;
    }
}

std::vector<ShellLayer> FeElements::makeShellLayers(int element, const Eigen::Matrix3Xd& x) const {
    const Eigen::Vector3d at = x.rowwise().mean();
    std::vector<ShellLayer> layers;
    for (const Zone& zone : makeupOf(element).zones)
        layers.push_back({zone.from, zone.to,
                          calcLaw(zone.material, zone.orientation, {at[0], at[1], at[2]}),
                          m_materials[size_t(zone.material)].density * m_density});
    return layers;
}

void FeElements::calcShell(int element, const Mesh& mesh, ElementPoints& points) const {
    const Eigen::Matrix3Xd x = takePositions(mesh, nodesOf(element), numNodesOf(element));
    points.hasOneLaw = false;
    try {
        points.points = makeShellPoints(x, makeShellLayers(element, x));
        for (const ElementPoint& point : points.points)
            if (!point.B.allFinite() || !std::isfinite(point.volume))
                throw std::invalid_argument("it is folded over: are its nodes in order?");
    } catch (const std::invalid_argument& error) {
        throw std::invalid_argument("shell " + std::to_string(numberOf(element)) + ": " +
                                    error.what());
    }
}

/** On the lower and upper faces, so that nothing is extrapolated through the thickness. **/
void FeElements::calcShellStress(int element, const Mesh& mesh, ElementPoints& points) const {
    const Eigen::Matrix3Xd x = takePositions(mesh, nodesOf(element), numNodesOf(element));
    const std::vector<ShellLayer> layers = makeShellLayers(element, x);
    std::vector<std::array<double, 3>> places;
    for (const double zeta : {-1.0, 1.0})
        for (const auto& [xi, eta] : listShellStressPlaces(typeOf(element)))
            places.push_back({xi, eta, zeta});
    auto strains = calcShellStrainMatrices(x, layers, places);
    points.points.assign(places.size(), {});
    for (size_t p = 0; p < places.size(); ++p) {
        points.points[p].B = std::move(strains[p]);
        points.points[p].D = (places[p][2] < 0 ? layers.front() : layers.back()).law;
    }
}

void FeElements::calcStressPoints(int element, const Mesh& mesh, ElementPoints& points) const {
    if (isShell(typeOf(element))) return calcShellStress(element, mesh, points);
    if (typeOf(element) != BeamSolid) return calcPoints(element, mesh, points);
    static const Rule rule = std::make_shared<const std::vector<IntegrationPoint>>(
        makeIntegrationPoints("C3D20R", ElementType::Hex20));
    const Zone& own = makeupOf(element).zones[0];
    calcAtZones(element, {{rule, own.material, own.orientation}}, mesh, points);
}

const std::vector<double>& FeElements::getExtrapolation(int element) const {
    const auto found = m_extrapolations.find(makeupOf(element).extrapolation);
    if (found != m_extrapolations.end()) return found->second;
    throw std::invalid_argument("stress of layered shells is not known (element " +
                                std::to_string(numberOf(element)) +
                                "); reduce without stress, or mesh each layer by solids");
}

}  // namespace simflex
