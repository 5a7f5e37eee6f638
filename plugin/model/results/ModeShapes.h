#pragma once
/** @file
Shapes of modes at points, of results and of tests, and how alike they are.

    const ModeShapes model = readModeShapes("run.h5");
    ModeShapes test = readModeShapes("test.unv");
    test.nameNode("12", "tip");
    const ModalAssurance alike = calcModalAssurance(model, test);

alike.values[i][k] = |aᵢᴴ bₖ|² / (aᵢᴴaᵢ bₖᴴbₖ), 1 for shapes that are the same but for their size
and phase, 0 for those that have nothing in common (Allemang and Brown 1982). **/

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
    std::vector<std::string> units;                         ///< of each; empty: not known
    std::vector<double> frequency;                          ///< [Hz]
    std::vector<std::vector<std::complex<double>>> shapes;  ///< of each mode, at each output
    std::vector<std::string> notes;                         ///< what a reader ought to know

    /** "12.x" becomes "tip.x". @returns whether there is such a node
    @throws std::runtime_error if there is an output of that name already **/
    bool nameNode(const std::string& node, const std::string& name);
};

/** Of an analysis of type eigen with outputs. @throws std::runtime_error if it has none. **/
ModeShapes getModeShapes(const Results::Analysis& analysis);

/** From a result file (.h5), a table (.csv) or a universal file (any other name).

A table has a line for each mode and the columns `frequency [Hz]`, one with the name of each output,
and `imaginary NAME` of complex shapes, as `simflex run --csv` writes it. Of a universal file the
datasets 55 (shapes at nodes) are read, or else 58 (frequency response functions of one reference,
or of one responding node and more references, whose places are then outputs by reciprocity): their
values where Σ|H|² has a peak that stands out by 6 dB. Outputs are "12.x", "12.rx" of node 12.
@param analysis  of a result file; empty: its first of type eigen that has shapes
@throws std::runtime_error naming file and line. **/
ModeShapes readModeShapes(const std::string& path, const std::string& analysis = "");

/** 0 if one of them is zero. **/
double calcModalAssurance(const std::vector<std::complex<double>>& a,
                          const std::vector<std::complex<double>>& b);

struct ModalAssurance {
    /** Shapes that are less alike belong to no pair. **/
    static constexpr double LeastAlike = 0.5;

    std::vector<std::string> outputs;         ///< of both, moving in both
    std::vector<std::vector<double>> values;  ///< modes of the first × modes of the second
    std::vector<std::string> notes;           ///< as of ModeShapes

    /** The mode of the second that is most alike; of equals the one that is nearest in frequency.
    @param mode            of the first
    @param own, others     frequencies of the modes of the first and second [Hz]
    @returns nothing if none reaches LeastAlike **/
    std::optional<size_t> findPartner(size_t mode, const std::vector<double>& own,
                                      const std::vector<double>& others) const;
};
/** At the outputs that both have, without those that are zero in all modes of one of them (which
of one mode alone may be a node of its shape, and counts). A mode that moves no output is like none.
@throws std::runtime_error if these are less than two. **/
ModalAssurance calcModalAssurance(const ModeShapes& a, const ModeShapes& b);

}  // namespace model
}  // namespace simflex
