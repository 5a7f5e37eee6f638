#pragma once
/** @file
The axes of materials, element by element. Internal to fe.

    *DISTRIBUTION, NAME=D, LOCATION=ELEMENT      *ORIENTATION, NAME=O
    , 1., 0., 0., 0., 1., 0.                     D
    17, 0., 1., 0., -1., 0., 0.                  3, 0.

gives element 17 (or all of a set) axes of its own, others those of the line without element.

CalculiX turns the axes of a shell's material into its plane: e₁ is the first axis without its part
along the normal n in the middle of the element (of triangles, at the first corner), or the third
where the first is along n; e₂ = n × e₁. **/

#include <functional>
#include <map>
#include <string>
#include <unordered_map>
#include <vector>

#include "DeckElasticity.h"
#include "InpCards.h"
#include "simflex/fe/Vec3d.h"

namespace simflex {

class DeckOrientations {
public:
    /** @param cards  *ORIENTATION and *DISTRIBUTION; others do not matter
    @param elementSets  numbers of the elements of each
    @throws std::invalid_argument naming file and line. **/
    DeckOrientations(const std::vector<DeckCard>& cards,
                     const std::map<std::string, std::vector<int>>& elementSets);

    /** Whether a *DISTRIBUTION gives the axes of the orientation. **/
    bool isDistributed(const std::string& name) const;

    /** The *ORIENTATION of one element, with its own numbers.
    @param user  the card that names it, for messages
    @throws std::invalid_argument if the deck has none. **/
    DeckCard find(const DeckCard& user, const std::string& name, int element) const;

private:
    struct Distribution {
        const DeckCard* card;
        const DeckLine* common = nullptr;
        std::unordered_map<int, const DeckLine*> ofElement;
    };

    std::vector<DeckCard> m_cards;
    std::map<std::string, const DeckCard*> m_orientations;
    std::map<std::string, Distribution> m_distributions;
};

/** The axes of a shell's material whose nodes are at `positions`, and whose *ORIENTATION has the
axes at a place that `axesAt` gives. **/
Axes turnIntoShell(const std::vector<Vec3d>& positions,
                   const std::function<Axes(const Vec3d&)>& axesAt);

/** The *ORIENTATION card of rectangular axes. **/
DeckCard makeOrientationCard(const std::string& name, const Axes& axes);

}  // namespace simflex
