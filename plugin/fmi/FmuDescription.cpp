#include "simflex/fmi/FmuDescription.h"

#include <algorithm>
#include <cstring>
#include <iterator>
#include <set>
#include <stdexcept>

#include "Simbody.h"
#include "simflex/base/InputFile.h"
#include "simflex/base/NumberText.h"
#include "simflex/fmi/FmuUnits.h"

namespace simflex {

using Type = FmuVariable::Type;
using Causality = FmuVariable::Causality;

const FmuVariable* FmuDescription::find(const std::string& variable) const {
    for (const FmuVariable& one : variables)
        if (one.name == variable) return &one;
    return nullptr;
}

//-------------------------------------------------------------------------------------------------
// written

namespace {

std::string escape(const std::string& text) {
    std::string escaped;
    for (const char c : text) switch (c) {
            case '&':
                escaped += "&amp;";
                break;
            case '<':
                escaped += "&lt;";
                break;
            case '>':
                escaped += "&gt;";
                break;
            case '"':
                escaped += "&quot;";
                break;
            default:
                escaped += std::uint8_t(c) < ' ' ? ' ' : c;
        }
    return escaped;
}

std::string attribute(const char* name, const std::string& value) {
    return std::string(" ") + name + "=\"" + escape(value) + '"';
}

std::string ifGiven(const char* name, const std::string& value) {
    return value.empty() ? "" : attribute(name, value);
}

std::string ifGiven(const char* name, const std::optional<double>& value) {
    return value ? attribute(name, writeGeneral(*value)) : "";
}

std::string writeUnits(const FmuDescription& description) {
    std::set<std::string> units;
    for (const FmuVariable& variable : description.variables)
        if (!variable.unit.empty()) units.insert(variable.unit);
    if (units.empty()) return "";
    std::string text = "  <UnitDefinitions>\n";
    for (const std::string& unit : units) {
        text += "    <Unit" + attribute("name", unit);
        const std::optional<BaseUnit> base = findBaseUnit(unit);
        if (!base) {
            text += "/>\n";
            continue;
        }
        text += "><BaseUnit";
        for (std::size_t i = 0; i < base->powers.size(); ++i)
            if (base->powers[i] != 0)
                text += attribute(BaseUnitNames[i], std::to_string(base->powers[i]));
        if (base->factor != 1) text += attribute("factor", writeGeneral(base->factor));
        text += "/></Unit>\n";
    }
    return text + "  </UnitDefinitions>\n";
}

const char* nameCausality(Causality causality) {
    return causality == Causality::Parameter ? "parameter"
           : causality == Causality::Input   ? "input"
           : causality == Causality::Output  ? "output"
                                             : "independent";
}

std::string writeVariable(const FmuVariable& variable, int version) {
    const std::string common =
        attribute("name", variable.name) +
        attribute("valueReference", std::to_string(variable.reference)) +
        ifGiven("description", variable.description) +
        attribute("causality", nameCausality(variable.causality)) +
        attribute("variability",
                  variable.causality == Causality::Parameter ? "fixed" : "continuous");
    const std::string own = ifGiven("start", variable.start) + ifGiven("unit", variable.unit);
    if (version == 3) return "    <Float64" + common + own + "/>\n";
    return "    <ScalarVariable" + common +
           (variable.causality == Causality::Output      ? " initial=\"calculated\""
            : variable.causality == Causality::Parameter ? " initial=\"exact\""
                                                         : "") +
           "><Real" + own + "/></ScalarVariable>\n";
}

/** Returns the key of a variable: its index in the list from 1, or its reference. **/
std::string writeKey(const FmuDescription& description, const FmuVariable& variable) {
    return std::to_string(description.version == 3
                              ? int(variable.reference)
                              : int(&variable - description.variables.data()) + 1);
}

/** @param atStart  initialisation also depends on parameters **/
std::string writeUnknowns(const FmuDescription& description, const std::string& element,
                          bool atStart) {
    std::string text;
    const char* key = description.version == 3 ? "valueReference" : "index";
    for (const FmuVariable& variable : description.variables) {
        if (variable.causality != Causality::Output) continue;
        text += "    <" + element + attribute(key, writeKey(description, variable));
        if (variable.dependencies && !atStart) {
            std::string list;
            for (const FmuVariable& input : description.variables)
                if (std::count(variable.dependencies->begin(), variable.dependencies->end(),
                               input.name))
                    list += (list.empty() ? "" : " ") + writeKey(description, input);
            text += attribute("dependencies", list);
        }
        text += "/>\n";
    }
    return text;
}

}  // namespace

std::string writeFmuDescription(const FmuDescription& description) {
    const bool isThird = description.version == 3;
    const auto flag = [](const char* name, bool value) {
        return value ? attribute(name, "true") : std::string();
    };
    std::string text = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<fmiModelDescription" +
                       attribute("fmiVersion", isThird ? "3.0" : "2.0") +
                       attribute("modelName", description.name) +
                       attribute(isThird ? "instantiationToken" : "guid", description.token) +
                       ifGiven("description", description.text) +
                       attribute("generationTool", description.tool) +
                       attribute("variableNamingConvention", "flat") + ">\n";
    const std::string suffix = isThird ? "State" : "state";
    text += "  <CoSimulation" + attribute("modelIdentifier", description.identifier) +
            flag("canHandleVariableCommunicationStepSize", true) +
            flag("canInterpolateInputs", !isThird && description.canInterpolateInputs) +
            flag("canNotUseMemoryManagementFunctions", !isThird) +
            flag(isThird ? "providesDirectionalDerivatives" : "providesDirectionalDerivative",
                 description.hasDerivatives) +
            flag(("canGetAndSetFMU" + suffix).c_str(), description.canKeepState) +
            flag(("canSerializeFMU" + suffix).c_str(), description.canSerializeState) + "/>\n";
    text += writeUnits(description);
    text +=
        "  <LogCategories>\n"
        "    <Category name=\"logStatusWarning\"/>\n"
        "    <Category name=\"logStatusError\"/>\n"
        "  </LogCategories>\n";
    text += "  <DefaultExperiment startTime=\"0\"" + ifGiven("stopTime", description.stopTime) +
            ifGiven("stepSize", description.stepSize) + "/>\n";
    text += "  <ModelVariables>\n";
    for (const FmuVariable& variable : description.variables)
        text += writeVariable(variable, description.version);
    text += "  </ModelVariables>\n";
    const std::string outputs = writeUnknowns(description, isThird ? "Output" : "Unknown", false),
                      initial =
                          writeUnknowns(description, isThird ? "InitialUnknown" : "Unknown", true);
    text += "  <ModelStructure>\n";
    if (isThird)
        text += outputs + initial;
    else if (!outputs.empty())
        text += "    <Outputs>\n" + outputs + "    </Outputs>\n    <InitialUnknowns>\n" + initial +
                "    </InitialUnknowns>\n";
    return text + "  </ModelStructure>\n</fmiModelDescription>\n";
}

//-------------------------------------------------------------------------------------------------
// read

namespace {

using SimTK::Xml::Element;

std::string get(Element& element, const char* name, const std::string& otherwise = "") {
    return element.getOptionalAttributeValue(name, otherwise);
}

bool getFlag(Element& element, const char* name) {
    const std::string text = get(element, name);
    return text == "true" || text == "1";
}

unsigned readReference(const std::string& text, const std::string& variable) {
    int number = 0;
    if (!readInteger(text, number) || number < 0) {
        double large = 0;
        if (!readNumber(text, large) || large < 0 || large > 4294967295. ||
            large != double(unsigned(large)))
            throw std::runtime_error("variable '" + variable + "' has no valueReference, but '" +
                                     text + "'");
        return unsigned(large);
    }
    return unsigned(number);
}

/** @param value  element with the type, start and unit **/
FmuVariable readVariable(Element& variable, Element& value) {
    FmuVariable read;
    read.name = get(variable, "name");
    read.reference = readReference(get(variable, "valueReference"), read.name);
    read.typeText = std::string(value.getElementTag());
    const std::string& type = read.typeText;
    read.type = type == "Real" || type == "Float64"    ? Type::Real
                : type == "Integer" || type == "Int32" ? Type::Integer
                : type == "Boolean"                    ? Type::Boolean
                                                       : Type::Other;
    const std::string causality = get(variable, "causality");
    read.causality = causality == "parameter"     ? Causality::Parameter
                     : causality == "input"       ? Causality::Input
                     : causality == "output"      ? Causality::Output
                     : causality == "independent" ? Causality::Independent
                                                  : Causality::Other;
    read.unit = get(value, "unit");
    const std::string start = get(value, "start");
    double number = 0;
    if (start == "true" || start == "false")
        read.start = start == "true" ? 1 : 0;
    else if (readNumber(start, number))
        read.start = number;
    read.isArray = value.element_begin("Dimension") != value.element_end();
    return read;
}

/** The parser is recursive for nested elements and compares each attribute of an element with all
others. @throws std::runtime_error beyond the limits of any real description. **/
void refuseDeepOrWide(const std::string& xml) {
    constexpr int MostLevels = 100, MostAttributes = 1000;
    int level = 0;
    const auto skipTo = [&](const char* end, size_t from) {
        const size_t found = xml.find(end, from);
        return found == xml.npos ? xml.size() : found;
    };
    for (size_t i = skipTo("<", 0); i < xml.size(); i = skipTo("<", i)) {
        if (xml.compare(i, 4, "<!--") == 0) {
            i = skipTo("-->", i + 4);
        } else if (xml.compare(i, 9, "<![CDATA[") == 0) {
            i = skipTo("]]>", i + 9);
        } else if (xml.compare(i, 2, "</") == 0) {
            level = std::max(0, level - 1);
            i += 2;
        } else if (xml.compare(i, 2, "<?") == 0 || xml.compare(i, 2, "<!") == 0) {
            if (level > 0)
                throw std::runtime_error("its modelDescription.xml has '" + xml.substr(i, 2) +
                                         "' within an element");
            i += 2;
        } else {
            // Skip to the end of the tag, ignoring '>' in attribute values.
            int count = 0;
            for (++i; i < xml.size() && xml[i] != '>'; ++i) {
                if (xml[i] == '"' || xml[i] == '\'') i = skipTo(xml[i] == '"' ? "\"" : "'", i + 1);
                if (i < xml.size() && xml[i] == '=' && ++count > MostAttributes)
                    throw std::runtime_error(
                        "its modelDescription.xml has an element with more "
                        "than " +
                        std::to_string(MostAttributes) + " attributes");
            }
            if (i < xml.size() && xml[i - 1] == '/') continue;
            if (++level > MostLevels)
                throw std::runtime_error("its modelDescription.xml has more than " +
                                         std::to_string(MostLevels) + " elements in one another");
        }
    }
}

}  // namespace

FmuDescription readFmuDescription(const std::filesystem::path& path) {
    if (!std::filesystem::exists(path))
        throw std::runtime_error("there is no modelDescription.xml in it");
    const std::string text = readInputFile(path);
    refuseDeepOrWide(text);
    SimTK::Xml::Document document;
    try {
        document.readFromString(text);
    } catch (const std::exception& error) {
        // Simbody's words are about its own sources; the parser's are quoted in them.
        std::string why = error.what();
        const std::size_t begin = why.find("with error '");
        if (begin != why.npos) {
            why.erase(0, begin + std::strlen("with error '"));
            why.erase(std::min(why.find('\''), why.size()));
        }
        throw std::runtime_error("its modelDescription.xml cannot be read: " + why);
    }
    Element root = document.getRootElement();
    if (root.getElementTag() != "fmiModelDescription")
        throw std::runtime_error("its modelDescription.xml describes no FMU");
    FmuDescription read;
    const std::string version = get(root, "fmiVersion");
    if (version == "2.0")
        read.version = 2;
    else if (version.compare(0, 2, "3.") == 0)
        read.version = 3;
    else
        throw std::runtime_error(version.empty()
                                     ? "its modelDescription.xml has no fmiVersion"
                                     : "it is of FMI " + version + "; 2.0 and 3.0 are known");
    const bool isThird = read.version == 3;
    read.name = get(root, "modelName");
    read.token = get(root, isThird ? "instantiationToken" : "guid");
    read.tool = get(root, "generationTool");
    if (root.element_begin("CoSimulation") == root.element_end())
        throw std::runtime_error("it is not for co-simulation");
    Element unit = root.getRequiredElement("CoSimulation");
    read.identifier = get(unit, "modelIdentifier");
    if (read.identifier.empty() || read.identifier.find('/') != std::string::npos)
        throw std::runtime_error("its modelIdentifier is '" + read.identifier + "'");
    read.canKeepState = getFlag(unit, isThird ? "canGetAndSetFMUState" : "canGetAndSetFMUstate");
    read.canSerializeState =
        getFlag(unit, isThird ? "canSerializeFMUState" : "canSerializeFMUstate");
    read.hasDerivatives =
        getFlag(unit, isThird ? "providesDirectionalDerivatives" : "providesDirectionalDerivative");
    read.isOncePerProcess = getFlag(unit, "canBeInstantiatedOnlyOncePerProcess");
    read.needsTool = getFlag(unit, "needsExecutionTool");
    if (root.element_begin("ModelVariables") == root.element_end())
        throw std::runtime_error("it has no variables");
    Element variables = root.getRequiredElement("ModelVariables");
    for (auto variable = variables.element_begin(); variable != variables.element_end();
         ++variable) {
        if (isThird) {
            read.variables.push_back(readVariable(*variable, *variable));
            continue;
        }
        auto value = variable->element_begin();
        while (value != variable->element_end() && value->getElementTag() == "Annotations") ++value;
        if (value == variable->element_end())
            throw std::runtime_error("variable '" + get(*variable, "name") + "' has no type");
        read.variables.push_back(readVariable(*variable, *value));
    }
    return read;
}

}  // namespace simflex
