#include "simflex/solver/CampbellDiagram.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iomanip>

#include "simflex/base/FlushDenormals.h"

namespace simflex {

using namespace SimTK;

namespace {

constexpr Real SameRate = 1e-6;  // relative difference of the rates of e^λt and e^−λt

/** A mode of a branch, or its conjugate: in co-rotating axes, a whirl continues as the conjugate
when the speed passes its frequency. **/
struct BranchMode {
    Eigenmode mode;
    bool isConjugate = false;
    Real assurance = 1;
    Real slope = 0;  ///< of its signed frequency over speed; 0: unknown

    /** Frequency with the sign of the whirl. **/
    Real getSigned() const { return isConjugate ? -mode.frequency : mode.frequency; }
    Complex getShape(int i) const { return isConjugate ? std::conj(mode.shape[i]) : mode.shape[i]; }
};

/** @pre shapes have modal mass 1 **/
Real calcModalAssurance(const BranchMode& before, const Eigenmode& now, bool isConjugate) {
    Complex product = 0;
    for (int i = 0; i < now.momentum.size(); ++i)
        product += std::conj(before.getShape(i)) *
                   (isConjugate ? std::conj(now.momentum[i]) : now.momentum[i]);
    return std::min(Real(1), std::norm(product));
}

/** Number of slowest modes among which continuations are sought. **/
size_t countConsidered(size_t numModes) {
    return 3 * numModes + 4;
}

/** Returns the modes that continue those of the previous speed, `step` before: pairs of highest
assurance first, among equal ones (to 0.01) those closest to the extrapolated frequency.
@throws std::runtime_error if there are fewer than `numModes` modes **/
std::vector<BranchMode> follow(std::vector<Eigenmode> modes, const std::vector<BranchMode>& last,
                               Real step, size_t numModes) {
    modes.erase(std::remove_if(modes.begin(), modes.end(),
                               [](const Eigenmode& mode) { return mode.isRigidMotion(); }),
                modes.end());
    if (modes.size() < numModes)
        throw std::runtime_error(std::to_string(numModes) + " modes are asked for, there are " +
                                 std::to_string(modes.size()));
    std::vector<BranchMode> branches;
    if (last.empty()) {
        for (size_t k = 0; k < numModes; ++k) branches.push_back({modes[k]});
        return branches;
    }
    struct Candidate {
        Real assurance, distance;
        size_t branch, mode;
        bool isConjugate;
    };
    std::vector<Candidate> candidates;
    const size_t considered = std::min(modes.size(), countConsidered(numModes));
    for (size_t k = 0; k < numModes; ++k)
        for (size_t i = 0; i < considered; ++i)
            for (const bool isConjugate : {false, true}) {
                if (isConjugate && !modes[i].isSeenTurning) continue;
                const BranchMode now{modes[i], isConjugate};
                candidates.push_back(
                    {calcModalAssurance(last[k], modes[i], isConjugate),
                     std::abs(now.getSigned() - last[k].getSigned() - step * last[k].slope), k, i,
                     isConjugate});
            }
    std::stable_sort(candidates.begin(), candidates.end(),
                     [](const Candidate& a, const Candidate& b) {
                         const long first = std::lround(100 * a.assurance),
                                    second = std::lround(100 * b.assurance);
                         if (first != second) return first > second;
                         return a.distance < b.distance;
                     });
    std::vector<char> hasMode(numModes, 0), isTaken(considered, 0);
    branches.resize(numModes);
    for (const Candidate& candidate : candidates) {
        if (hasMode[candidate.branch] || isTaken[candidate.mode]) continue;
        hasMode[candidate.branch] = isTaken[candidate.mode] = 1;
        BranchMode& branch = branches[candidate.branch];
        branch = {modes[candidate.mode], candidate.isConjugate, candidate.assurance};
        branch.slope =
            step != 0 ? (branch.getSigned() - last[candidate.branch].getSigned()) / step : 0;
    }
    // Of a decaying and a growing motion of the same rate, the growing one decides stability.
    for (BranchMode& branch : branches) {
        if (branch.mode.oscillates() || branch.mode.dampingRatio < 0) continue;
        for (size_t i = 0; i < considered; ++i)
            if (!isTaken[i] && !modes[i].oscillates() && modes[i].dampingRatio < 0 &&
                std::abs(modes[i].frequency - branch.mode.frequency) <=
                    SameRate * branch.mode.frequency) {
                branch.mode = modes[i];
                isTaken[i] = 1;
                break;
            }
    }
    return branches;
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
    std::vector<BranchMode> last;
    Real lastSpeed = 0;
    for (const Real speed : speeds) {
        std::vector<BranchMode> now;
        diagram.failures.emplace_back();
        try {
            now = follow(calcModes(speed, int(countConsidered(size_t(numModes)))), last,
                         speed - lastSpeed, size_t(numModes));
        } catch (const std::exception& error) {
            diagram.failures.back() = error.what();
        }
        if (!now.empty()) {
            last = now;
            lastSpeed = speed;
        }
        for (size_t k = 0; k < diagram.branches.size(); ++k) {
            CampbellDiagram::Branch& branch = diagram.branches[k];
            branch.frequency.push_back(now.empty() ? NaN : now[k].mode.frequency);
            branch.dampingRatio.push_back(now.empty() ? NaN : now[k].mode.dampingRatio);
            branch.modalAssurance.push_back(now.empty() ? NaN : now[k].assurance);
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
