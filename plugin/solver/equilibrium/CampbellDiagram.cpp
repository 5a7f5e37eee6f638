#include "simflex/solver/CampbellDiagram.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iomanip>

#include "simflex/base/FlushDenormals.h"

namespace simflex {

using namespace SimTK;

namespace {

/** Shapes have modal mass 1. **/
Real calcModalAssurance(const Eigenmode& before, const Eigenmode& now) {
    Complex product = 0;
    for (int i = 0; i < now.momentum.size(); ++i)
        product += std::conj(before.shape[i]) * now.momentum[i];
    return std::min(Real(1), std::norm(product));
}

/** Among which those that continue some are sought. **/
size_t countConsidered(size_t numModes) {
    return 3 * numModes + 4;
}

/** A branch's mode at a speed. **/
struct BranchPair {
    Eigenmode mode;
    Real assurance;
};

/** The modes that continue those of the speed before: the surest pairs first, among equals the
nearer frequencies. **/
std::vector<BranchPair> follow(std::vector<Eigenmode> modes, const std::vector<Eigenmode>& last,
                               size_t numModes) {
    modes.erase(std::remove_if(modes.begin(), modes.end(),
                               [](const Eigenmode& mode) { return mode.isRigidMotion(); }),
                modes.end());
    if (modes.size() < numModes)
        throw std::runtime_error(std::to_string(numModes) + " modes are asked for, there are " +
                                 std::to_string(modes.size()));
    std::vector<BranchPair> pairs;
    if (last.empty()) {
        for (size_t k = 0; k < numModes; ++k) pairs.push_back({modes[k], 1});
        return pairs;
    }
    struct Candidate {
        Real assurance, distance;
        size_t branch, mode;
    };
    std::vector<Candidate> candidates;
    const size_t considered = std::min(modes.size(), countConsidered(numModes));
    for (size_t k = 0; k < numModes; ++k)
        for (size_t i = 0; i < considered; ++i)
            candidates.push_back({calcModalAssurance(last[k], modes[i]),
                                  std::abs(modes[i].frequency - last[k].frequency), k, i});
    std::stable_sort(candidates.begin(), candidates.end(),
                     [](const Candidate& a, const Candidate& b) {
                         const long first = std::lround(100 * a.assurance),
                                    second = std::lround(100 * b.assurance);
                         if (first != second) return first > second;
                         return a.distance < b.distance;
                     });
    std::vector<char> hasMode(numModes, 0), isTaken(considered, 0);
    pairs.resize(numModes);
    for (const Candidate& candidate : candidates) {
        if (hasMode[candidate.branch] || isTaken[candidate.mode]) continue;
        hasMode[candidate.branch] = isTaken[candidate.mode] = 1;
        pairs[candidate.branch] = {modes[candidate.mode], candidate.assurance};
    }
    return pairs;
}

}  // namespace

CampbellDiagram calcCampbellDiagram(
    const std::vector<Real>& speeds, int numModes,
    const std::function<std::vector<Eigenmode>(Real speed, int count)>& calcModes) {
    const StandardArithmetic standard;
    if (speeds.empty() || numModes < 1)
        throw std::invalid_argument("calcCampbellDiagram(): needs a speed and a mode to follow");
    CampbellDiagram diagram;
    diagram.speeds = speeds;
    diagram.branches.resize(size_t(numModes));
    std::vector<Eigenmode> last;
    for (const Real speed : speeds) {
        std::vector<BranchPair> pairs;
        diagram.failures.emplace_back();
        try {
            pairs = follow(calcModes(speed, int(countConsidered(size_t(numModes)))), last,
                           size_t(numModes));
        } catch (const std::exception& error) {
            diagram.failures.back() = error.what();
        }
        if (!pairs.empty()) last.clear();
        for (size_t k = 0; k < diagram.branches.size(); ++k) {
            CampbellDiagram::Branch& branch = diagram.branches[k];
            branch.frequency.push_back(pairs.empty() ? NaN : pairs[k].mode.frequency);
            branch.dampingRatio.push_back(pairs.empty() ? NaN : pairs[k].mode.dampingRatio);
            branch.modalAssurance.push_back(pairs.empty() ? NaN : pairs[k].assurance);
            if (!pairs.empty()) last.push_back(pairs[k].mode);
        }
    }
    if (last.empty())
        throw std::runtime_error("calcCampbellDiagram(): there are no modes at any of the " +
                                 std::to_string(speeds.size()) + " speeds; at the first, " +
                                 diagram.failures.front());
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
        for (const CampbellDiagram::Branch& branch : diagram.branches) {
            if (diagram.failures[i].empty())
                file << "," << branch.frequency[i] << "," << branch.dampingRatio[i];
            else
                file << ",,";
        }
        file << "\n";
    }
    if (!file.flush()) throw std::runtime_error("cannot write the Campbell diagram to " + csvFile);
}

}  // namespace simflex
