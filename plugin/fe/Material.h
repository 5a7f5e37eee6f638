#pragma once
/** @file
Linear elastic materials by name, for parts that come as a bare mesh. SI units.

    Material steel = findMaterial("steel");
    Material mine = parseMaterial("E=70e9,nu=0.33,rho=2700");
**/

#include <string>
#include <vector>

namespace simflex {

struct Material {
    std::string name;
    double E = 0;    ///< Young's modulus [Pa]
    double nu = 0;   ///< Poisson's ratio
    double rho = 0;  ///< density [kg/m³]

    /** @throws std::invalid_argument naming the value and what is allowed. **/
    void validate() const;
};

/** Usual values at room temperature; of a family (steel) those of a common member. **/
const std::vector<Material>& listMaterials();

/** A material of the table; upper and lower case, blanks, '-' and '_' are the same.
@throws std::invalid_argument that lists the names. **/
const Material& findMaterial(const std::string& name);

/** A name of the table, or `E=…,nu=…,rho=…` (all three, any order).
@throws std::invalid_argument naming what is missing or wrong. **/
Material parseMaterial(const std::string& text);

/** A material of the solids or physical groups of one name; without name, of all others. **/
struct NamedMaterial {
    std::string name;
    Material material;
};

/** `MATERIAL` or `NAME=MATERIAL`, with ';' between: `steel; PIN=brass`.
@throws std::invalid_argument for a material that cannot be, for a name that comes twice. **/
std::vector<NamedMaterial> parseMaterials(const std::string& text);

}  // namespace simflex
