#pragma once
/** @file
A cantilever rotated steadily about its root, zero hub radius, and its small motions.

    η = Ω √(mL⁴/EI),   λ = ω √(mL⁴/EI)

A. D. Wright, C. E. Smith, R. W. Thresher, J. L. C. Wang, Vibration modes of centrifugally stiffened
beams, J. Appl. Mech. 49 (1982) 197–202. **/

#include "simflex/body/FlexibleBody.h"
#include "simflex/solver/Eigenmodes.h"
#include "validation/Beam.h"

namespace simflex::test {

/** λ of the first and second flap modes. In the plane of rotation the centrifugal force rotates
with the beam, which reduces λ² by η². **/
struct WrightRow {
    double eta;
    double lambda[2];
};
constexpr WrightRow kWrightTable[] = {{0, {3.5160, 22.0345}}, {1, {3.6816, 22.1810}},
                                      {2, {4.1373, 22.6149}}, {4, {5.5850, 24.2733}},
                                      {8, {9.2568, 29.9954}}, {12, {13.1702, 37.6031}}};

/** The two section depths differ slightly: flap and lag never coincide at rest. **/
BeamOptions getRotatingCantileverOptions();
const std::shared_ptr<const ReducedBody>& getRotatingCantileverPart();

/** Returns √(EI/mL⁴) [rad/s] for bending that moves the section along its side `depth`. **/
double calcFrequencyUnit(double depth);

/** Returns λ of the first `count` flap modes of an Euler-Bernoulli beam, by the Ritz method with
Legendre polynomials. @param radius  hub radius over length **/
std::vector<double> calcFlapFrequencies(double eta, double radius, int count);

struct RotatingModes {
    std::vector<Eigenmode> all;
    std::vector<double> flap, lag;  ///< [rad/s], ascending
};
/** Returns modes about the steady rotation of its drive, by StaticEquilibrium and calcEigenmodes().
In flap modes the tip moves along the axis.
@param speed  [rad/s]
@param hubRadius  of the root [m] **/
RotatingModes calcRotatingModes(const std::shared_ptr<const ReducedBody>& part, double speed,
                                double hubRadius = 0);

}  // namespace simflex::test
