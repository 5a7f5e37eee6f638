#include "ThinSections.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>

namespace simflex {
namespace {

const std::map<std::string, BeamSection> BeamShapes = {{"RECT", BeamSection::Rectangle},
                                                       {"CIRC", BeamSection::Circle},
                                                       {"PIPE", BeamSection::Pipe},
                                                       {"BOX", BeamSection::Box}};

/** Reads a pipe's radius and wall, or a box's two sides and four walls. **/
void readWalls(const DeckCard& card, ThinElement& section) {
    const DeckLine& data = card.data[0];
    const bool isPipe = section.section == BeamSection::Pipe;
    if (isPipe) {
        section.walls[0] = section.thickness[1];
        section.thickness.fill(2 * section.thickness[0]);
    }
    for (size_t k = 0; !isPipe && k < 4; ++k)
        section.walls[k] = readDeckNumber(card, data, 2 + k, "two sides and four walls of its box");
    for (size_t k = 0; k < (isPipe ? 1 : 4); ++k) {
        const double room = isPipe       ? section.thickness[0] / 2
                            : k % 2 == 0 ? section.thickness[0] - section.walls[(k + 2) % 4]
                                         : section.thickness[1] - section.walls[(k + 2) % 4];
        if (!(section.walls[k] > 0) || section.walls[k] > room)
            refuseCard(card,
                       card.title + " has a wall of " + data.fields[isPipe ? 1 : 2 + k] +
                           ", which its section has no room for",
                       data.line);
    }
}

/** Of a rectangle, by Saint-Venant's series. **/
double calcTorsionConstant(double a, double b) {
    if (a < b) std::swap(a, b);
    double sum = 0;
    for (int n = 1; n < 40; n += 2) sum += std::tanh(n * M_PI * a / (2 * b)) / std::pow(n, 5);
    return a * b * b * b * (1.0 / 3 - 64 / std::pow(M_PI, 5) * b / a * sum);
}

/** The points drawn towards their middle until they have a torsion constant J: as displacements
warp a section by yz, that of the points is 4 I_y I_z/(I_y + I_z), and goes by the square of
distances. **/
std::vector<SectionPoint> drawTogether(std::vector<SectionPoint> points,
                                       const std::array<double, 2>& size, double J) {
    const double b = size[1] / 2, a = size[0] / 2;  // η along b
    double area = 0, eta = 0, zeta = 0, ofEta = 0, ofZeta = 0;
    for (const SectionPoint& point : points) {
        area += point.weight;
        eta += point.weight * point.eta;
        zeta += point.weight * point.zeta;
    }
    eta /= area, zeta /= area;
    for (const SectionPoint& point : points) {
        ofEta += point.weight * a * b * std::pow(b * (point.eta - eta), 2);
        ofZeta += point.weight * a * b * std::pow(a * (point.zeta - zeta), 2);
    }
    // Flat strips have it as they are, and keep the digits of one law for all strains.
    constexpr double Same = 1e-3;
    const double share = std::sqrt(J * (ofEta + ofZeta) / (4 * ofEta * ofZeta));
    if (std::abs(share * share - 1) < Same) return {};
    for (SectionPoint& point : points) {
        point.eta = eta + share * (point.eta - eta);
        point.zeta = zeta + share * (point.zeta - zeta);
    }
    return points;
}

/** On the circle of the radius of gyration. @param inner  share of the radius **/
std::vector<SectionPoint> makeRingPoints(double inner) {
    constexpr int NumPoints = 8;
    const double r = std::sqrt((1 + inner * inner) / 2);
    std::vector<SectionPoint> points;
    for (int k = 0; k < NumPoints; ++k) {
        const double angle = 2 * M_PI * k / NumPoints;
        points.push_back(
            {r * std::cos(angle), r * std::sin(angle), M_PI * (1 - inner * inner) / NumPoints});
    }
    return points;
}

/** By Simpson's rule along the middles of the walls. **/
std::vector<SectionPoint> makeBoxPoints(const ThinElement& section) {
    std::vector<SectionPoint> points;
    // ζ points along n₁, η against n₂; corners of the walls' middles, and their thicknesses.
    const auto& t = section.walls;
    const double a = section.thickness[0], b = section.thickness[1];
    const double zeta[2] = {1 - t[0] / a, -1 + t[2] / a}, eta[2] = {1 - t[3] / b, -1 + t[1] / b};
    const double thickness[4] = {2 * t[0] / a, 2 * t[1] / b, 2 * t[2] / a, 2 * t[3] / b};
    const std::array<double, 2> corners[5] = {{eta[0], zeta[0]},
                                              {eta[1], zeta[0]},
                                              {eta[1], zeta[1]},
                                              {eta[0], zeta[1]},
                                              {eta[0], zeta[0]}};
    constexpr double Simpson[5] = {1.0 / 12, 4.0 / 12, 2.0 / 12, 4.0 / 12, 1.0 / 12};
    for (size_t wall = 0; wall < 4; ++wall) {
        const auto &from = corners[wall], &to = corners[wall + 1];
        const double length = std::abs(to[0] - from[0]) + std::abs(to[1] - from[1]);
        for (int k = 0; k < 5; ++k)
            points.push_back({from[0] + 0.25 * k * (to[0] - from[0]),
                              from[1] + 0.25 * k * (to[1] - from[1]),
                              Simpson[k] * length * thickness[wall]});
    }
    return points;
}

}  // namespace

const BeamSection* findBeamSection(const std::string& name) {
    const auto found = BeamShapes.find(name.substr(0, 4));  // as in ccx: also RECTANGULAR
    return found == BeamShapes.end() ? nullptr : &found->second;
}

bool hasRadius(const DeckCard& card, const ThinElement& section) {
    if (card.keyword != "BEAMSECTION" || section.section != BeamSection::Circle ||
        section.hasNodalThickness || card.data.empty())
        return false;
    const auto& fields = card.data[0].fields;
    return std::count_if(fields.begin(), fields.end(),
                         [](const std::string& field) { return !field.empty(); }) == 1;
}

ThinElement readThinSection(const DeckCard& card) {
    const bool isBeam = card.keyword == "BEAMSECTION";
    ThinElement section;
    if (isBeam) {
        const BeamSection* shape = findBeamSection(card.get("SECTION"));
        if (!shape)
            refuseCard(card,
                       "section " + card.get("SECTION") +
                           " has no geometry of its own in CalculiX; use RECT, CIRC, PIPE or BOX, "
                           "or mesh the beam with shells or solids");
        section.section = *shape;
    }
    for (const auto& [parameter, value] : card.parameters) {
        const std::string where = card.where();
        if (parameter == "ELSET" || parameter == "MATERIAL" || parameter == "SECTION" ||
            parameter == "ORIENTATION")
            continue;
        if (parameter == "NODALTHICKNESS") {
            section.hasNodalThickness = true;
        } else if (parameter == (isBeam ? "OFFSET1" : "OFFSET")) {
            section.offset[0] = value == "SPOS"   ? 0.5
                                : value == "SNEG" ? -0.5
                                                  : parseDeckNumber(value, where);
        } else if (isBeam && parameter == "OFFSET2") {
            section.offset[1] = parseDeckNumber(value, where);
        } else if (!isBeam && parameter == "COMPOSITE") {
            section.isLayered = true;
        } else if (!isBeam && (parameter == "LAYUP" || parameter == "STACKDIRECTION")) {
            // As it is.
        } else {
            refuseCard(card, card.title + " with " + parameter + " is not known to simflex");
        }
    }
    if (isBeam && section.hasNodalThickness && section.section != BeamSection::Rectangle &&
        section.section != BeamSection::Circle)
        refuseCard(card, card.title + " of a " + card.get("SECTION") + " takes no NODAL THICKNESS");
    if (section.isLayered) {
        if (section.hasNodalThickness || card.has("MATERIAL"))
            refuseCard(card, card.title +
                                 " with COMPOSITE takes thickness and material of its "
                                 "layers; take " +
                                 (section.hasNodalThickness ? "NODAL THICKNESS" : "MATERIAL") +
                                 " out");
        if (card.data.empty()) refuseCard(card, card.title + " with COMPOSITE needs its layers");
        section.thickness.fill(0);
        for (const DeckLine& data : card.data) {
            const double thickness = readDeckNumber(card, data, 0, "the thickness of each layer");
            if (!(thickness > 0))
                refuseCard(card,
                           "a layer has thickness " + data.fields[0] + "; it must be positive",
                           data.line);
            section.thickness[0] += thickness;
        }
        // A single rotated layer is layered, too.
        section.isLayered = card.data.size() > 1 || (card.data[0].fields.size() > 3 &&
                                                     isDeckNumber(card.data[0].fields[3]));
        return section;
    }
    size_t line = 0;
    if (!section.hasNodalThickness) {
        if (card.data.empty()) refuseCard(card, card.title + " needs its thickness");
        section.thickness[0] = readDeckNumber(card, card.data[0], 0, "its thickness");
        const auto& fields = card.data[0].fields;
        if (hasRadius(card, section))
            section.thickness.fill(2 * section.thickness[0]);
        else
            section.thickness[1] =
                fields.size() > 1 && isBeam
                    ? readDeckNumber(card, card.data[0], 1, "its second thickness")
                    : section.thickness[0];
        line = 1;
        if (section.section == BeamSection::Pipe || section.section == BeamSection::Box)
            readWalls(card, section);
    } else if (isBeam && !card.data.empty()) {
        line = 1;
    }
    if (isBeam && line < card.data.size())
        for (size_t a = 0; a < 3; ++a)
            section.n1[a] =
                readDeckNumber(card, card.data[line], a, "three numbers of its axis n1");
    if (normOf(section.n1) == 0) refuseCard(card, "the axis n1 of the beam is zero");
    return section;
}

BeamRule makeBeamRule(const ThinElement& section, const std::array<double, 2>& size, ShellUse use) {
    const bool isOwn = use == ShellUse::Shells;
    BeamRule rule;
    switch (section.section) {
        case BeamSection::Rectangle:
            if (!isOwn) break;
            rule.points = makeFullSection();
            rule.shear = drawTogether(rule.points, size, calcTorsionConstant(size[0], size[1]));
            break;
        case BeamSection::Circle:
        case BeamSection::Pipe: {
            const bool isFull = section.section == BeamSection::Circle;
            if (isFull && !isOwn) break;
            rule.points =
                makeRingPoints(isFull ? 0 : 1 - 2 * section.walls[0] / section.thickness[0]);
            rule.isRound = isOwn;
            break;
        }
        case BeamSection::Box: {
            rule.points = makeBoxPoints(section);
            if (!isOwn) break;
            const auto& t = section.walls;
            const double a = size[0] - (t[0] + t[2]) / 2, b = size[1] - (t[1] + t[3]) / 2;
            // The walls' middles; each closes Bredt's tube and twists by itself.
            const double around = b / t[0] + a / t[1] + b / t[2] + a / t[3];
            double open = 0;
            for (size_t k = 0; k < 4; ++k) open += (k % 2 == 0 ? b : a) * std::pow(t[k], 3) / 3;
            rule.shear = drawTogether(rule.points, size, 4 * a * a * b * b / around + open);
            break;
        }
    }
    return rule;
}

}  // namespace simflex
