#include "PointElements.h"

#include <Eigen/Dense>
#include <cmath>
#include <map>

#include "DeckModel.h"
#include "simflex/base/DenseAlgebra.h"
#include "simflex/base/NumberText.h"
#include "simflex/fe/MatrixEntries.h"

namespace simflex {
namespace {

struct PointType {
    int numNodes;
    std::string card;
};

const std::map<std::string, PointType> PointTypes = {
    {"MASS", {1, "MASS"}},        {"ROTARYI", {1, "ROTARYINERTIA"}},
    {"SPRINGA", {2, "SPRING"}},   {"SPRING1", {1, "SPRING"}},
    {"SPRING2", {2, "SPRING"}},   {"DASHPOTA", {2, "DASHPOT"}},
    {"DASHPOT1", {1, "DASHPOT"}}, {"DASHPOT2", {2, "DASHPOT"}},
    {"GAPUNI", {2, "GAP"}},       {"DCOUP3D", {1, "DISTRIBUTINGCOUPLING"}}};

/** Sine of the largest angle between a spring and the line of its nodes. **/
constexpr double Aligned = 1e-6;
/** Relative tolerance of the triangle inequality of moments of inertia. **/
constexpr double InertiaDigits = 1e-6;

int readTranslation(const DeckCard& card, size_t field) {
    const DeckLine& data = card.data[0];
    const int direction =
        int(readDeckNumber(card, data, field, "the degree of freedom of each of its two nodes"));
    if (direction < 1 || direction > 3)
        refuseCard(card,
                   card.title + " works on degree of freedom " + std::to_string(direction) +
                       ", but a part has translations 1 to 3 alone",
                   data.line);
    return direction;
}

}  // namespace

int numPointNodesOf(const std::string& type) {
    const auto found = PointTypes.find(type);
    return found == PointTypes.end() ? 0 : found->second.numNodes;
}

const std::string& getPointCard(const std::string& type) {
    return PointTypes.at(type).card;
}

DeckSpring readSpring(const DeckCard& card, const PointElement& element,
                      const std::array<Vec3d, 2>& places, const Axes* axes) {
    const bool isAxial = element.type == "SPRINGA";
    const size_t line = isAxial ? 0 : 1;
    if (card.data.size() != line + 1)
        refuseCard(card, card.title + " has " + std::to_string(card.data.size()) +
                             " lines, needs " +
                             (isAxial ? "one with its stiffness"
                                      : "two: its degrees of freedom and its stiffness"));
    DeckSpring spring;
    spring.nodes = {element.nodes[0], element.nodes[1]};
    const DeckLine& data = card.data[line];
    spring.stiffness = readDeckNumber(card, data, 0, "its stiffness");
    if (!(spring.stiffness > 0))
        refuseCard(card, card.title + " has stiffness " + data.fields[0] + "; it must be positive",
                   data.line);
    const Vec3d arm = minus(places[1], places[0]);
    const double length = normOf(arm);
    if (isAxial) {
        if (!(length > 0))
            refuseCard(card,
                       "the nodes of a SPRINGA are at one place, so that it "
                       "has no direction; use SPRING2");
        spring.direction = scaled(arm, 1 / length);
        return spring;
    }
    const int first = readTranslation(card, 0), second = readTranslation(card, 1);
    if (first != second)
        refuseCard(card,
                   card.title + " pulls direction " + std::to_string(first) +
                       " of one node by direction " + std::to_string(second) +
                       " of the other: it holds the part to the ground",
                   card.data[0].line);
    for (size_t a = 0; a < 3; ++a)
        spring.direction[a] = axes ? (*axes)[a][size_t(first - 1)] : double(int(a) + 1 == first);
    if (normOf(cross(arm, spring.direction)) > Aligned * length)
        refuseCard(card, "the nodes of a SPRING2 are " + writeGeneral(length, 4) +
                             " apart across its direction, so that it resists a rotation of the "
                             "whole part; give them one place, or use SPRINGA");
    return spring;
}

std::vector<PointMass> spreadInertia(const DeckCard& card, double mass, double size,
                                     const Axes* axes) {
    if (card.data.empty()) refuseCard(card, card.title + " needs I11, I22, I33, I12, I13, I23");
    const DeckLine& data = card.data[0];
    Eigen::Matrix3d J = Eigen::Matrix3d::Zero();
    constexpr int Places[6][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}};
    for (size_t k = 0; k < 6; ++k) {
        if (k >= 3 && (k >= data.fields.size() || data.fields[k].empty())) continue;
        const auto& [i, j] = Places[k];
        J(i, j) = J(j, i) = readDeckNumber(card, data, k, "I11, I22, I33, I12, I13, I23");
    }
    if (axes) {
        Eigen::Matrix3d turn;
        for (int a = 0; a < 3; ++a)
            for (int b = 0; b < 3; ++b) turn(a, b) = (*axes)[size_t(a)][size_t(b)];
        J = turn * J * turn.transpose();
    }
    const SymmetricEigen principal = calcSymmetricEigen(J);
    const double trace = J.trace(), largest = principal.values[2];
    if (!(trace > 0) || principal.values[0] < -InertiaDigits * largest ||
        largest > (1 + InertiaDigits) * (trace - largest))
        refuseCard(card,
                   card.title + " has principal moments " + writeGeneral(principal.values[0], 6) +
                       ", " + writeGeneral(principal.values[1], 6) + ", " +
                       writeGeneral(largest, 6) +
                       ", which no body has: none is negative, nor larger than the other two "
                       "together",
                   data.line);
    const double reach = mass > 0 ? std::sqrt(trace / (2 * mass)) : size;
    std::vector<PointMass> masses;
    for (Eigen::Index k = 0; k < 3; ++k) {
        // Each mass of a pair along axis k is (J_i + J_j − J_k)/4r².
        const double value = (0.5 * trace - principal.values[k]) / (2 * reach * reach);
        for (const double side : {-reach, reach}) {
            PointMass point{{}, value > 0 ? value : 0};
            for (size_t a = 0; a < 3; ++a)
                point.arm[a] = side * principal.vectors(Eigen::Index(a), k);
            masses.push_back(point);
        }
    }
    return masses;
}

void addSprings(const DeckModel& deck, FeModel& model) {
    if (deck.springs.empty()) return;
    MatrixEntries entries;
    for (const DeckSpring& spring : deck.springs) {
        const int ends[2] = {model.mesh.indexOf(spring.nodes[0]),
                             model.mesh.indexOf(spring.nodes[1])};
        for (int i = 0; i < 6; ++i)
            for (int j = 0; j <= i; ++j) {
                const double sign = i / 3 == j / 3 ? 1 : -1;
                entries.add(3 * ends[i / 3] + i % 3, 3 * ends[j / 3] + j % 3,
                            sign * spring.stiffness * spring.direction[size_t(i % 3)] *
                                spring.direction[size_t(j % 3)]);
            }
    }
    model.K = addEntries(model.K, std::move(entries), model.K.size);
}

}  // namespace simflex
