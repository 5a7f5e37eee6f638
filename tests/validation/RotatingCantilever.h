#pragma once
/** @file
A cantilever turned steadily about its root, zero hub radius, and its small motions.

    η = Ω √(mL⁴/EI),   λ = ω √(mL⁴/EI)

A. D. Wright, C. E. Smith, R. W. Thresher, J. L. C. Wang, Vibration modes of centrifugally stiffened
beams, J. Appl. Mech. 49 (1982) 197–202. **/

#include "simflex/body/FlexibleBody.h"
#include "simflex/solver/Eigenmodes.h"
#include "validation/Beam.h"

namespace simflex::test {

/** λ of flap, first and second; in the plane of rotation the centrifugal force turns with the beam:
λ² is η² less. **/
struct WrightRow {
    double eta;
    double lambda[2];
};
constexpr WrightRow kWrightTable[] = {{0, {3.5160, 22.0345}}, {1, {3.6816, 22.1810}},
                                      {2, {4.1373, 22.6149}}, {4, {5.5850, 24.2733}},
                                      {8, {9.2568, 29.9954}}, {12, {13.1702, 37.6031}}};

/** Two sections that differ a little: flap and lag never coincide at rest. **/
BeamOptions getRotatingCantileverOptions();
const std::shared_ptr<const ReducedBody>& getRotatingCantileverPart();

/** √(EI/mL⁴) [rad/s] for bending that moves the section along its side `depth`. **/
double calcFrequencyUnit(double depth);

/** λ of the first `count` flap modes of Euler and Bernoulli's beam, by Ritz's method with
Legendre's polynomials. @param radius  of the hub, of the length **/
std::vector<double> calcFlapFrequencies(double eta, double radius, int count);

struct RotatingModes {
    std::vector<Eigenmode> all;
    std::vector<double> flap, lag;  ///< [rad/s], ascending
};
/** Modes about the steady rotation that its drive asks for, by StaticEquilibrium and
calcEigenmodes(). Flap is where the
tip moves along the axis.
@param speed  [rad/s]
@param hubRadius  of the root [m] **/
RotatingModes calcRotatingModes(const std::shared_ptr<const ReducedBody>& part, double speed,
                                double hubRadius = 0);

}  // namespace simflex::test
