#pragma once
/** @file
The contents of a CalculiX deck relevant to simflex: solid elements, sets, materials. Built by
buildDeckModel(). Internal to fe. **/

#include <map>
#include <string>
#include <vector>

#include "HingedElements.h"
#include "InpCards.h"
#include "PointElements.h"
#include "simflex/fe/FeModel.h"
#include "simflex/fe/elements/SolidElements.h"

namespace simflex {

/** Keyword of the section of layered shells in DeckModel::sections. **/
constexpr const char* LayersCard = "LAYERS";

/** A layer of a shell. **/
struct DeckLayer {
    double thickness = 0;
    std::string material, orientation;  ///< names; empty orientation: the deck's axes
};

/** The solid part of a deck, by deck numbers; shells and beams are expanded to solids. **/
struct DeckModel {
    struct Solid {
        int number = 0;
        std::vector<int> nodes;  ///< deck numbers
    };

    std::string path;
    Mesh mesh;  ///< nodes of solids and nodes tied to them; deck coordinates
    std::map<std::string, std::vector<Solid>> solids;     ///< by CalculiX type, C3D8R …
    std::map<std::string, std::vector<int>> elementSets;  ///< element numbers, solids only
    std::map<int, double> masses;                         ///< point masses by node [kg]
    std::vector<HingedElement> hinged;                    ///< trusses and membranes
    std::vector<DeckSpring> springs;
    std::vector<BeamRule> beamRules;                 ///< of sections …
    std::map<int, size_t> beamRuleOf;                ///< … of beams, by number; may lack some
    std::map<int, std::vector<DeckLayer>> layersOf;  ///< of layered shells, from below; by number
    std::map<int, double> addedDensity;              ///< of *NONSTRUCTURAL MASS, by element
    NodalConstraints constraints;                    ///< what ties nodes to each other
    std::vector<std::vector<int>> rigidBodies;       ///< mesh indices of nodes that move as one
    bool hasOtherBodies = false;                     ///< see FeElements::Beside
    std::vector<DeckCard> materials;                 ///< *MATERIAL with its properties
    std::vector<DeckCard> sections;                  ///< *ORIENTATION, *SOLID SECTION, "LAYERS"
    std::vector<std::string> notes;                  ///< see FeModel
    std::vector<std::string> warnings;               ///< see FeModel
};

}  // namespace simflex
