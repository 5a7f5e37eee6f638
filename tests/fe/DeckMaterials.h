#pragma once
/** @file
Materials of every kind for the element sets BODY and ONE. **/

namespace simflex {
namespace testing {

constexpr const char* Steel =
    "*MATERIAL, NAME=STEEL\n*ELASTIC\n210e9, 0.3\n*DENSITY\n7800\n"
    "*SOLID SECTION, ELSET=BODY, MATERIAL=STEEL\n";
constexpr const char* SteelAndRubber =
    "*MATERIAL, NAME=STEEL\n*ELASTIC\n210e9, 0.3\n*DENSITY\n7800\n"
    "*MATERIAL, NAME=RUBBER\n*DENSITY\n1000\n*ELASTIC, TYPE=ISO\n1e9, 0.45, 293\n"
    "*SOLID SECTION, ELSET=BODY, MATERIAL=STEEL\n*SOLID SECTION, ELSET=ONE, MATERIAL=RUBBER\n";
constexpr const char* Wood =
    "*MATERIAL, NAME=WOOD\n*DENSITY\n500\n*ELASTIC, TYPE=ENGINEERING CONSTANTS\n"
    "11e9, 0.9e9, 0.5e9, 0.37, 0.42, 0.47, 0.7e9, 0.65e9,\n0.07e9, 293\n"
    "*ORIENTATION, NAME=GRAIN\n1, 0.5, 0.2, 0, 1, 0.3\n3, 25\n"
    "*SOLID SECTION, ELSET=BODY, MATERIAL=WOOD, ORIENTATION=GRAIN\n";
constexpr const char* WoundTube =
    "*MATERIAL, NAME=TUBE\n*DENSITY\n1600\n*ELASTIC, TYPE=ORTHO\n"
    "12e9, 4e9, 140e9, 3e9, 5e9, 11e9, 4e9, 3e9,\n5e9\n"
    "*ORIENTATION, NAME=AROUND, SYSTEM=CYLINDRICAL\n-1, -2, 0, -0.8, -2, 1\n"
    "*SOLID SECTION, ELSET=BODY, MATERIAL=TUBE, ORIENTATION=AROUND\n";
constexpr const char* Crystal =
    "*MATERIAL, NAME=CRYSTAL\n*DENSITY\n2650\n*ELASTIC, TYPE=ANISO\n"
    "87e9, 7e9, 87e9, 12e9, 12e9, 106e9, 2e9, 1e9,\n-3e9, 40e9, -17e9, 17e9, 1e9, 2e9, 58e9, 3e9,\n"
    "-2e9, 1e9, 4e9, -17e9, 57e9, 293\n"
    "*ORIENTATION, NAME=CUT, SYSTEM=RECTANGULAR\n0, 1, 1, 1, 0, 0.5\n"
    "*SOLID SECTION, ELSET=BODY, MATERIAL=CRYSTAL, ORIENTATION=CUT\n";

}  // namespace testing
}  // namespace simflex
