#pragma once
/** @file
Parameters of a deck with respect to which the stiffness and mass of a part are differentiated.
Internal to fe and reduction. Their names are

    youngs_modulus:MATERIAL  of an isotropic material with one line of constants [Pa]
    stiffness:MATERIAL       of any material: a factor of its whole elastic law
    youngs_modulus:SET       of the *BEAM GENERAL SECTION of that ELSET, at the same G; with
    shear_modulus:SET        shear_modulus and stiffness, where its material is in it [Pa]
    density:MATERIAL         [kg/m³]
    thickness:SET            of the *SHELL SECTION or *MEMBRANE SECTION of that ELSET; of layers
                             that of all together, in proportion [m]
    thickness:SET:K          of its layer K, of which 1 lies lowest [m]
    section:SET:L            of the *BEAM SECTION of that ELSET [m]: a and b of RECT; r of CIRC (a
                             and b of two numbers); r and t of PIPE; a, b, t1 … t4 of BOX
    area:SET                 of trusses [m²]
    nodal_thickness          a factor of all of *NODAL THICKNESS

A constant given for several temperatures is scaled by a factor, too. An OFFSET remains the same
share of the thickness. In bulk data PSHELL 3 is SET P3 with MATERIAL PID_3, and PCOMP 4 is SET P4
with materials such as PID_4_MID_5.

The derivative is a fourth-order central difference of all data of the elements: positions of nodes
and points, shape functions, elastic laws and the motions allowed by constraints,

    f′(p) ≈ [8 f(p + hp) − 8 f(p − hp) − f(p + 2hp) + f(p − 2hp)] / 12 hp,  h = 1e-3

It is exact if K and m are polynomials in p up to the fourth degree (moduli, densities, areas,
thicknesses of flat shells, sections of straight beams). The relative error for 1/p is 4h⁴ = 4e-12,
and round-off is ε/h = 2e-13 of the K or m of the elements concerned. **/

#include <array>
#include <string>

#include "simflex/fe/FeModel.h"

namespace simflex {

struct DesignParameter {
    static constexpr double Step = 1e-3;
    static constexpr int NumVariants = 4;
    static constexpr std::array<double, NumVariants> Steps = {-2, -1, 1, 2},
                                                     Weights = {1.0 / 12, -8.0 / 12, 8.0 / 12,
                                                                -1.0 / 12};

    std::string name, unit;  ///< unit of value, SI; "1" for a factor
    double value = 0;        ///< p > 0
    /** The model at p + Steps·Step·p, on the same nodes; K and m are those of springs, points,
    trusses and membranes only. **/
    std::array<FeModel, NumVariants> variants;
};

}  // namespace simflex
