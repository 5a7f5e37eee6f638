#pragma once
/** @file
A model linearised about a State, with numbers of the model file as inputs and probes as outputs:

    ẋ = A x + B p,    y = C x + D p

    const LinearSystem linear = session.linearize({"loads.push.force.y"}, {"tip.y"});
    linear.writeMat("crank.mat");     // MATLAB, Octave, scipy.io.loadmat → control.ss(A, B, C, D)

The eigenvalues of A are those that an analysis of type eigen reports. An input is the change of any
number of the model file, given by its path: a load's force, a motion's position, gravity, a
parameter; "loads.push" or "gravity" means all numbers in it. An output is the change of a probe,
"tip", or of one of its columns, "tip.y". SI units. **/

#include <string>
#include <vector>

#include "Simbody.h"
#include "simflex/solver/ModalForm.h"

namespace simflex {

struct LinearSystem {
    struct Port {
        std::string name, unit;
    };
    std::vector<Port> inputs, outputs;
    SimTK::Matrix A, B, C, D;
    /** Probes omitted when all were requested, since they have no derivative at the State, such as
    the magnitude of a displacement that is zero. **/
    std::vector<std::string> leftOut;
    int numStates = 0;  ///< of the full form; see ModalForm.h
    double time = 0;    ///< of the State [s]

    /** Writes MATLAB format 5: A, B, C, D, and the names as cell arrays `inputs`, `outputs`,
    `input_units`, `output_units`.
    @throws std::runtime_error if the file cannot be written. **/
    void writeMat(const std::string& path) const;
};

/** Harmonic motions about a State: complex amplitudes of the outputs per unit of inputs that vary
as e^{iωt}. **/
struct HarmonicResponse {
    std::vector<LinearSystem::Port> inputs, outputs;
    std::vector<double> frequencies;                        ///< ascending [Hz]
    std::vector<SimTK::Matrix_<SimTK::Complex>> transfers;  ///< at each frequency: outputs × inputs
};

}  // namespace simflex
