#include "DeckVocabulary.h"

#include <map>
#include <set>

#include "BeamMatrices.h"

namespace simflex {
namespace {

/** Cards that make the part. **/
const std::set<std::string> ReadCards = {
    "NODE",        "ELEMENT",        "NSET",        "ELSET",
    "SURFACE",     "MATERIAL",       "ORIENTATION", "SOLIDSECTION",
    "BEAMSECTION", "SHELLSECTION",   "EQUATION",    "MPC",
    "TIE",         "RIGIDBODY",      "COUPLING",    "DISTRIBUTING",
    "KINEMATIC",   "NODALTHICKNESS", "INCLUDE",     "INITIALCONDITIONS",
    "STEP",        "ENDSTEP"};

/** Parameters of those whose readers do not check them. **/
const std::map<std::string, std::set<std::string>> Parameters = {
    {"NODE", {"NSET"}},
    {"ELEMENT", {"TYPE", "ELSET"}},
    {"NSET", {"NSET", "GENERATE", "INTERNAL", "UNSORTED"}},
    {"ELSET", {"ELSET", "GENERATE", "INTERNAL"}},
    {"SURFACE", {"NAME", "TYPE", "INTERNAL"}},
    {"MATERIAL", {"NAME"}},
    {"ELASTIC", {"TYPE"}},
    {"DENSITY", {}},
    {"ORIENTATION", {"NAME", "SYSTEM"}},
    {"SOLIDSECTION", {"ELSET", "MATERIAL", "ORIENTATION"}},
    {"NODALTHICKNESS", {}},
    {"MPC", {}},
    {"RIGIDBODY", {"NSET", "ELSET", "REFNODE", "ROTNODE"}},
    {"COUPLING", {"REFNODE", "SURFACE", "CONSTRAINTNAME", "ORIENTATION"}},
    {"KINEMATIC", {}},
    {"DISTRIBUTING", {}},
    {"INITIALCONDITIONS", {"TYPE"}}};

/** Cards that the deck of a free solid part can have, but that do not belong to K and M: output,
control of the solution, loads and supports, heat, fluids, optimization, and procedures that ccx
takes in a step alone. **/
const std::set<std::string> LeftOutCards = {"AMPLITUDE",
                                            "BASEMOTION",
                                            "BOUNDARY",
                                            "BOUNDARYF",
                                            "BUCKLE",
                                            "CFD",
                                            "CFLUX",
                                            "CHANGEFRICTION",
                                            "CHANGEPLASTIC",
                                            "CHANGESURFACEBEHAVIOR",
                                            "CLOAD",
                                            "COMPLEXFREQUENCY",
                                            "CONSTRAINT",
                                            "CONTACTFILE",
                                            "CONTACTOUTPUT",
                                            "CONTACTPRINT",
                                            "CONTROLS",
                                            "CORRELATIONLENGTH",
                                            "COUPLEDTEMPERATURE-DISPLACEMENT",
                                            "CRACKPROPAGATION",
                                            "DESIGNRESPONSE",
                                            "DESIGNVARIABLES",
                                            "DFLUX",
                                            "DISTRIBUTIONTABLE",
                                            "DLOAD",
                                            "DSLOAD",
                                            "DYNAMIC",
                                            "ELECTROMAGNETICS",
                                            "ELEMENTOUTPUT",
                                            "ELFILE",
                                            "ELPRINT",
                                            "FEASIBLEDIRECTION",
                                            "FILM",
                                            "FILTER",
                                            "FREQUENCY",
                                            "GEOMETRICCONSTRAINT",
                                            "GEOMETRICTOLERANCE",
                                            "GREEN",
                                            "HCF",
                                            "HEADING",
                                            "HEATTRANSFER",
                                            "MASSFLOW",
                                            "MODALDAMPING",
                                            "MODALDYNAMIC",
                                            "NOANALYSIS",
                                            "NODEFILE",
                                            "NODEOUTPUT",
                                            "NODEPRINT",
                                            "OBJECTIVE",
                                            "OUTPUT",
                                            "PHYSICALCONSTANTS",
                                            "PREPRINT",
                                            "RADIATE",
                                            "RANDOMFIELD",
                                            "RESTART",
                                            "RETAINEDNODALDOFS",
                                            "ROBUSTDESIGN",
                                            "SECTIONPRINT",
                                            "SELECTCYCLICSYMMETRYMODES",
                                            "SENSITIVITY",
                                            "STATIC",
                                            "STEADYSTATEDYNAMICS",
                                            "SUBSTRUCTUREGENERATE",
                                            "SUBSTRUCTUREMATRIXOUTPUT",
                                            "TIMEPOINTS",
                                            "UNCOUPLEDTEMPERATURE-DISPLACEMENT",
                                            "VALUESATINFINITY",
                                            "VIEWFACTOR",
                                            "VISCO"};

constexpr const char *NotLinear = "contact is not linear",
                     *MaterialCards = "the material is not linear",
                     *Changes = "simflex takes the part as it is before all steps";

/** Cards that change K or M in a way that simflex does not do, and why each is refused. **/
const std::map<std::string, std::string> RefusedCards = {
    {"NETWORKMPC", "it ties degrees of freedom, so that K is not one of plain nodal translations"},
    {"TRANSFORM", "it turns the axes of nodes, so that K is not one of plain nodal translations"},
    {"TRANSFORMF", "it turns the axes of nodes, so that K is not one of plain nodal translations"},
    {"BEAMGENERALSECTION", "its stiffness is not that of a solid; use *BEAM SECTION"},
    {"MEMBRANESECTION",
     "membranes are hinged at their nodes, so that the part is a mechanism; use shells"},
    {"NORMAL", "simflex finds the normals of shells and the axes of beams itself"},
    {"DISTRIBUTION", "it gives each element axes of its own; use *ORIENTATION by element sets"},
    {"DISTRIBUTINGCOUPLING",
     "its element DCOUP3D is not known to simflex; use *COUPLING with *DISTRIBUTING"},
    {"FLUIDSECTION", "fluid elements have no place in a solid part"},
    {"GASKETSECTION", "gaskets are not linear"},
    {"PRE-TENSIONSECTION", "a pre-tension section ties degrees of freedom"},
    {"CYCLICSYMMETRYMODEL", "cyclic symmetry ties degrees of freedom; mesh the whole part"},
    {"SUBMODEL", "a submodel is driven by another model"},
    {"SPRING", "put springs into the multibody model"},
    {"DASHPOT", "put dashpots into the multibody model"},
    {"GAP", "gaps are not linear"},
    {"GAPCONDUCTANCE", NotLinear},
    {"GAPHEATGENERATION", NotLinear},
    {"MASS", "a point mass makes M other than that of solids; weld a rigid body to an interface"},
    {"MATRIXASSEMBLE", "it adds matrices from files to those of the elements"},
    {"CONTACTPAIR", NotLinear},
    {"CONTACTDAMPING", NotLinear},
    {"SURFACEINTERACTION", NotLinear},
    {"SURFACEBEHAVIOR", NotLinear},
    {"CLEARANCE", NotLinear},
    {"FRICTION", NotLinear},
    {"HYPERELASTIC", MaterialCards},
    {"HYPERFOAM", MaterialCards},
    {"DEFORMATIONPLASTICITY", "the material is not linear; give its *ELASTIC instead"},
    {"USERMATERIAL", "the material's stiffness is not known to be linear"},
    {"USERELEMENT", "its degrees of freedom are not known"},
    {"USERSECTION", "its stiffness is not known"},
    {"REFINEMESH", "it makes another mesh; refine the mesh before"},
    {"INITIALSTRAININCREASE", "initial strains stress the part, which makes it stiffer or softer"},
    {"MODELCHANGE", "it takes elements or contacts out; leave out of the deck what is not there"},
    {"CHANGEMATERIAL", Changes},
    {"CHANGESOLIDSECTION", Changes},
    {"TEMPERATURE",
     "the part is taken as it is before all steps; give its temperature as "
     "*INITIAL CONDITIONS, TYPE=TEMPERATURE"},
};

/** Of those, the ones that a step, left out as a whole, may hold: they are what an analysis does to
the part, not what the part is. *TEMPERATURE matters to materials that depend on it. **/
const std::set<std::string> CardsRefusedInSteps = {"MODELCHANGE", "CHANGEMATERIAL",
                                                   "CHANGESOLIDSECTION"};

/** Children of *MATERIAL that are kept, and those that K and M do not need. **/
const std::set<std::string> MaterialCardsKept = {"ELASTIC", "DENSITY"};
const std::set<std::string> MaterialCardsLeftOut = {"EXPANSION",
                                                    "CONDUCTIVITY",
                                                    "SPECIFICHEAT",
                                                    "DAMPING",
                                                    "DEPVAR",
                                                    "PLASTIC",
                                                    "CREEP",
                                                    "CYCLICHARDENING",
                                                    "MOHRCOULOMB",
                                                    "MOHRCOULOMBHARDENING",
                                                    "ELECTRICALCONDUCTIVITY",
                                                    "MAGNETICPERMEABILITY",
                                                    "FLUIDCONSTANTS",
                                                    "SPECIFICGASCONSTANT"};

/** What it changes that some of these are left out. **/
const std::string NeverYields = "the part is elastic, however much it is loaded";
const std::map<std::string, std::string> Consequences = {
    {"DAMPING", "a part has no damping but what the model gives it"},
    {"PLASTIC", NeverYields},
    {"CREEP", NeverYields},
    {"CYCLICHARDENING", NeverYields},
    {"MOHRCOULOMB", NeverYields},
    {"MOHRCOULOMBHARDENING", NeverYields}};

/** The solids of the deck, and their place in Mesh. **/
const std::map<std::string, ElementType> SolidElements = {
    {"C3D4", ElementType::Tet4},     {"C3D6", ElementType::Wedge6}, {"C3D8", ElementType::Hex8},
    {"C3D8R", ElementType::Hex8},    {"C3D10", ElementType::Tet10}, {"C3D10T", ElementType::Tet10},
    {"C3D15", ElementType::Wedge15}, {"C3D20", ElementType::Hex20}, {"C3D20R", ElementType::Hex20},
    {BeamSolid, ElementType::Hex20},
};

/** Elements that are refused, and why. **/
const std::map<std::string, std::string> RefusedElements = {
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
const std::map<std::string, int> SkinElements = {
    {"CPS3", 3}, {"CPS4", 4}, {"CPS4R", 4}, {"CPS6", 6}, {"CPS8", 8}, {"CPS8R", 8}, {"CPE3", 3},
    {"CPE4", 4}, {"CPE6", 6}, {"CPE8", 8},  {"T3D2", 2}, {"T3D3", 3}, {"CPS9", 9}};

}  // namespace

CardUse findCardUse(const std::string& keyword) {
    if (ReadCards.count(keyword)) return CardUse::Read;
    if (MaterialCardsKept.count(keyword)) return CardUse::MaterialProperty;
    if (MaterialCardsLeftOut.count(keyword)) return CardUse::LeftOutProperty;
    if (LeftOutCards.count(keyword)) return CardUse::LeftOut;
    return RefusedCards.count(keyword) ? CardUse::Refused : CardUse::Unknown;
}

const std::string& getRefusal(const std::string& keyword) {
    return RefusedCards.at(keyword);
}

const std::string* findStepRefusal(const std::string& keyword) {
    return CardsRefusedInSteps.count(keyword) ? &RefusedCards.at(keyword) : nullptr;
}

const std::string* findConsequence(const std::string& keyword) {
    const auto found = Consequences.find(keyword);
    return found == Consequences.end() ? nullptr : &found->second;
}

const std::set<std::string>* findParameters(const std::string& keyword) {
    const auto found = Parameters.find(keyword);
    return found == Parameters.end() ? nullptr : &found->second;
}

const ElementType* findSolid(const std::string& calculixType) {
    const auto found = SolidElements.find(calculixType);
    return found == SolidElements.end() ? nullptr : &found->second;
}

ElementType getSolid(const std::string& calculixType) {
    return SolidElements.at(calculixType);
}

int numSkinNodesOf(const std::string& calculixType) {
    const auto found = SkinElements.find(calculixType);
    return found == SkinElements.end() ? 0 : found->second;
}

const std::string* findElementRefusal(const std::string& calculixType) {
    const auto found = RefusedElements.find(calculixType);
    return found == RefusedElements.end() ? nullptr : &found->second;
}

}  // namespace simflex
