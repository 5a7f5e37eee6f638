#include "simflex/solver/CampbellDiagram.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iomanip>

namespace simflex {

using namespace SimTK;

namespace {

std::vector<Eigenmode> calcElasticModes(const Linearization& linear) {
    std::vector<Eigenmode> modes = calcEigenmodes(linear);
    modes.erase(std::remove_if(modes.begin(), modes.end(),
                               [](const Eigenmode& mode) { return mode.isRigidMotion(); }),
                modes.end());
    return modes;
}

Real calcModalAssurance(const Matrix& M, const Vector_<Complex>& a, const Vector_<Complex>& b) {
    Complex product = 0;
    Real first = 0, second = 0;
    for (int j = 0; j < M.ncol(); ++j)
        for (int i = 0; i < M.nrow(); ++i) {
            if (M(i, j) == 0) continue;
            product += std::conj(a[i]) * M(i, j) * b[j];
            first += std::real(std::conj(a[i]) * M(i, j) * a[j]);
            second += std::real(std::conj(b[i]) * M(i, j) * b[j]);
        }
    return std::norm(product) / (first * second);
}

}  // namespace

CampbellDiagram calcCampbellDiagram(const std::vector<Real>& speeds, int numModes,
                                    const std::function<Linearization(Real speed)>& linearize) {
    if (speeds.empty() || numModes < 1)
        throw std::invalid_argument("calcCampbellDiagram(): needs a speed and a mode to follow");
    CampbellDiagram diagram;
    diagram.speeds = speeds;
    diagram.branches.resize(size_t(numModes));
    std::vector<Eigenmode> last;
    for (const Real speed : speeds) {
        const Linearization linear = linearize(speed);
        const std::vector<Eigenmode> modes = calcElasticModes(linear);
        if (int(modes.size()) < numModes)
            throw std::invalid_argument("calcCampbellDiagram(): " + std::to_string(numModes) +
                                        " modes are asked for, there are " +
                                        std::to_string(modes.size()) + " at speed " +
                                        std::to_string(speed));
        std::vector<size_t> chosen(static_cast<size_t>(numModes));
        std::vector<Real> assurance(chosen.size(), 1);
        if (last.empty()) {
            for (size_t k = 0; k < chosen.size(); ++k) chosen[k] = k;
        } else {
            // The surest pairs first; among equals the nearer frequencies.
            struct Candidate {
                Real assurance, distance;
                size_t branch, mode;
            };
            std::vector<Candidate> candidates;
            const size_t considered = std::min(modes.size(), 3 * chosen.size() + 4);
            for (size_t k = 0; k < chosen.size(); ++k)
                for (size_t i = 0; i < considered; ++i)
                    candidates.push_back(
                        {calcModalAssurance(linear.M, last[k].shape, modes[i].shape),
                         std::abs(modes[i].frequency - last[k].frequency), k, i});
            std::stable_sort(candidates.begin(), candidates.end(),
                             [](const Candidate& a, const Candidate& b) {
                                 const long first = std::lround(100 * a.assurance),
                                            second = std::lround(100 * b.assurance);
                                 if (first != second) return first > second;
                                 return a.distance < b.distance;
                             });
            std::vector<char> hasMode(chosen.size(), 0), isTaken(considered, 0);
            for (const Candidate& candidate : candidates) {
                if (hasMode[candidate.branch] || isTaken[candidate.mode]) continue;
                hasMode[candidate.branch] = isTaken[candidate.mode] = 1;
                chosen[candidate.branch] = candidate.mode;
                assurance[candidate.branch] = candidate.assurance;
            }
        }
        last.clear();
        for (size_t k = 0; k < chosen.size(); ++k) {
            const Eigenmode& mode = modes[chosen[k]];
            diagram.branches[k].frequency.push_back(mode.frequency);
            diagram.branches[k].dampingRatio.push_back(mode.dampingRatio);
            diagram.branches[k].modalAssurance.push_back(assurance[k]);
            last.push_back(mode);
        }
    }
    return diagram;
}

void writeCampbellDiagram(const std::string& csvFile, const CampbellDiagram& diagram) {
    std::ofstream file(csvFile);
    file.imbue(std::locale::classic());
    file << "speed";
    for (size_t k = 0; k < diagram.branches.size(); ++k)
        file << ",frequency " << k + 1 << " [Hz],damping ratio " << k + 1;
    file << "\n" << std::setprecision(12);
    for (size_t i = 0; i < diagram.speeds.size(); ++i) {
        file << diagram.speeds[i];
        for (const CampbellDiagram::Branch& branch : diagram.branches)
            file << "," << branch.frequency[i] << "," << branch.dampingRatio[i];
        file << "\n";
    }
    if (!file.flush()) throw std::runtime_error("cannot write the Campbell diagram to " + csvFile);
}

}  // namespace simflex
