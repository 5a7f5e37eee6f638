#include "simflex/part/ModeSelection.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <sstream>
#include <stdexcept>

namespace simflex {
namespace {

double frequencyOf(const ReducedBody& part, int mode) {
    constexpr double TwoPi = 6.283185307179586;
    return std::sqrt(part.omegaSquared[size_t(mode)]) / TwoPi;
}

[[noreturn]] void refuse(const ReducedBody& part, const std::string& what) {
    std::ostringstream text;
    text << "part '" << part.name << "': " << what << "; it has ";
    if (part.numModes == 0)
        text << "no modes";
    else
        text << part.numModes << " modes (0 to " << part.numModes - 1 << "), of "
             << frequencyOf(part, 0) << " to " << frequencyOf(part, part.numModes - 1) << " Hz";
    throw std::invalid_argument(text.str());
}

/** Keeps the listed columns (ascending) of a matrix. **/
template <class Number>
void keepColumns(const std::vector<int>& modes, size_t rows, std::vector<Number>& values) {
    for (size_t k = 0; k < modes.size(); ++k)
        for (size_t i = 0; i < rows; ++i)
            values[k * rows + i] = values[size_t(modes[k]) * rows + i];
    values.resize(rows * modes.size());
    values.shrink_to_fit();
}

/** Keeps the listed rows and columns (ascending) of n×n matrices. **/
template <class Squares>
void keepSquares(const std::vector<int>& modes, int n, Squares& squares) {
    for (std::vector<double>& values : squares) {
        double* next = values.data();
        for (const int j : modes)
            for (const int i : modes) *next++ = values[size_t(i) + size_t(j) * size_t(n)];
        values.resize(modes.size() * modes.size());
        values.shrink_to_fit();
    }
}

}  // namespace

ReducedBody selectModes(ReducedBody part, std::vector<int> modes) {
    std::sort(modes.begin(), modes.end());
    for (size_t k = 0; k < modes.size(); ++k) {
        const std::string mode = "mode " + std::to_string(modes[k]);
        if (modes[k] < 0 || modes[k] >= part.numModes) refuse(part, "there is no " + mode);
        if (k > 0 && modes[k] == modes[k - 1]) refuse(part, mode + " is listed twice");
    }
    const int n = part.numModes;
    part.numModes = int(modes.size());
    keepColumns(modes, 1, part.omegaSquared);
    keepColumns(modes, 6, part.I1);
    keepColumns(modes, 3 * size_t(part.mesh.numNodes()), part.Phi);
    if (part.further)
        keepColumns(modes, part.further->displacements.size(), part.further->coordinates);
    keepSquares(modes, n, part.I2);
    keepSquares(modes, n, part.N);
    for (ReducedBody::Interface& interface : part.interfaces) {
        keepColumns(modes, 3, interface.Phi);
        keepColumns(modes, 3, interface.Psi);
    }
    if (part.modalStress) {
        keepColumns(modes, 6 * part.modalStress->nodes.size(), part.modalStress->stress);
        keepColumns(modes, 6 * part.modalStress->nodes.size(), part.modalStress->strain);
    }
    for (ReducedBody::Derivative& derivative : part.derivatives) {
        std::array<std::vector<double>, 2> both = {std::move(derivative.K),
                                                   std::move(derivative.M)};
        keepSquares(modes, n, both);
        derivative.K = std::move(both[0]);
        derivative.M = std::move(both[1]);
    }
    if (part.stiffening) {
        keepSquares(modes, n, part.stiffening->turning);
        for (auto& K : part.stiffening->interfaces) keepSquares(modes, n, K);
    }
    return part;
}

ReducedBody selectLowestModes(ReducedBody part, int count) {
    if (count < 0 || count > part.numModes)
        refuse(part, "the lowest " + std::to_string(count) + " modes were asked for");
    std::vector<int> modes(static_cast<size_t>(count));
    std::iota(modes.begin(), modes.end(), 0);
    return selectModes(std::move(part), std::move(modes));
}

std::vector<int> findModesInBand(const ReducedBody& part, double from, double to) {
    std::vector<int> modes;
    for (int mode = 0; mode < part.numModes; ++mode) {
        const double frequency = frequencyOf(part, mode);
        if (from <= frequency && frequency <= to) modes.push_back(mode);
    }
    return modes;
}

ReducedBody selectModesInBand(ReducedBody part, double from, double to) {
    std::vector<int> modes = findModesInBand(part, from, to);
    if (modes.empty()) {
        std::ostringstream band;
        band << "no mode is in the band from " << from << " to " << to << " Hz";
        refuse(part, band.str());
    }
    return selectModes(std::move(part), std::move(modes));
}

}  // namespace simflex
