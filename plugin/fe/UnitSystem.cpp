#include "simflex/fe/UnitSystem.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "simflex/base/NumberText.h"
#include "simflex/fe/DesignParameter.h"
#include "simflex/fe/elements/FeElements.h"

namespace simflex {
namespace {

/** Solids from foams to osmium, from rubber to diamond, with a margin for rough estimates. **/
constexpr double Lightest = 5, Heaviest = 30000;
constexpr double Slowest = 20, Fastest = 40000;
/** Parts from micromechanics to bridges [m]. **/
constexpr double Smallest = 1e-5, Largest = 1000, Absurd = 1e5;
constexpr double LongGeometry = 50, HeavyGeometry = 1e6;  // [m], [kg]
/** Ranges that make a suggested unit system plausible. **/
constexpr double LikelyDensity[2] = {300, 23000}, LikelySpeed[2] = {300, 20000};

bool isWithin(double value, double low, double high) {
    return value >= low && value <= high;
}

/** Returns six times the volume of a tetrahedron. **/
double calcTripleProduct(const Mesh& mesh, int a, int b, int c, int d) {
    std::array<double, 3> u[3];
    const int ends[3] = {b, c, d};
    const auto origin = mesh.position(a);
    for (int k = 0; k < 3; ++k)
        for (size_t axis = 0; axis < 3; ++axis)
            u[k][axis] = mesh.position(ends[k])[axis] - origin[axis];
    return u[0][0] * (u[1][1] * u[2][2] - u[1][2] * u[2][1]) +
           u[0][1] * (u[1][2] * u[2][0] - u[1][0] * u[2][2]) +
           u[0][2] * (u[1][0] * u[2][1] - u[1][1] * u[2][0]);
}

/** Returns the volume from the corner nodes of the elements. **/
double calcVolume(const Mesh& mesh) {
    static constexpr int Tet[1][4] = {{0, 1, 2, 3}};
    static constexpr int Wedge[3][4] = {{0, 1, 2, 3}, {1, 2, 3, 4}, {2, 3, 4, 5}};
    static constexpr int Hex[5][4] = {
        {0, 1, 3, 4}, {1, 2, 3, 6}, {1, 4, 5, 6}, {3, 4, 6, 7}, {1, 3, 4, 6}};
    double sixfold = 0;
    for (const ElementBlock& block : mesh.elements) {
        const bool isTet = block.type == ElementType::Tet4 || block.type == ElementType::Tet10;
        const bool isHex = block.type == ElementType::Hex8 || block.type == ElementType::Hex20;
        const int(*parts)[4] = isTet ? Tet : isHex ? Hex : Wedge;
        const int numParts = isTet ? 1 : isHex ? 5 : 3, size = numNodesOf(block.type);
        for (int e = 0; e < block.numElements(); ++e) {
            const int* nodes = &block.nodes[size_t(size) * size_t(e)];
            for (int k = 0; k < numParts; ++k)
                sixfold += std::abs(calcTripleProduct(mesh, nodes[parts[k][0]], nodes[parts[k][1]],
                                                      nodes[parts[k][2]], nodes[parts[k][3]]));
        }
    }
    return sixfold / 6;
}

/** Returns the median over nodes of √(K_aa/m) times the distance to the nearest node coupled by K.
The mass of a node is its row sum, which may be negative at corners with consistent masses: such
nodes are skipped. **/
double estimateWaveSpeed(const FeModel& model) {
    const int n = model.mesh.numNodes();
    std::vector<double> mass(size_t(n), 0.0), stiffness(size_t(n), 0.0),
        distance(size_t(n), std::numeric_limits<double>::infinity());
    for (int column = 0; column < n; ++column)
        for (auto k = model.m.columnStarts[size_t(column)];
             k < model.m.columnStarts[size_t(column) + 1]; ++k) {
            const int row = model.m.rows[size_t(k)];
            mass[size_t(row)] += model.m.values[size_t(k)];
            if (row != column) mass[size_t(column)] += model.m.values[size_t(k)];
        }
    for (int column = 0; column < 3 * n; ++column)
        for (auto k = model.K.columnStarts[size_t(column)];
             k < model.K.columnStarts[size_t(column) + 1]; ++k) {
            const int row = model.K.rows[size_t(k)], a = row / 3, b = column / 3;
            if (row == column) stiffness[size_t(a)] += model.K.values[size_t(k)] / 3;
            if (a == b || row % 3 != column % 3) continue;
            const auto x = model.mesh.position(a), y = model.mesh.position(b);
            const double d = std::hypot(x[0] - y[0], x[1] - y[1], x[2] - y[2]);
            if (d > 0)
                for (const int node : {a, b})
                    distance[size_t(node)] = std::min(distance[size_t(node)], d);
        }
    std::vector<double> speeds;
    for (size_t node = 0; node < size_t(n); ++node)
        if (mass[node] > 0 && stiffness[node] > 0 && std::isfinite(distance[node]))
            speeds.push_back(distance[node] * std::sqrt(stiffness[node] / mass[node]) / 2);
    if (speeds.empty()) return 0;
    std::nth_element(speeds.begin(), speeds.begin() + long(speeds.size() / 2), speeds.end());
    return speeds[speeds.size() / 2];
}

/** Returns the figures if the numbers were in `units` instead of SI. **/
PartFigures withUnits(const PartFigures& figures, const UnitSystem& units) {
    PartFigures result = figures;
    result.size *= units.length;
    result.density *= units.density();
    result.waveSpeed *= units.length / units.time;
    return result;
}

bool isPlausible(const PartFigures& f) {
    if (f.size > 0 && !isWithin(f.size, Smallest, Largest)) return false;
    if (f.density > Heaviest || (f.isDensityExact && f.density < Lightest)) return false;
    return f.waveSpeed == 0 || isWithin(f.waveSpeed, Slowest, Fastest);
}

bool isLikely(const PartFigures& f) {
    return isPlausible(f) &&
           isWithin(f.density, f.isDensityExact ? LikelyDensity[0] : 1, LikelyDensity[1]) &&
           (f.waveSpeed == 0 || isWithin(f.waveSpeed, LikelySpeed[0], LikelySpeed[1]));
}

std::string describe(const PartFigures& f) {
    return writeGeneral(f.size, 3) + " m long, " + (f.isDensityExact ? "" : "at least ") +
           writeGeneral(f.density, 3) + " kg/m³" +
           (f.waveSpeed > 0 ? ", wave speed about " + writeGeneral(f.waveSpeed, 3) + " m/s" : "");
}

}  // namespace

const std::vector<UnitSystem>& listUnitSystems() {
    constexpr double inch = 0.0254, pound = 4.4482216152605, foot = 0.3048;
    static const std::vector<UnitSystem> systems = {
        {"m-kg-s", 1, 1, 1},
        {"mm-t-s", 1e-3, 1e3, 1},
        {"mm-kg-s", 1e-3, 1, 1},
        {"mm-kg-ms", 1e-3, 1, 1e-3},
        {"mm-g-ms", 1e-3, 1e-3, 1e-3},
        {"cm-g-s", 1e-2, 1e-3, 1},
        {"um-kg-s", 1e-6, 1, 1},
        {"in-lbf-s", inch, pound / inch, 1},
        {"ft-slug-s", foot, pound / foot, 1},
    };
    return systems;
}

const UnitSystem& findUnitSystem(const std::string& name) {
    std::string list;
    for (const UnitSystem& system : listUnitSystems()) {
        if (system.name == name) return system;
        list += (list.empty() ? "" : ", ") + system.name;
    }
    throw std::invalid_argument("there is no system of units '" + name + "'; there are " + list);
}

void convertToSI(FeModel& model, const UnitSystem& units) {
    for (double& x : model.mesh.positions) x *= units.length;
    for (double& k : model.K.values) k *= units.mass / (units.time * units.time);
    for (double& m : model.m.values) m *= units.mass;
    if (model.elements) {
        auto elements = std::make_shared<FeElements>(*model.elements);
        elements->convertUnits(units.length, units.stress(), units.density());
        model.elements = std::move(elements);
    }
    for (auto& parameter : model.parameters) {
        auto converted = std::make_shared<DesignParameter>(*parameter);
        for (FeModel& variant : converted->variants) convertToSI(variant, units);
        const std::string& unit = converted->unit;
        converted->value *= unit == "Pa"       ? units.stress()
                            : unit == "kg/m^3" ? units.density()
                            : unit == "m"      ? units.length
                            : unit == "m^2"    ? units.length * units.length
                                               : 1;
        parameter = std::move(converted);
    }
    if (units.name != "m-kg-s")
        model.notes.push_back("converted from " + units.name + " to metres, kilograms and seconds");
}

namespace {

/** Returns the edges of the part's bounding box. **/
std::array<double, 3> measureBox(const FeModel& model) {
    std::array<double, 3> edges{};
    for (size_t axis = 0; axis < 3; ++axis) {
        double low = std::numeric_limits<double>::infinity(), high = -low;
        for (size_t k = axis; k < model.mesh.positions.size(); k += 3) {
            low = std::min(low, model.mesh.positions[k]);
            high = std::max(high, model.mesh.positions[k]);
        }
        edges[axis] = high - low;
    }
    return edges;
}

}  // namespace

PartFigures calcFigures(const FeModel& model) {
    PartFigures figures;
    const auto edges = measureBox(model);
    const double box = edges[0] * edges[1] * edges[2];
    figures.size = std::hypot(edges[0], edges[1], edges[2]);
    const double volume = model.mesh.elements.empty() ? 0 : calcVolume(model.mesh);
    figures.isDensityExact = volume > 0;
    if (volume > 0 || box > 0)
        figures.density = model.calcMass() / (figures.isDensityExact ? volume : box);
    figures.waveSpeed = model.elements ? model.elements->calcWaveSpeed() : 0;
    if (!(figures.waveSpeed > 0)) figures.waveSpeed = estimateWaveSpeed(model);
    return figures;
}

std::vector<std::string> checkUnits(const FeModel& model) {
    const PartFigures figures = calcFigures(model);
    std::vector<std::string> warnings;
    std::string likely;
    for (const UnitSystem& units : listUnitSystems()) {
        if (units.name == "m-kg-s") continue;
        const PartFigures other = withUnits(figures, units);
        if (!isLikely(other)) continue;
        likely += (likely.empty() ? " They would make sense in " : " or in ") + units.name + " (" +
                  describe(other) + ": --units " + units.name + ")";
    }
    if (!likely.empty()) likely += ".";
    if (figures.size > Absurd)
        throw std::invalid_argument(model.source + ": the part is " +
                                    writeGeneral(figures.size / 1e3, 3) + " km long in SI units." +
                                    likely);
    if (!isPlausible(figures))
        warnings.push_back("the numbers are hardly those of a solid part in SI units (" +
                           describe(figures) + ")." + likely);
    return warnings;
}

std::vector<std::string> checkGeometryUnits(const FeModel& model, const GeometryUnits& units) {
    const auto edges = measureBox(model);
    const double size = std::hypot(edges[0], edges[1], edges[2]), mass = model.calcMass();
    const std::string figures =
        writeGeneral(size, 3) + " m long and has " + writeGeneral(mass, 3) + " kg";
    const std::string cure =
        units.isStatedByFile
            ? std::string(units.lengthUnit > 0
                              ? "; length_unit is that of the millimetres which STEP and IGES are "
                                "read in: --length-unit mm, or leave it out"
                              : ", by the unit that the file states (IGES: millimetres); if that "
                                "is wrong, export it with the right one")
            : "; if the geometry is in millimetres, give --length-unit mm (in a model file "
              "length_unit: 1e-3)" +
                  std::string(units.lengthUnit > 0 ? ""
                                                   : ", and if it is in metres, --length-unit m");
    if (size > Absurd)
        throw std::invalid_argument(model.source + ": the part is " + figures + cure);
    const bool isMeant = units.lengthUnit > 0 && !units.isStatedByFile;
    const bool isStrange = !isMeant && (size > LongGeometry || mass > HeavyGeometry);
    std::vector<std::string> warnings =
        isStrange ? std::vector{"the part is " + figures + cure} : checkUnits(model);
    const double largest = units.meshSize * (units.lengthUnit > 0 ? units.lengthUnit : 1);
    if (largest > size)
        warnings.push_back("elements of " + writeGeneral(largest, 3) +
                           " m are larger than the part, which is " + writeGeneral(size, 3) +
                           " m long: --mesh-size (mesh_size) is in the unit of --length-unit "
                           "(length_unit), without it in metres");
    return warnings;
}

}  // namespace simflex
