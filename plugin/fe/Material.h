#pragma once
/** @file
Linear elastic materials by name, for parts given as a bare mesh. SI units.

    Material steel = findMaterial("steel");
    Material mine = parseMaterial("E=70e9,nu=0.33,rho=2700");  **/

#include <string>
#include <vector>

namespace simflex {

struct Material {
    std::string name;
    double E = 0;    ///< Young's modulus [Pa]
    double nu = 0;   ///< Poisson's ratio
    double rho = 0;  ///< density [kg/m³]

    /** @throws std::invalid_argument naming the value and the allowed range. **/
    void validate() const;
};

/** Returns typical values at room temperature; for a family (steel) those of a common member. **/
const std::vector<Material>& listMaterials();

/** Returns a material of the table; case, blanks, '-' and '_' are ignored.
@throws std::invalid_argument listing the names. **/
const Material& findMaterial(const std::string& name);

/** Parses a name of the table, or `E=…,nu=…,rho=…` (all three, any order).
@throws std::invalid_argument naming the missing or invalid item. **/
Material parseMaterial(const std::string& text);

/** Material of the solids or physical groups with this name; without name, of all others. **/
struct NamedMaterial {
    std::string name;
    Material material;
};

/** Parses `MATERIAL` or `NAME=MATERIAL`, separated by ';': `steel; PIN=brass`.
@throws std::invalid_argument for an invalid material or a repeated name. **/
std::vector<NamedMaterial> parseMaterials(const std::string& text);

}  // namespace simflex
