#include "simflex/solver/equilibrium/CriticalMotions.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "simflex/base/DenseAlgebra.h"

namespace simflex {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr Eigen::Index BlockSize = 4;
constexpr int MostBlocks = 6;
constexpr size_t MostMotions = 8;
/** Residual of a converged motion, relative to θ; the relative error of θ is its square. **/
constexpr double Convergence = 1e-4;
/** Part of a vector left by orthogonalisation below which it counts as dependent. **/
constexpr double DependentPart = 1e-9;
/** Least |xᵀM x| of the same motion at two points; motions of equal κ may be mixed. **/
constexpr double LeastLikeness = 0.5;
/** Largest deviation of the change of κ from that by the mean end slope, relative to that by the
steeper one; factor by which κ may change more than by its slope; least value of its cubic, relative
to the smaller end value. **/
constexpr double LargestBend = 0.2, Margin = 1.5, LeastLeft = 0.05;
constexpr int NumLooks = 32, NumHalvings = 60;
/** Least distance of a parabola's third sample, relative to that between the other two. **/
constexpr double LeastAside = 0.5, Unbounded = std::numeric_limits<double>::infinity();

/** Hermite cubic on [0, 1]. **/
struct Cubic {
    double start, startSlope, end, endSlope;
    double operator()(double t) const {
        const double s = 1 - t;
        return s * s * ((1 + 2 * t) * start + t * startSlope) +
               t * t * ((1 + 2 * s) * end - s * endSlope);
    }
    bool isTrusted() const {
        return std::abs(end - start - 0.5 * (startSlope + endSlope)) <=
               LargestBend * std::max(std::abs(startSlope), std::abs(endSlope));
    }
};

bool reachesZero(double value, double slope) {
    return (slope < 0) == (value > 0) && std::abs(value) < Margin * std::abs(slope);
}

/** Bisects for a zero of f, which has different signs at both ends. **/
double halveToZero(const std::function<double(double)>& f, double start, double end) {
    const bool isPositive = f(end) > 0;
    for (int k = 0; k < NumHalvings; ++k) {
        const double middle = 0.5 * (start + end);
        ((f(middle) > 0) == isPositive ? end : start) = middle;
    }
    return 0.5 * (start + end);
}

}  // namespace

std::vector<CriticalMotion> calcCriticalMotions(const VectorXd& scale,
                                                const ApplyToSpeeds& multiplyMass,
                                                const ApplyToSpeeds& invert) {
    const Eigen::Index n = scale.size(), most = BlockSize * MostBlocks;
    MatrixXd V(n, most), MV(n, most), TV(n, most);
    Eigen::Index count = 0, begin = 0;
    const auto append = [&](VectorXd v) {
        if (count == most) return;
        double before = v.dot(multiplyMass(v));
        if (!(before > 0) || !std::isfinite(before)) return;
        before = std::sqrt(before);
        for (int pass = 0; pass < 2; ++pass)
            v -= V.leftCols(count) * (MV.leftCols(count).transpose() * v);
        VectorXd inert = multiplyMass(v);
        const double size = std::sqrt(std::max(0.0, v.dot(inert)));
        if (!(size > DependentPart * before)) return;
        V.col(count) = v / size;
        MV.col(count) = inert / size;
        TV.col(count) = invert(MV.col(count));
        ++count;
    };
    for (Eigen::Index j = 0; j < std::min(n, BlockSize); ++j) {
        VectorXd v(n);
        for (Eigen::Index i = 0; i < n; ++i)
            v[i] = scale[i] * std::cos(1.3 * double((i + 1) * (j + 1)) + double(j));
        append(invert(multiplyMass(v)));
    }
    while (begin < count && count < most) {
        const Eigen::Index end = count;
        for (; begin < end; ++begin) append(TV.col(begin));
    }
    if (count == 0) return {};
    MatrixXd H = MV.leftCols(count).transpose() * TV.leftCols(count);
    H = (0.5 * (H + H.transpose())).eval();
    const SymmetricEigen eigen = calcSymmetricEigen(H, MatrixXd::Identity(count, count));
    std::vector<CriticalMotion> motions;
    for (Eigen::Index k = 0; k < count; ++k) {
        const double theta = eigen.values[k];
        CriticalMotion motion{1 / theta, 0, V.leftCols(count) * eigen.vectors.col(k),
                              MV.leftCols(count) * eigen.vectors.col(k)};
        const VectorXd left = TV.leftCols(count) * eigen.vectors.col(k) - theta * motion.x;
        if (std::sqrt(std::abs(left.dot(multiplyMass(left)))) <= Convergence * std::abs(theta))
            motions.push_back(std::move(motion));
    }
    std::sort(motions.begin(), motions.end(), [](const CriticalMotion& a, const CriticalMotion& b) {
        return std::abs(a.stiffness) < std::abs(b.stiffness);
    });
    if (motions.size() > MostMotions) motions.resize(MostMotions);
    return motions;
}

const CriticalMotion* findSameMotion(const CriticalMotion& motion,
                                     const std::vector<CriticalMotion>& among) {
    const CriticalMotion* same = nullptr;
    double most = LeastLikeness;
    for (const CriticalMotion& other : among) {
        const double likeness = std::abs(motion.x.dot(other.inert));
        if (likeness > most) most = likeness, same = &other;
    }
    return same;
}

std::optional<std::vector<StabilityChange>> findStabilityChanges(
    const std::vector<CriticalMotion>& start, const std::vector<CriticalMotion>& end, double width,
    int change) {
    std::vector<StabilityChange> changes;
    // Pairs the most similar motions first, each only once, since mixed ones resemble several.
    struct Pair {
        double likeness;
        size_t i, j;
    };
    std::vector<Pair> pairs;
    for (size_t i = 0; i < start.size(); ++i)
        for (size_t j = 0; j < end.size(); ++j) {
            const double likeness = std::abs(start[i].x.dot(end[j].inert));
            if (likeness > LeastLikeness) pairs.push_back({likeness, i, j});
        }
    std::sort(pairs.begin(), pairs.end(),
              [](const Pair& a, const Pair& b) { return a.likeness > b.likeness; });
    std::vector<char> hasEnd(start.size()), hasStart(end.size());
    for (const Pair& pair : pairs) {
        if (hasEnd[pair.i] || hasStart[pair.j]) continue;
        hasEnd[pair.i] = hasStart[pair.j] = true;
        const CriticalMotion &a = start[pair.i], &b = end[pair.j];
        const Cubic cubic{a.stiffness, a.slope * width, b.stiffness, b.slope * width};
        if ((a.stiffness > 0) != (b.stiffness > 0)) {
            if (!cubic.isTrusted()) return std::nullopt;
            changes.push_back({a, b, width * halveToZero(cubic, 0, 1)});
            change -= changes.back().getSign();
        } else if (reachesZero(cubic.start, cubic.startSlope) ||
                   reachesZero(cubic.end, -cubic.endSlope)) {
            // κ must not pass zero and return between the ends.
            if (!cubic.isTrusted()) return std::nullopt;
            const double sign = a.stiffness > 0 ? 1 : -1,
                         least = LeastLeft * std::min(std::abs(a.stiffness), std::abs(b.stiffness));
            for (int k = 1; k < NumLooks; ++k)
                if (sign * cubic(double(k) / NumLooks) < least) return std::nullopt;
        }
    }
    for (size_t i = 0; i < start.size(); ++i)
        if (!hasEnd[i] && reachesZero(start[i].stiffness, start[i].slope * width))
            return std::nullopt;
    for (size_t j = 0; j < end.size(); ++j)
        if (!hasStart[j] && reachesZero(end[j].stiffness, -end[j].slope * width))
            return std::nullopt;
    if (change != 0) return std::nullopt;
    return changes;
}

double interpolateZero(const std::vector<std::pair<double, double>>& sorted, size_t& first,
                       std::vector<double>& weights) {
    first = 0;
    while ((sorted[first].second > 0) == (sorted[first + 1].second > 0)) ++first;
    const double start = sorted[first].first, end = sorted[first + 1].first;
    std::vector<size_t> nodes{first, first + 1};
    // A third sample too close to the others would let round-off determine the parabola.
    double nearest = Unbounded;
    size_t third = first;
    for (size_t k = 0; k < sorted.size(); ++k) {
        if (k == first || k == first + 1) continue;
        const double distance = std::max(start - sorted[k].first, sorted[k].first - end);
        if (distance < LeastAside * (end - start) || distance >= nearest) continue;
        nearest = distance;
        third = k;
    }
    if (third != first) nodes.push_back(third);
    const auto calcWeight = [&](size_t of, double at) {
        double weight = 1;
        for (const size_t node : nodes)
            if (node != of)
                weight *= (at - sorted[node].first) / (sorted[of].first - sorted[node].first);
        return weight;
    };
    const double zero = halveToZero(
        [&](double at) {
            double value = 0;
            for (const size_t node : nodes) value += calcWeight(node, at) * sorted[node].second;
            return value;
        },
        start, end);
    weights.assign(sorted.size(), 0);
    for (const size_t node : nodes) weights[node] = calcWeight(node, zero);
    return zero;
}

}  // namespace simflex
