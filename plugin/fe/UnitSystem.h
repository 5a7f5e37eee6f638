#pragma once
/** @file
Consistent systems of units, conversion of a model to SI, and whether its numbers can be SI at all.

    FeModel crank = readMatrixMarket("K.mtx", "M.mtx", "nodes.csv");    // in mm, t, s
    convertToSI(crank, findUnitSystem("mm-t-s"));
    for (const std::string& warning : checkUnits(crank)) std::cerr << warning << "\n";
**/

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

/** m-kg-s (SI), mm-t-s, mm-kg-s, mm-kg-ms, mm-g-ms, cm-g-s, um-kg-s, in-lbf-s (mass in lbf s²/in),
ft-slug-s. **/
const std::vector<UnitSystem>& listUnitSystems();

/** @throws std::invalid_argument that lists the names. **/
const UnitSystem& findUnitSystem(const std::string& name);

/** Converts positions, K and m to SI in place. **/
void convertToSI(FeModel& model, const UnitSystem& units);

/** What the numbers of a model in SI say of the part; zero where it cannot be told. **/
struct PartFigures {
    double size = 0;     ///< diagonal of the box about it [m]
    double density = 0;  ///< mass over volume [kg/m³]; without elements over that of the box: less
    double waveSpeed = 0;  ///< √(E/ρ); of matrices from neighbouring entries, a rough figure [m/s]
    bool isDensityExact = false;  ///< from elements
};

PartFigures calcFigures(const FeModel& model);

/** Warnings where size, density or wave speed are those of no solid part in SI units, naming the
system of units in which they would be, and the cure. Empty if all is plausible.
@throws std::invalid_argument for a part of more than 100 km. **/
std::vector<std::string> checkUnits(const FeModel& model);

/** Of a geometry, whose material is in SI units by itself, so that nothing but its size tells a
wrong unit of length. **/
struct GeometryUnits {
    double lengthUnit = 0;  ///< [m] as given; 0: it is not
    bool isStatedByFile = false;
    double meshSize = 0;  ///< largest element [lengthUnit, or m]; 0: not given
};

/** Those of checkUnits(), or with the cure for a part of more than 50 m or 1000 t whose unit nobody
has given; and of elements larger than the part. @throws std::invalid_argument as checkUnits(). **/
std::vector<std::string> checkGeometryUnits(const FeModel& model, const GeometryUnits& units);

}  // namespace simflex
