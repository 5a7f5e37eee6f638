#include "simflex/fe/Material.h"

#include <stdexcept>

#include "simflex/base/AsciiText.h"
#include "simflex/base/NumberText.h"
#include "simflex/part/TextLines.h"

namespace simflex {
namespace {

std::string plainName(const std::string& name) {
    std::string plain;
    for (const char c : name)
        if (c != ' ' && c != '-' && c != '_') plain += toLower(c);
    return plain;
}

std::string listNames() {
    std::string list;
    for (const Material& material : listMaterials())
        list += (list.empty() ? "" : ", ") + material.name;
    return list;
}

}  // namespace

void Material::validate() const {
    const auto refuse = [&](const char* what, double value, const char* allowed) {
        throw std::invalid_argument("material '" + name + "': " + what + " is " +
                                    std::to_string(value) + "; it must be " + allowed);
    };
    if (!(E > 0)) refuse("Young's modulus E", E, "positive [Pa]");
    if (!(nu > -1 && nu < 0.5)) refuse("Poisson's ratio nu", nu, "between -1 and 0.5");
    if (!(rho > 0)) refuse("the density rho", rho, "positive [kg/m³]");
}

const std::vector<Material>& listMaterials() {
    static const std::vector<Material> materials = {
        {"steel", 210e9, 0.3, 7850},          {"stainless-steel", 193e9, 0.29, 8000},
        {"cast-iron", 110e9, 0.27, 7200},     {"aluminium", 70e9, 0.33, 2700},
        {"titanium", 114e9, 0.33, 4430},  // Ti-6Al-4V
        {"nickel", 200e9, 0.29, 8190},    // Inconel 718
        {"copper", 120e9, 0.34, 8960},        {"brass", 100e9, 0.34, 8500},
        {"bronze", 110e9, 0.34, 8800},        {"magnesium", 45e9, 0.35, 1800},
        {"nylon", 2.7e9, 0.4, 1140},          {"ABS", 2.3e9, 0.37, 1050},
        {"PEEK", 3.7e9, 0.38, 1310},          {"acrylic", 3.2e9, 0.37, 1190},
        {"polycarbonate", 2.4e9, 0.37, 1200}, {"POM", 2.9e9, 0.37, 1420},
        {"cortical-bone", 17e9, 0.3, 1900},   {"glass", 70e9, 0.22, 2500},
    };
    return materials;
}

const Material& findMaterial(const std::string& name) {
    std::string wanted = plainName(name);
    if (wanted == "aluminum") wanted = "aluminium";
    for (const Material& material : listMaterials())
        if (plainName(material.name) == wanted) return material;
    throw std::invalid_argument("there is no material '" + name + "'; there are " + listNames() +
                                ", or give E=…,nu=…,rho=… in SI units");
}

Material parseMaterial(const std::string& text) {
    if (text.find('=') == std::string::npos) return findMaterial(text);
    Material material;
    material.name = "custom";
    bool hasE = false, hasNu = false, hasRho = false;
    std::vector<std::string_view> fields;
    splitFields(text, fields);
    for (const std::string_view field : fields) {
        const size_t equals = std::min(field.find('='), field.size());
        const std::string key = plainName(std::string(field.substr(0, equals)));
        double value = 0;
        if (equals == field.size() || !readNumber(field.substr(equals + 1), value))
            throw std::invalid_argument("material '" + text + "': " + quoteField(field) +
                                        " is not of the form NAME=NUMBER");
        if (key == "e") {
            material.E = value, hasE = true;
        } else if (key == "nu") {
            material.nu = value, hasNu = true;
        } else if (key == "rho") {
            material.rho = value, hasRho = true;
        } else {
            throw std::invalid_argument("material '" + text + "': " + quoteField(field) +
                                        " is none of E, nu and rho");
        }
    }
    if (!hasE || !hasNu || !hasRho)
        throw std::invalid_argument("material '" + text + "' lacks " +
                                    (!hasE    ? "E"
                                     : !hasNu ? "nu"
                                              : "rho") +
                                    "; give E=…,nu=…,rho=… in SI units");
    material.validate();
    return material;
}

std::vector<NamedMaterial> parseMaterials(const std::string& text) {
    std::vector<NamedMaterial> materials;
    for (const std::string& part : splitAt(text, ';')) {
        const std::string item(trimBlanks(part));
        if (item.empty()) continue;
        const size_t equals = item.find('=');
        const std::string key = plainName(std::string(trimBlanks(item.substr(0, equals))));
        const bool isNamed =
            equals != std::string::npos && key != "e" && key != "nu" && key != "rho";
        NamedMaterial named;
        if (isNamed) named.name = trimBlanks(std::string_view(item).substr(0, equals));
        named.material = parseMaterial(
            isNamed ? std::string(trimBlanks(std::string_view(item).substr(equals + 1))) : item);
        for (const NamedMaterial& other : materials)
            if (lowerCase(other.name) == lowerCase(named.name))
                throw std::invalid_argument(named.name.empty()
                                                ? "two materials have no name in '" + text +
                                                      "'; give NAME=MATERIAL"
                                                : "'" + named.name + "' is given two materials");
        materials.push_back(named);
    }
    return materials;
}

}  // namespace simflex
