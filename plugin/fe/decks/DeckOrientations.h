#pragma once
/** @file
Material axes of each element. Internal to fe.

    *DISTRIBUTION, NAME=D, LOCATION=ELEMENT      *ORIENTATION, NAME=O
    , 1., 0., 0., 0., 1., 0.                     D
    17, 0., 1., 0., -1., 0., 0.                  3, 0.

gives element 17 (or all of a set) its own axes, other elements those of the line without element.

CalculiX rotates the axes of a shell's material into its plane: e₁ is the first axis without its
component along the normal n in the middle of the element (for triangles, at the first corner), or
the third axis if the first is along n; e₂ = n × e₁. **/

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
    /** @param cards  *ORIENTATION and *DISTRIBUTION; others are ignored
    @param elementSets  element numbers of each set
    @throws std::invalid_argument naming file and line. **/
    DeckOrientations(const std::vector<DeckCard>& cards,
                     const std::map<std::string, std::vector<int>>& elementSets);

    /** Returns whether a *DISTRIBUTION gives the axes of the orientation. **/
    bool isDistributed(const std::string& name) const;

    /** Returns the *ORIENTATION of one element, with its own numbers.
    @param user  card that names it, for messages
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

/** Returns the material axes of a shell with nodes at `positions`; `axesAt` gives the axes of its
 *ORIENTATION at a point. **/
Axes turnIntoShell(const std::vector<Vec3d>& positions,
                   const std::function<Axes(const Vec3d&)>& axesAt);

/** Makes the *ORIENTATION card of rectangular axes. **/
DeckCard makeOrientationCard(const std::string& name, const Axes& axes);

}  // namespace simflex
