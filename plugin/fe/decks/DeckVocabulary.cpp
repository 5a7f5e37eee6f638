#include "DeckVocabulary.h"

#include <map>
#include <set>

#include "ThinElements.h"
#include "simflex/base/NameDistance.h"

namespace simflex {
namespace {

/** Cards that define the part. **/
const std::set<std::string> ReadCards = {"NODE",
                                         "ELEMENT",
                                         "NSET",
                                         "ELSET",
                                         "SURFACE",
                                         "MATERIAL",
                                         "ORIENTATION",
                                         "SOLIDSECTION",
                                         "BEAMSECTION",
                                         "SHELLSECTION",
                                         "EQUATION",
                                         "MPC",
                                         "TIE",
                                         "RIGIDBODY",
                                         "COUPLING",
                                         "DISTRIBUTING",
                                         "KINEMATIC",
                                         "NODALTHICKNESS",
                                         "INCLUDE",
                                         "INITIALCONDITIONS",
                                         "STEP",
                                         "ENDSTEP",
                                         "TRANSFORM",
                                         "MASS",
                                         "SPRING",
                                         "DASHPOT",
                                         "ROTARYINERTIA",
                                         "DISTRIBUTINGCOUPLING",
                                         "BEAMGENERALSECTION",
                                         "GAP",
                                         "NGEN",
                                         "NFILL",
                                         "NCOPY",
                                         "ELGEN",
                                         "ELCOPY",
                                         "NORMAL",
                                         "PARAMETER",
                                         "MEMBRANESECTION",
                                         "DISTRIBUTION",
                                         "NONSTRUCTURALMASS"};

/** Parameters of cards whose readers do not check them. **/
const std::map<std::string, std::set<std::string>> Parameters = {
    {"NODE", {"NSET"}},
    {"ELEMENT", {"TYPE", "ELSET"}},
    {"NSET", {"NSET", "ELSET", "GENERATE", "INTERNAL", "UNSORTED", "FREQUENCY"}},
    {"ELSET", {"ELSET", "GENERATE", "INTERNAL"}},
    {"SURFACE", {"NAME", "TYPE", "INTERNAL"}},
    {"MATERIAL", {"NAME"}},
    {"ELASTIC", {"TYPE"}},
    {"DENSITY", {}},
    {"ORIENTATION", {"NAME", "SYSTEM", "DEFINITION"}},
    {"SOLIDSECTION", {"ELSET", "MATERIAL", "ORIENTATION", "CONTROLS", "OFFSET"}},
    {"TRANSFORM", {"NSET", "TYPE"}},
    {"MASS", {"ELSET"}},
    {"ROTARYINERTIA", {"ELSET", "ORIENTATION"}},
    {"SPRING", {"ELSET", "ORIENTATION", "NONLINEAR"}},
    {"DASHPOT", {"ELSET"}},
    {"GAP", {"ELSET"}},
    {"DISTRIBUTINGCOUPLING", {"ELSET"}},
    {"NODALTHICKNESS", {}},
    {"NORMAL", {}},
    {"MEMBRANESECTION", {"ELSET", "MATERIAL", "ORIENTATION", "CONTROLS"}},
    {"DISTRIBUTION", {"NAME", "LOCATION", "TABLE"}},
    {"NONSTRUCTURALMASS", {"ELSET", "UNITS"}},
    {"MPC", {}},
    {"RIGIDBODY", {"NSET", "TIENSET", "ELSET", "REFNODE", "ROTNODE"}},
    {"COUPLING", {"REFNODE", "SURFACE", "CONSTRAINTNAME", "ORIENTATION"}},
    {"KINEMATIC", {}},
    {"DISTRIBUTING", {"WEIGHTINGMETHOD", "COUPLING"}},
    {"INITIALCONDITIONS", {"TYPE", "USER"}}};

/** Cards allowed in the deck of a free solid part, but irrelevant to K and M: output, solution
control, loads and supports, heat, fluids, optimization, and procedures that ccx accepts only in a
step. **/
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
                                            "CONTACTDAMPING",
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
                                            "FRICTION",
                                            "GAPCONDUCTANCE",
                                            "GAPHEATGENERATION",
                                            "GEOMETRICCONSTRAINT",
                                            "GEOMETRICTOLERANCE",
                                            "GREEN",
                                            "HCF",
                                            "HEADING",
                                            "HEATTRANSFER",
                                            "HOURGLASSSTIFFNESS",
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
                                            "SECTIONCONTROLS",
                                            "SECTIONPRINT",
                                            "SELECTCYCLICSYMMETRYMODES",
                                            "SENSITIVITY",
                                            "STATIC",
                                            "STEADYSTATEDYNAMICS",
                                            "SUBMODEL",
                                            "SUBSTRUCTUREGENERATE",
                                            "SUBSTRUCTUREMATRIXOUTPUT",
                                            "SURFACEBEHAVIOR",
                                            "SURFACEINTERACTION",
                                            TextBeforeCards,
                                            "TIMEPOINTS",
                                            "UNCOUPLEDTEMPERATURE-DISPLACEMENT",
                                            "VALUESATINFINITY",
                                            "VIEWFACTOR",
                                            "VISCO"};

/** Contact cards. **/
const std::set<std::string> ContactCards = {"CONTACT", "CONTACTPAIR", "CLEARANCE"};

constexpr const char *Generates =
                         "simflex does not make nodes and elements; write the deck out with them",
                     *MaterialCards =
                         "the material is not linear; give its *ELASTIC about the state you "
                         "need instead",
                     *Changes =
                         "simflex takes the part as it is before all steps; if that is what "
                         "you want, take the card out";

/** Cards that affect K or M in an unsupported way, and the reason. **/
const std::map<std::string, std::string> RefusedCards = {
    {"NETWORKMPC", "it ties degrees of freedom, so that K is not one of plain nodal translations"},
    {"TRANSFORMF", "it turns the axes of nodes, so that K is not one of plain nodal translations"},
    {"FLUIDSECTION", "fluid elements have no place in a solid part"},
    {"GASKETSECTION", "gaskets are not linear"},
    {"SHELLGENERALSECTION",
     "it gives the stiffness of its shells by numbers; give MATERIAL=… or COMPOSITE"},
    {"PRE-TENSIONSECTION",
     "it cuts the bolt in two; mesh the bolt in one piece (its tension is a load)"},
    {"CYCLICSYMMETRYMODEL", "cyclic symmetry ties degrees of freedom; mesh the whole part"},
    {"MATRIXASSEMBLE", "it adds matrices from files to those of the elements; reduce the matrices"},
    {"NMAP", Generates},
    {"IMPERFECTION", "it moves nodes by files of other runs; write the deck with the nodes moved"},
    {"CONNECTORSECTION", "put connectors into the multibody model"},
    {"CONNECTORBEHAVIOR", "put connectors into the multibody model"},
    {"EMBEDDEDELEMENT", "it ties degrees of freedom in a way that simflex does not support"},
    {"TRANSVERSESHEARSTIFFNESS", "it makes shells and beams other than the solids they become"},
    {"HYPERELASTIC", MaterialCards},
    {"HYPERFOAM", MaterialCards},
    {"DEFORMATIONPLASTICITY", MaterialCards},
    {"USERMATERIAL",
     "simflex cannot know what its routine does; give the material's *ELASTIC instead"},
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

/** Cards refused within a step, too. All others belong to the analysis, not to the part, and are
left out with their step. **/
const std::set<std::string> CardsRefusedInSteps = {"MODELCHANGE", "CHANGEMATERIAL",
                                                   "CHANGESOLIDSECTION"};

/** Children of *MATERIAL that are read, and those irrelevant to K and M. **/
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

/** Effects of leaving some of these out. **/
const std::string NeverYields = "the part is elastic, however much it is loaded";
const std::string OwnHourglass = "elements have CalculiX's own hourglass control";
const std::map<std::string, std::string> Consequences = {
    {"SECTIONCONTROLS", OwnHourglass},
    {"HOURGLASSSTIFFNESS", OwnHourglass},
    {"DAMPING", "a part has no damping but what the model gives it"},
    {"PLASTIC", NeverYields},
    {"CREEP", NeverYields},
    {"CYCLICHARDENING", NeverYields},
    {"MOHRCOULOMB", NeverYields},
    {"MOHRCOULOMBHARDENING", NeverYields}};

/** Refused elements and the reason. **/
const std::map<std::string, std::string> RefusedElements = {
    {"B31R",
     "CalculiX expands B31R to C3D8R, which has no inertia about the beam's axis; use B32R"},
};

/** Abaqus elements unknown to CalculiX, and its nearest type. **/
const std::map<std::string, std::string> NearestElements = {
    {"C3D4H", "C3D4"},   {"C3D6H", "C3D6"},     {"C3D8H", "C3D8"},    {"C3D8RH", "C3D8R"},
    {"C3D8IH", "C3D8I"}, {"C3D10H", "C3D10"},   {"C3D10HS", "C3D10"}, {"C3D10I", "C3D10"},
    {"C3D10M", "C3D10"}, {"C3D10MH", "C3D10"},  {"C3D15H", "C3D15"},  {"C3D20H", "C3D20"},
    {"S3R", "S3"},       {"C3D20RH", "C3D20R"}, {"STRI3", "S3"},      {"STRI65", "S6"},
    {"S4R5", "S4"},      {"S4RS", "S4"},        {"S8R5", "S8R"},      {"B31H", "B31"},
    {"B32H", "B32"},     {"M3D4R", "M3D4"}};

constexpr const char *InSpace = "mesh the part in space, by solids, shells or beams",
                     *IsNoPart =
                         "they have no place in the part; put them into the multibody model";

/** Descriptions and remedies of element types by prefix; the longest matching prefix applies. **/
const std::map<std::string, std::pair<const char*, const char*>> RefusedFamilies = {
    {"C3D5", {"pyramids", "mesh with tetrahedra, wedges and hexahedra"}},
    {"C3D13", {"pyramids", "mesh with tetrahedra, wedges and hexahedra"}},
    {"C3D27", {"hexahedra of 27 nodes", "use C3D20R"}},
    {"CAX", {"axisymmetric elements", InSpace}},
    {"CGAX", {"axisymmetric elements", InSpace}},
    {"SAX", {"axisymmetric shells", InSpace}},
    {"MAX", {"axisymmetric membranes", InSpace}},
    {"CPE", {"plane elements", InSpace}},
    {"CPS", {"plane elements", InSpace}},
    {"CPEG", {"plane elements", InSpace}},
    {"B2", {"plane beams", InSpace}},
    {"B33", {"beams without shear", "use B31 or B32R"}},
    {"PIPE3", {"pipes", "use B32R with *BEAM SECTION, SECTION=PIPE, or shells"}},
    {"T2D", {"plane trusses", InSpace}},
    {"T3D", {"trusses of this kind", "use T3D2 or beams"}},
    {"M3D", {"membranes of this kind", "use M3D4 or shells"}},
    {"SPRING", {"springs", "those that it knows are SPRINGA and SPRING2"}},
    {"DASHPOT", {"dashpots", IsNoPart}},
    {"CONN", {"connectors", IsNoPart}},
    {"GAP", {"gaps", "they are not linear; tie what stays together by *TIE or *EQUATION"}},
    {"ITT", {"contact elements", "they are not linear"}},
    {"COH", {"cohesive elements", "tie the surfaces by *TIE"}},
    {"GK", {"gaskets", "they are not linear"}},
    {"SC", {"continuum shells", "use C3D8I"}},
    {"R2D", {"rigid elements", "use *RIGID BODY"}},
    {"R3D", {"rigid elements", "use *RIGID BODY"}},
    {"DC", {"elements of heat conduction alone", "they have no stiffness; use C3D ones"}},
    {"DS", {"elements of heat conduction alone", "they have no stiffness; use shells"}},
    {"AC", {"acoustic elements", "they have no place in a solid part"}},
    {"F", {"fluid elements", "they have no place in a solid part"}},
    {"U", {"user elements", "their degrees of freedom are not known"}}};

/** Elements that meshers write along the skin of a solid, with their numbers of nodes. **/
const std::map<std::string, int> SkinElements = {
    {"CPS3", 3}, {"CPS4", 4}, {"CPS4R", 4}, {"CPS6", 6}, {"CPS8", 8}, {"CPS8R", 8},
    {"CPE3", 3}, {"CPE4", 4}, {"CPE6", 6},  {"CPE8", 8}, {"CPS9", 9}};

}  // namespace

CardUse findCardUse(const std::string& keyword) {
    if (ReadCards.count(keyword)) return CardUse::Read;
    if (MaterialCardsKept.count(keyword)) return CardUse::MaterialProperty;
    if (MaterialCardsLeftOut.count(keyword)) return CardUse::LeftOutProperty;
    if (LeftOutCards.count(keyword)) return CardUse::LeftOut;
    if (ContactCards.count(keyword)) return CardUse::Contact;
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

int numSkinNodesOf(const std::string& calculixType) {
    const auto found = SkinElements.find(calculixType);
    return found == SkinElements.end() ? 0 : found->second;
}

std::string findElementRefusal(const std::string& type) {
    const auto found = RefusedElements.find(type);
    if (found != RefusedElements.end()) return found->second;
    if (type == "D") return "D is an element of fluid networks, which have no place in a part";
    for (size_t length = type.size(); length > 0; --length) {
        const auto family = RefusedFamilies.find(type.substr(0, length));
        if (family != RefusedFamilies.end())
            return type + ": " + family->second.first +
                   " are not known to simflex: " + family->second.second;
    }
    std::vector<std::string> known;
    for (const std::string& solid : listSolids())
        if (solid[0] == 'C') known.push_back(solid);
    for (const std::string& thin : listThinTypes()) known.push_back(thin);
    const std::string nearest = findNearestName(type, known);
    std::string text = "element type " + type + " is none that simflex knows";
    if (!nearest.empty()) return text + "; did you mean " + nearest + "?";
    for (const std::string& name : known) text += (name == known[0] ? ": " : ", ") + name;
    return text;
}

const std::string* findNearestElement(const std::string& type) {
    const auto found = NearestElements.find(type);
    return found == NearestElements.end() ? nullptr : &found->second;
}

std::string proposeCard(const std::string& keyword) {
    std::vector<std::string> known;
    for (const auto* cards :
         {&ReadCards, &MaterialCardsKept, &MaterialCardsLeftOut, &LeftOutCards, &ContactCards})
        known.insert(known.end(), cards->begin(), cards->end());
    for (const auto& card : RefusedCards) known.push_back(card.first);
    std::string nearest = findNearestName(keyword, known);
    if (nearest.empty()) return "";
    // Insert blanks as in manuals.
    for (const std::string last :
         {"SECTION", "BODY", "INERTIA", "CONDITIONS", "COUPLING", "THICKNESS", "PRINT", "FILE",
          "OUTPUT", "PAIR", "INTERACTION", "BEHAVIOR", "STEP", "HEAT", "CONTROLS", "POINTS"})
        if (nearest.size() > last.size() &&
            nearest.compare(nearest.size() - last.size(), last.size(), last) == 0)
            nearest.insert(nearest.size() - last.size(), " ");
    return "; did you mean *" + nearest + "?";
}

}  // namespace simflex
