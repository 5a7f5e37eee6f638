#pragma once
/** @file
Mode shapes at points, from results and tests, and their similarity.

    const ModeShapes model = readModeShapes("run.h5");
    ModeShapes test = readModeShapes("test.unv");
    test.nameNode("12", "tip");
    const ModalAssurance alike = calcModalAssurance(model, test);

alike.values[i][k] = |aᵢᴴ bₖ|² / (aᵢᴴaᵢ bₖᴴbₖ) is 1 for shapes that are equal up to magnitude and
phase, and 0 for orthogonal ones (Allemang and Brown 1982). **/

#include <complex>
#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "simflex/model/Results.h"

namespace simflex {
namespace model {

struct ModeShapes {
    std::vector<std::string> outputs;                       ///< "tip.x"
    std::vector<std::string> units;                         ///< of each output; empty if unknown
    std::vector<double> frequency;                          ///< [Hz]
    std::vector<std::vector<std::complex<double>>> shapes;  ///< of each mode, at each output
    std::vector<std::string> notes;                         ///< notes for the user

    /** Renames outputs of a node: "12.x" becomes "tip.x".
    @returns false if there is no such node
    @throws std::runtime_error if there is an output of that name already **/
    bool nameNode(const std::string& node, const std::string& name);
};

/** Shapes of an analysis of type eigen with outputs.
@throws std::runtime_error if it has none. **/
ModeShapes getModeShapes(const Results::Analysis& analysis);

/** Reads shapes from a result file (.h5), a table (.csv) or a universal file (any other name).

A table has a line for each mode and the columns `frequency [Hz]`, one named after each output, and
`imaginary NAME` for complex shapes, as written by `simflex run --csv`. From a universal file,
datasets 55 (shapes at nodes) are read, or else 58: frequency response functions of one reference,
or of one response node and several references, whose positions are then the outputs by reciprocity.
Shapes are their values at peaks of Σ|H|² that stand out by 6 dB. Outputs are "12.x", "12.rx" for
node 12.
@param analysis  of a result file; empty: its first one of type eigen with shapes
@throws std::runtime_error naming file and line. **/
ModeShapes readModeShapes(const std::string& path, const std::string& analysis = "");

/** Modal assurance criterion of two shapes; 0 if one of them is zero. **/
double calcModalAssurance(const std::vector<std::complex<double>>& a,
                          const std::vector<std::complex<double>>& b);

struct ModalAssurance {
    /** Least value of the criterion for a pair. **/
    static constexpr double LeastAlike = 0.5;

    std::vector<std::string> outputs;         ///< outputs of both that move in both
    std::vector<std::vector<double>> values;  ///< modes of the first × modes of the second
    std::vector<std::string> notes;           ///< see ModeShapes

    /** The most similar mode of the second; among equals the one nearest in frequency.
    @param mode            of the first
    @param own, others     frequencies of the modes of the first and second [Hz]
    @returns empty if none reaches LeastAlike **/
    std::optional<size_t> findPartner(size_t mode, const std::vector<double>& own,
                                      const std::vector<double>& others) const;
};
/** Compares shapes at the common outputs, without outputs that are zero in all modes of one side
(with a single mode these count, since they may be nodes of its shape). A mode that moves no output
matches none.
@throws std::runtime_error if fewer than two outputs remain. **/
ModalAssurance calcModalAssurance(const ModeShapes& a, const ModeShapes& b);

}  // namespace model
}  // namespace simflex
