#include "simflex/part/ReducedBody.h"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <sstream>
#include <stdexcept>

#include "simflex/part/PartWarnings.h"

namespace simflex {
namespace {

[[noreturn]] void refuse(const std::string& part, const std::string& what) {
    throw std::invalid_argument("part '" + part + "': " + what);
}

void checkSize(const std::string& part, const char* quantity, size_t found, size_t expected) {
    if (found == expected) return;
    refuse(part, std::string(quantity) + " has " + std::to_string(found) + " numbers, expected " +
                     std::to_string(expected));
}

void checkFinite(const std::string& part, const char* quantity, const std::vector<double>& values) {
    for (size_t i = 0; i < values.size(); ++i)
        if (!std::isfinite(values[i]))
            refuse(part, std::string(quantity) + " entry " + std::to_string(i) +
                             " is not a finite number");
}

/** Refuses a matrix with A ≠ sign·Aᵀ beyond round-off. Entries of I₂ and N are at most of order 1
for mass-normalised modes, so a vanishing component (of a plane part, for instance) may be pure
round-off.
@param size  magnitude relative to which round-off is measured at least **/
void checkSymmetry(const std::string& part, const char* quantity, const std::vector<double>& A,
                   int n, int sign, double size = 1) {
    double largest = size, defect = 0;
    for (int j = 0; j < n; ++j)
        for (int i = 0; i < n; ++i) {
            largest = std::max(largest, std::abs(A[i + j * n]));
            defect = std::max(defect, std::abs(A[i + j * n] - sign * A[j + i * n]));
        }
    if (defect <= 1e-9 * largest) return;
    std::ostringstream text;
    text << quantity << " is not " << (sign > 0 ? "symmetric" : "antisymmetric") << ": defect "
         << defect << ", allowed " << 1e-9 * largest;
    refuse(part, text.str());
}

/** Computed from the trace of I₂. **/
double calcModalMass(const std::array<std::vector<double>, 6>& I2, size_t n, size_t i, size_t j) {
    const size_t at = i + j * n;
    return 0.5 * (I2[0][at] + I2[1][at] + I2[2][at]);
}

/** For mass-normalised modes I₂ˣˣ + I₂ʸʸ + I₂ᶻᶻ = 2·1: the trace of Σm((φ_i·φ_j)1 − φ_iφ_jᵀ). **/
void checkMassNormalized(const std::string& part, const std::array<std::vector<double>, 6>& I2,
                         size_t n) {
    // Reductions satisfy this to 1e-12; in files with lumped masses, modal mass and lumped masses
    // may come from different mass matrices.
    constexpr double Tolerance = 0.1;
    for (size_t j = 0; j < n; ++j)
        for (size_t i = 0; i <= j; ++i) {
            const double mass = calcModalMass(I2, n, i, j);
            if (std::abs(mass - (i == j ? 1 : 0)) <= Tolerance) continue;
            std::ostringstream text;
            text << "the modal mass of modes " << i + 1 << " and " << j + 1 << " is " << mass
                 << " by the trace of I2; it must be " << (i == j ? 1 : 0)
                 << ": the modes are not mass-normalised, or I2 is not of these modes";
            refuse(part, text.str());
        }
}

/** Checks a list that is searched by bisection. **/
void checkAscending(const std::string& part, const std::string& quantity,
                    const std::vector<int>& values) {
    for (size_t k = 1; k < values.size(); ++k)
        if (values[k] <= values[k - 1])
            refuse(part, quantity + " must ascend, but " + std::to_string(values[k]) +
                             " stands behind " + std::to_string(values[k - 1]));
}

void checkIndices(const std::string& part, const std::string& quantity,
                  const std::vector<int>& nodes, int numNodes) {
    for (const int node : nodes)
        if (node < 0 || node >= numNodes)
            refuse(part, quantity + " names mesh index " + std::to_string(node) + " of " +
                             std::to_string(numNodes));
    checkAscending(part, "the nodes of " + quantity, nodes);
}

}  // namespace

int numNodesOf(ElementType type) {
    switch (type) {
        case ElementType::Tet4:
            return 4;
        case ElementType::Tet10:
            return 10;
        case ElementType::Hex8:
            return 8;
        case ElementType::Hex20:
            return 20;
        case ElementType::Wedge6:
            return 6;
        case ElementType::Wedge15:
            return 15;
    }
    throw std::invalid_argument("unknown element type");
}

int Mesh::indexOf(int nodeNumber) const {
    if (!nodeNumbers.empty() && nodeNumber >= nodeNumbers.front()) {  // usually there are no gaps
        const auto guess = size_t(std::int64_t(nodeNumber) - nodeNumbers.front());
        if (guess < nodeNumbers.size() && nodeNumbers[guess] == nodeNumber) return int(guess);
    }
    const auto found = std::lower_bound(nodeNumbers.begin(), nodeNumbers.end(), nodeNumber);
    if (found == nodeNumbers.end() || *found != nodeNumber)
        throw std::out_of_range("the mesh has no node number " + std::to_string(nodeNumber));
    return int(found - nodeNumbers.begin());
}

const ReducedBody::Interface& ReducedBody::getInterface(const std::string& interfaceName) const {
    std::string known;
    for (const Interface& candidate : interfaces) {
        if (candidate.name == interfaceName) return candidate;
        known += (known.empty() ? "'" : ", '") + candidate.name + "'";
    }
    throw std::out_of_range("part '" + name + "' has no interface '" + interfaceName +
                            "'; it has " + (known.empty() ? "none" : known));
}

const ReducedBody::Derivative& ReducedBody::getDerivative(const std::string& parameter) const {
    std::string known;
    for (const Derivative& candidate : derivatives) {
        if (candidate.parameter == parameter) return candidate;
        known += (known.empty() ? "'" : ", '") + candidate.parameter + "'";
    }
    throw std::out_of_range("part '" + name + "' has no derivative by '" + parameter +
                            "'; it has " + (known.empty() ? "none" : known));
}

std::vector<double> ReducedBody::calcLargestModeDisplacements() const {
    std::vector<double> largest(numModes, 0.0);
    const size_t rows = 3 * size_t(mesh.numNodes());
    for (int i = 0; i < numModes; ++i) {
        const double* phi = Phi.data() + i * rows;
        double squared = 0;
        for (size_t row = 0; row + 2 < rows; row += 3)
            squared = std::max(squared, phi[row] * phi[row] + phi[row + 1] * phi[row + 1] +
                                            phi[row + 2] * phi[row + 2]);
        largest[i] = std::sqrt(squared);
    }
    return largest;
}

double ReducedBody::calcRadius() const {
    double squared = 0;
    for (int node = 0; node < mesh.numNodes(); ++node) {
        const auto s = mesh.position(node);
        squared = std::max(squared, s[0] * s[0] + s[1] * s[1] + s[2] * s[2]);
    }
    return std::sqrt(squared);
}

ReducedBody ReducedBody::withScaledStiffness(double factor) const {
    ReducedBody scaled = *this;
    for (double& value : scaled.omegaSquared) value *= factor;
    for (Derivative& derivative : scaled.derivatives)
        for (double& value : derivative.K) value *= factor;
    if (scaled.modalStress)
        for (float& value : scaled.modalStress->stress) value = float(value * factor);
    scaled.report.reset();  // contains frequencies of the original
    scaled.finer.reset();   // has the original stiffness
    scaled.further.reset();
    return scaled;
}

std::vector<std::string> listPartDoubts(const ReducedBody& body) {
    constexpr double Tolerance = 1e-3;  // allows for lumped masses on a fine mesh
    const size_t n = size_t(body.numModes);
    double largest = 0;
    for (size_t j = 0; j < n; ++j)
        for (size_t i = 0; i <= j; ++i) {
            const double defect = calcModalMass(body.I2, n, i, j) - (i == j ? 1 : 0);
            largest = std::max(largest, std::abs(defect));
        }
    if (!(largest > Tolerance)) return {};
    std::ostringstream text;
    text << std::setprecision(2) << "the modes of part '" << body.name
         << "' and its masses are not of one model: modal masses by I2 are off by up to "
         << 100 * largest
         << " %, and results with them; export mass and modes alike, consistent or "
         << "lumped";
    return {text.str()};
}

void ReducedBody::validate() const {
    const size_t n = size_t(numModes), rows = 3 * size_t(mesh.numNodes());
    if (provenance.units != "m kg s")
        refuse(name, "its units are '" + provenance.units +
                         "'; all numbers of a part are read in m kg s: convert it, or reduce its "
                         "deck anew with its units");
    if (!(mass > 0) || !std::isfinite(mass))
        refuse(name, "mass is " + std::to_string(mass) + "; it must be positive");
    checkSize(name, "mesh positions", mesh.positions.size(), rows);
    checkSize(name, "omegaSquared", omegaSquared.size(), n);
    checkSize(name, "I1", I1.size(), 6 * n);
    checkSize(name, "Phi", Phi.size(), rows * n);
    checkFinite(name, "centre of mass", {centerOfMass.begin(), centerOfMass.end()});
    checkFinite(name, "inertia", {inertia.begin(), inertia.end()});
    checkFinite(name, "mesh positions", mesh.positions);
    checkFinite(name, "omegaSquared", omegaSquared);
    checkFinite(name, "I1", I1);
    checkFinite(name, "Phi", Phi);
    for (size_t i = 0; i < n; ++i)
        if (!(omegaSquared[i] > 0))
            refuse(name, "mode " + std::to_string(i + 1) +
                             " has omega² = " + std::to_string(omegaSquared[i]) +
                             "; it must be positive: a rigid mode is left in");
    for (size_t i = 1; i < n; ++i)
        if (omegaSquared[i] < omegaSquared[i - 1] * (1 - 1e-9))
            refuse(name, "modes must ascend in omega², but mode " + std::to_string(i + 1) +
                             " has " + std::to_string(omegaSquared[i]) + " behind " +
                             std::to_string(omegaSquared[i - 1]));
    checkAscending(name, "node numbers of the mesh", mesh.nodeNumbers);
    for (const auto& [set, nodes] : mesh.nodeSets)
        checkIndices(name, "node set '" + set + "'", nodes, mesh.numNodes());
    for (int a = 0; a < 3; ++a)
        if (!(inertia[a] > 0)) refuse(name, "a principal entry of the inertia is not positive");
    for (const auto& component : I2) {
        checkSize(name, "I2", component.size(), n * n);
        checkFinite(name, "I2", component);
        checkSymmetry(name, "I2", component, numModes, +1);
    }
    checkMassNormalized(name, I2, n);
    if (further) {
        checkSize(name, "coordinates of further shapes", further->coordinates.size(),
                  further->displacements.size() * n);
        checkFinite(name, "coordinates of further shapes", further->coordinates);
        checkFinite(name, "displacements of further shapes", further->displacements);
    }
    if (finer && finer->finer) refuse(name, "its finer twin has a finer twin");
    if (finer) finer->validate();
    for (const auto& component : N) {
        checkSize(name, "N", component.size(), n * n);
        checkFinite(name, "N", component);
        checkSymmetry(name, "N", component, numModes, -1);
    }
    for (const Interface& interface : interfaces) {
        checkSize(name, ("Phi of interface '" + interface.name + "'").c_str(), interface.Phi.size(),
                  3 * n);
        checkSize(name, ("Psi of interface '" + interface.name + "'").c_str(), interface.Psi.size(),
                  3 * n);
        checkFinite(name, "interface position",
                    {interface.position.begin(), interface.position.end()});
        checkFinite(name, "interface Phi", interface.Phi);
        checkFinite(name, "interface Psi", interface.Psi);
        checkIndices(name, "interface '" + interface.name + "'", interface.nodes, mesh.numNodes());
        checkSize(name, ("weights of interface '" + interface.name + "'").c_str(),
                  interface.weights.size(),
                  interface.tie == TieType::Distributing ? interface.nodes.size() : 0);
        checkFinite(name, "interface weights", interface.weights);
    }
    if (modalStress) {
        const size_t numValues = 6 * modalStress->nodes.size() * n;
        checkSize(name, "modal stress", modalStress->stress.size(), numValues);
        checkSize(name, "modal strain", modalStress->strain.size(), numValues);
        checkIndices(name, "modal stress", modalStress->nodes, mesh.numNodes());
        for (const auto* values : {&modalStress->stress, &modalStress->strain})
            for (const float value : *values)
                if (!std::isfinite(value)) refuse(name, "modal stress is not a finite number");
    }
    for (size_t k = 0; k < derivatives.size(); ++k) {
        const Derivative& derivative = derivatives[k];
        const std::string of = " of the derivative by '" + derivative.parameter + "'";
        for (size_t other = 0; other < k; ++other)
            if (derivatives[other].parameter == derivative.parameter)
                refuse(name, "it has the derivative by '" + derivative.parameter + "' twice");
        checkFinite(name, ("the value" + of).c_str(), {derivative.value});
        for (const auto& [quantity, matrix] :
             {std::pair("K" + of, &derivative.K), std::pair("M" + of, &derivative.M)}) {
            checkSize(name, quantity.c_str(), matrix->size(), n * n);
            checkFinite(name, quantity.c_str(), *matrix);
            checkSymmetry(name, quantity.c_str(), *matrix, numModes, +1, 0);
        }
    }
    if (!stiffening) return;
    if (stiffening->interfaces.size() != interfaces.size())
        refuse(name, "it has geometric stiffness for " +
                         std::to_string(stiffening->interfaces.size()) + " interfaces, but " +
                         std::to_string(interfaces.size()) + " interfaces");
    const auto checkStiffness = [&](const std::array<std::vector<double>, 6>& components) {
        for (const auto& component : components) {
            checkSize(name, "geometric stiffness", component.size(), n * n);
            checkFinite(name, "geometric stiffness", component);
            checkSymmetry(name, "geometric stiffness", component, numModes, +1);
        }
    };
    checkStiffness(stiffening->turning);
    for (const auto& components : stiffening->interfaces) checkStiffness(components);
}

}  // namespace simflex
