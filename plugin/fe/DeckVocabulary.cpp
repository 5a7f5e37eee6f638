#include "DeckVocabulary.h"

#include <map>
#include <set>

#include "BeamMatrices.h"

namespace simflex {
namespace {

/** Cards that a free solid part can have had, but that do not belong to K and M. **/
const std::set<std::string> kLeftOut = {"HEADING",
                                        "PREPRINT",
                                        "RESTART",
                                        "AMPLITUDE",
                                        "BOUNDARY",
                                        "RIGIDBODY",
                                        "COUPLING",
                                        "KINEMATIC",
                                        "DISTRIBUTING",
                                        "TIMEPOINTS",
                                        "INITIALCONDITIONS",
                                        "DISTRIBUTINGCOUPLING",
                                        "PHYSICALCONSTANTS",
                                        "CLOAD",
                                        "DLOAD",
                                        "NODEPRINT",
                                        "ELPRINT",
                                        "NODEFILE",
                                        "ELFILE",
                                        "NODEOUTPUT",
                                        "ELEMENTOUTPUT",
                                        "OUTPUT",
                                        "FILTER"};

/** Cards that change K so that it is not that of free solids, and why each is refused. **/
const std::map<std::string, std::string> kRefused = {
    {"NETWORKMPC", "it ties degrees of freedom, so that K is not one of plain nodal translations"},
    {"TRANSFORM", "it turns the axes of nodes, so that K is not one of plain nodal translations"},
    {"BEAMGENERALSECTION", "its stiffness is not that of a solid; use *BEAM SECTION"},
    {"MEMBRANESECTION",
     "membranes are hinged at their nodes, so that the part is a mechanism; use shells"},
    {"NORMAL", "simflex finds the normals of shells and the axes of beams itself"},
    {"FLUIDSECTION", "fluid elements have no place in a solid part"},
    {"GASKETSECTION", "gaskets are not linear"},
    {"PRE-TENSIONSECTION", "a pre-tension section ties degrees of freedom"},
    {"CYCLICSYMMETRYMODEL", "cyclic symmetry ties degrees of freedom; mesh the whole part"},
    {"SUBMODEL", "a submodel is driven by another model"},
    {"SPRING", "put springs into the multibody model"},
    {"DASHPOT", "put dashpots into the multibody model"},
    {"GAP", "gaps are not linear"},
    {"MASS", "a point mass makes M other than that of solids; weld a rigid body to an interface"},
    {"CONTACTPAIR", "contact is not linear"},
    {"SURFACEINTERACTION", "contact is not linear"},
    {"SURFACEBEHAVIOR", "contact is not linear"},
    {"CLEARANCE", "contact is not linear"},
    {"FRICTION", "contact is not linear"},
    {"HYPERELASTIC", "the material is not linear"},
    {"HYPERFOAM", "the material is not linear"},
    {"USERMATERIAL", "the material's stiffness is not known to be linear"},
    {"USERELEMENT", "its degrees of freedom are not known"},
    {"USERSECTION", "its stiffness is not known"},
};

/** Children of *MATERIAL that are kept, and those that K and M do not need. **/
const std::set<std::string> kMaterialKept = {"ELASTIC", "DENSITY"};
const std::set<std::string> kMaterialLeftOut = {
    "EXPANSION", "CONDUCTIVITY",    "SPECIFICHEAT",         "DAMPING", "DEPVAR", "PLASTIC",
    "CREEP",     "CYCLICHARDENING", "DEFORMATIONPLASTICITY"};

/** The solids of the deck, and their place in Mesh. **/
const std::map<std::string, ElementType> kSolids = {
    {"C3D4", ElementType::Tet4},      {"C3D6", ElementType::Wedge6}, {"C3D8", ElementType::Hex8},
    {"C3D8R", ElementType::Hex8},     {"C3D10", ElementType::Tet10}, {"C3D10T", ElementType::Tet10},
    {"C3D15", ElementType::Wedge15},  {"C3D20", ElementType::Hex20}, {"C3D20R", ElementType::Hex20},
    {kBeamSolid, ElementType::Hex20},
};

/** Elements that are refused, and why. **/
const std::map<std::string, std::string> kRefusedElements = {
    {"C3D8I",
     "C3D8I has internal degrees of freedom that carry mass, so that M is not one of plain nodal "
     "translations; use C3D8, C3D8R or C3D20R"},
    {"S4",
     "CalculiX expands S4 to C3D8I, which has internal degrees of freedom that carry mass; use S4R "
     "or S8R"},
    {"B31",
     "CalculiX expands B31 to C3D8I, which has internal degrees of freedom that carry mass; use "
     "B32R"},
    {"B31R",
     "CalculiX expands B31R to C3D8R, which has no inertia about the beam's axis; use B32R"},
};

/** Elements that meshers write along the skin of a solid; number of nodes of each. **/
const std::map<std::string, int> kSkin = {
    {"CPS3", 3}, {"CPS4", 4}, {"CPS4R", 4}, {"CPS6", 6}, {"CPS8", 8}, {"CPS8R", 8}, {"CPE3", 3},
    {"CPE4", 4}, {"CPE6", 6}, {"CPE8", 8},  {"T3D2", 2}, {"T3D3", 3}, {"CPS9", 9}};

}  // namespace

CardUse findCardUse(const std::string& keyword) {
    if (kMaterialKept.count(keyword)) return CardUse::MaterialProperty;
    if (kMaterialLeftOut.count(keyword)) return CardUse::LeftOutProperty;
    if (kLeftOut.count(keyword)) return CardUse::LeftOut;
    return kRefused.count(keyword) ? CardUse::Refused : CardUse::None;
}

const std::string& getRefusal(const std::string& keyword) {
    return kRefused.at(keyword);
}

const ElementType* findSolid(const std::string& calculixType) {
    const auto found = kSolids.find(calculixType);
    return found == kSolids.end() ? nullptr : &found->second;
}

ElementType getSolid(const std::string& calculixType) {
    return kSolids.at(calculixType);
}

int numSkinNodesOf(const std::string& calculixType) {
    const auto found = kSkin.find(calculixType);
    return found == kSkin.end() ? 0 : found->second;
}

const std::string* findElementRefusal(const std::string& calculixType) {
    const auto found = kRefusedElements.find(calculixType);
    return found == kRefusedElements.end() ? nullptr : &found->second;
}

}  // namespace simflex
