#pragma once
/** @file
Consistent unit systems, conversion of a model to SI, and plausibility checks of SI numbers.

    FeModel crank = readMatrixMarket("K.mtx", "M.mtx", "nodes.csv");    // in mm, t, s
    convertToSI(crank, findUnitSystem("mm-t-s"));
    for (const std::string& warning : checkUnits(crank)) std::cerr << warning << "\n";  **/

#include <string>
#include <vector>

#include "simflex/fe/FeModel.h"

namespace simflex {

/** Length, mass and time; force is mass·length/time². **/
struct UnitSystem {
    std::string name;   ///< "mm-t-s"
    double length = 1;  ///< one unit in metres
    double mass = 1;    ///< in kilograms
    double time = 1;    ///< in seconds

    double force() const { return mass * length / (time * time); }
    double stress() const { return mass / (length * time * time); }
    double density() const { return mass / (length * length * length); }
};

/** Returns m-kg-s (SI), mm-t-s, mm-kg-s, mm-kg-ms, mm-g-ms, cm-g-s, um-kg-s, in-lbf-s (mass in lbf
s²/in), ft-slug-s. **/
const std::vector<UnitSystem>& listUnitSystems();

/** @throws std::invalid_argument listing the names. **/
const UnitSystem& findUnitSystem(const std::string& name);

/** Converts positions, K and m to SI in place. **/
void convertToSI(FeModel& model, const UnitSystem& units);

/** Characteristic figures of a model in SI; zero if unknown. **/
struct PartFigures {
    double size = 0;     ///< diagonal of the box about it [m]
    double density = 0;  ///< mass over volume [kg/m³]; without elements over that of the box: less
    double waveSpeed = 0;  ///< √(E/ρ); of matrices from neighbouring entries, a rough figure [m/s]
    bool isDensityExact = false;  ///< from elements
};

PartFigures calcFigures(const FeModel& model);

/** Returns warnings if size, density or wave speed are implausible for a solid part in SI units,
naming the unit system in which they would be plausible and the remedy. Empty if all are plausible.
@throws std::invalid_argument for a part of more than 100 km. **/
std::vector<std::string> checkUnits(const FeModel& model);

/** Units of a geometry. Its material is in SI units anyway, so a wrong unit of length can be
detected by size only. **/
struct GeometryUnits {
    double lengthUnit = 0;  ///< as given [m]; 0: not given
    bool isStatedByFile = false;
    double meshSize = 0;  ///< largest element size [lengthUnit, or m]; 0: not given
};

/** Returns the warnings of checkUnits(), or one with the remedy for a part of more than 50 m or
1000 t whose unit is not given; also for elements larger than the part. @throws
std::invalid_argument as checkUnits(). **/
std::vector<std::string> checkGeometryUnits(const FeModel& model, const GeometryUnits& units);

}  // namespace simflex
