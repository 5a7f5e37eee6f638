#include "DeckOrientations.h"

#include <cmath>

#include "simflex/base/NumberText.h"
#include "simflex/fe/FaceShapes.h"

namespace simflex {
namespace {

/** Cosine of the angle between the first axis and the normal below which that axis defines a
direction in the shell. **/
constexpr double AlongNormal = 0.999999999536;
constexpr size_t AxesNumbers = 6;

/** Returns the *DISTRIBUTION named by an *ORIENTATION in place of axes, else "". **/
std::string findDistributionName(const DeckCard& orientation) {
    if (orientation.data.empty() || orientation.data[0].fields.empty()) return "";
    const std::string& first = orientation.data[0].fields[0];
    return first.empty() || isDeckNumber(first) || first[0] == '.' ? "" : first;
}

}  // namespace

DeckOrientations::DeckOrientations(const std::vector<DeckCard>& cards,
                                   const std::map<std::string, std::vector<int>>& elementSets)
    : m_cards(cards) {
    for (const DeckCard& card : m_cards) {
        if (card.keyword == "ORIENTATION") m_orientations[card.get("NAME")] = &card;
        if (card.keyword != "DISTRIBUTION") continue;
        Distribution& distribution = m_distributions[card.get("NAME")];
        distribution.card = &card;
        for (const DeckLine& data : card.data) {
            for (size_t k = 1; k <= AxesNumbers; ++k)
                readDeckNumber(card, data, k, "an element or element set and six numbers");
            const std::string& field = data.fields[0];
            if (field.empty()) {
                distribution.common = &data;
            } else if (isDeckNumber(field)) {
                distribution.ofElement[parseDeckInteger(field, card, data)] = &data;
            } else {
                const auto set = elementSets.find(field);
                if (set == elementSets.end())
                    refuseCard(card,
                               card.title + " names element set " + field +
                                   ", which the deck does not have",
                               data.line);
                for (const int number : set->second) distribution.ofElement[number] = &data;
            }
        }
    }
}

bool DeckOrientations::isDistributed(const std::string& name) const {
    const auto found = m_orientations.find(name);
    return found != m_orientations.end() && !findDistributionName(*found->second).empty();
}

DeckCard DeckOrientations::find(const DeckCard& user, const std::string& name, int element) const {
    const auto found = m_orientations.find(name);
    if (found == m_orientations.end()) refuseCard(user, "the deck has no *ORIENTATION " + name);
    DeckCard card = *found->second;
    const std::string distributionName = findDistributionName(card);
    if (distributionName.empty()) return card;
    const auto distribution = m_distributions.find(distributionName);
    if (distribution == m_distributions.end())
        refuseCard(card, card.title + " " + name + " names *DISTRIBUTION " + distributionName +
                             ", which the deck does not have");
    const auto own = distribution->second.ofElement.find(element);
    const DeckLine* line =
        own == distribution->second.ofElement.end() ? distribution->second.common : own->second;
    if (!line)
        refuseCard(*distribution->second.card,
                   "*DISTRIBUTION " + distributionName + " gives no axes of element " +
                       std::to_string(element) + ", nor a first line for all");
    card.data[0].fields.assign(line->fields.begin() + 1, line->fields.begin() + 1 + AxesNumbers);
    card.data[0].line = line->line;
    return card;
}

Axes turnIntoShell(const std::vector<Vec3d>& positions,
                   const std::function<Axes(const Vec3d&)>& axesAt) {
    const FacePoint middle = calcFacePoint(positions, 0, 0);
    Vec3d n = cross(middle.tangentXi, middle.tangentEta);
    n = scaled(n, 1 / normOf(n));
    const Axes axes = axesAt(middle.position);
    const auto axis = [&](size_t k) { return Vec3d{axes[0][k], axes[1][k], axes[2][k]}; };
    const Vec3d along = axis(std::abs(dot(axis(0), n)) > AlongNormal ? 2 : 0);
    Vec3d e1 = sumOf(along, -dot(along, n), n);
    e1 = scaled(e1, 1 / normOf(e1));
    const Vec3d e2 = cross(n, e1);
    Axes turned;
    for (size_t a = 0; a < 3; ++a) turned[a] = {e1[a], e2[a], n[a]};
    return turned;
}

DeckCard makeOrientationCard(const std::string& name, const Axes& axes) {
    DeckCard card;
    card.setTitle("*ORIENTATION");
    card.parameters = {{"NAME", name}, {"SYSTEM", "RECTANGULAR"}};
    DeckLine line;
    for (size_t k = 0; k < 2; ++k)
        for (size_t a = 0; a < 3; ++a) line.fields.push_back(writeFortran(axes[a][k], 13));
    card.data = {line};
    return card;
}

}  // namespace simflex
