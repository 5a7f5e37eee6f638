#include "simflex/solver/equilibrium/Differences.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "simflex/solver/equations/CoordinateScales.h"

namespace simflex {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

/** Ratio of successive steps, number of levels, and the level at which all columns are tested for
smoothness. **/
constexpr double StepRefinement = 1.0 / 16;
constexpr int NumLevels = 7, ProbedLevel = 4;
/** Relative to a function's change over a step: largest higher differences, and difference of
slopes at two steps, of a smooth function. **/
constexpr double SmoothShare = 1e-6;
/** Round-off relative to a function's terms; largest round-off of a usable slope, relative to the
steepest. **/
constexpr double RoundOffShare = 4 * std::numeric_limits<double>::epsilon(), KnownSlope = 0.01;
/** Relative change below which a value is constant. **/
constexpr double SameValue = 64 * std::numeric_limits<double>::epsilon();
/** A kink is a change of slope by more than SeenKink, relative to the steepest, that is the same at
three levels within the factor AlikeKink. At a jump the change of value at the last level is at
least AlikeJump of that at the second. **/
constexpr double SeenKink = 1e-3, AlikeKink = 3, AlikeJump = 0.1;
/** Least jump, relative to the change of the value over a step of any column, and to the largest of
all values and changes: stiff springs may act across a coordinate. **/
constexpr double LeastJump = 1e-5, AnyNoise = 1e-9;

/** Samples and slopes of one column. **/
class ColumnSearch {
public:
    /** Values at −2h, −h, h, 2h. **/
    using Samples = std::array<VectorXd, 4>;

    ColumnSearch(const DifferenceColumn& column, double firstStep, VectorXd middle)
        : m_column(&column), m_firstStep(firstStep), m_middle(std::move(middle)) {}

    const DifferenceColumn& getColumn() const { return *m_column; }
    double calcStep(int level) const { return m_firstStep * std::pow(StepRefinement, level); }
    int getNumLevels() const { return int(m_levels.size()); }
    void addLevel(const Samples& samples);
    /** Change of each value over the first step. **/
    const VectorXd& getFirstRange() const { return m_levels[0].range; }
    /** @param largest  change of each value over the first steps of all columns
    @param mostChange  the largest of these
    @param ofAll  largest value or change
    @param terms  possible change of each value's terms over a first step
    @param originDistance  distance from Ground's origin, in sizes of a body **/
    void setNoise(const VectorXd& largest, double mostChange, double ofAll, const VectorXd& terms,
                  double originDistance) {
        m_noise = 8 * RoundOffShare *
                  (m_largest + std::max(1.0, originDistance) * largest.cwiseMax(terms) /
                                   CoordinateScales::StepFraction);
        // Terms that cancel may change as much as another value does. Without terms, values may be
        // of different kinds, such as stresses and displacements, and are not comparable.
        m_slopeNoise = 8 * RoundOffShare / m_firstStep * terms;
        if (!terms.isZero(0))
            m_slopeNoise = m_slopeNoise.cwiseMax(8 * RoundOffShare / m_firstStep * mostChange);
        m_leastJump = (LeastJump * largest).cwiseMax(AnyNoise * ofAll).cwiseMax(m_noise);
    }
    /** Whether the first step's slopes hold close to the middle.
    @param before, after  samples at ∓2h of level ProbedLevel **/
    bool isSmooth(const VectorXd& before, const VectorXd& after) const;
    /** Finds kinks, and the slopes of the longest steps that are smooth. **/
    void choose() {
        // At the two finest levels roughness is round-off, or a kink at the middle.
        for (size_t k = m_levels.size() - 2; k < m_levels.size(); ++k)
            for (Index i = 0; i < m_middle.size(); ++i)
                if (isFinite(i, m_levels[k]))
                    m_noise[i] = std::max(m_noise[i], m_levels[k].roughness[i] * m_levels[k].h);
        for (Index i = 0; i < m_middle.size(); ++i) {
            if (!changes(i)) continue;
            choose(i);
            if (!std::isfinite(m_slopes[i]))  // no value on one side
                m_kinks.push_back({int(i), m_slopes[i], m_slopes[i], true});
        }
    }
    void tell() {
        for (Index i = 0; i < m_middle.size(); ++i)
            if (!changes(i)) m_slopes[i] = 0;
        m_column->take(m_slopes, m_kinks);
    }

private:
    struct Level {
        double h;
        VectorXd slope;
        VectorXd range;          ///< largest change from the middle
        VectorXd roughness;      ///< of the slope, by higher differences
        VectorXd before, after;  ///< slopes on both sides; not of the first level

        double calcSteepness(Index i) const { return range[i] / h; }
    };

    /** NaN counts as a change. **/
    bool changes(Index i) const { return !(m_levels[0].range[i] <= SameValue * m_largest[i]); }
    bool isFinite(Index i, const Level& level) const {
        return std::isfinite(level.slope[i] + level.roughness[i]);
    }
    bool isSmooth(Index i, const Level& level) const {
        return level.roughness[i] <=
               SmoothShare * level.calcSteepness(i) + calcSlopeNoise(i, level.h);
    }
    /** Round-off of slopes at step h. **/
    double calcSlopeNoise(Index i, double h) const { return m_noise[i] / h + m_slopeNoise[i]; }
    /** Whether slopes exceed round-off at this level. **/
    bool isKnown(Index i, const Level& level) const {
        double steepest = 0;
        for (const Level& one : m_levels)
            if (isFinite(i, one)) steepest = std::max(steepest, one.calcSteepness(i));
        return isFinite(i, level) && m_noise[i] / level.h <= KnownSlope * steepest;
    }
    /** The finest such level; −1: none. **/
    int findFinest(Index i) const {
        int finest = int(m_levels.size()) - 1;
        while (finest >= 0 && !isKnown(i, m_levels[size_t(finest)])) --finest;
        return finest;
    }
    void choose(Index i);

    const DifferenceColumn* m_column;
    double m_firstStep;
    VectorXd m_middle, m_largest, m_noise, m_slopeNoise, m_leastJump, m_slopes;
    std::vector<Level> m_levels;
    std::vector<Kink> m_kinks;
};

void ColumnSearch::addLevel(const Samples& samples) {
    const auto& [farBefore, before, after, farAfter] = samples;
    Level level;
    level.h = calcStep(getNumLevels());
    level.slope = level.range = VectorXd::Zero(m_middle.size());
    VectorXd largest = m_middle.cwiseAbs();
    for (size_t k = 0; k < samples.size(); ++k) {
        level.slope += DifferenceWeights[k] / level.h * samples[k];
        for (Index i = 0; i < m_middle.size(); ++i) {
            const double change = std::abs(samples[k][i] - m_middle[i]);
            if (!(change <= level.range[i])) level.range[i] = change;
            largest[i] = std::max(largest[i], std::abs(samples[k][i]));
        }
    }
    const VectorXd third = farAfter - farBefore - 2 * (after - before),
                   fourth = farAfter + farBefore - 4 * (after + before) + 6 * m_middle;
    level.roughness.resize(m_middle.size());
    for (Index i = 0; i < m_middle.size(); ++i)
        level.roughness[i] = std::isfinite(third[i] + fourth[i])
                                 ? std::max(std::abs(third[i]), std::abs(fourth[i])) / level.h
                                 : std::numeric_limits<double>::quiet_NaN();
    if (m_levels.empty()) {
        m_largest = largest;
        m_slopes = level.slope;
    } else {
        level.before = (m_middle - before) / level.h;
        level.after = (after - m_middle) / level.h;
    }
    m_levels.push_back(std::move(level));
}

bool ColumnSearch::isSmooth(const VectorXd& before, const VectorXd& after) const {
    const Level& first = m_levels[0];
    const double h = 2 * calcStep(ProbedLevel);
    for (Index i = 0; i < m_middle.size(); ++i) {
        if (!changes(i)) continue;
        const double rise = (after[i] - before[i]) / (2 * h),
                     bend = (after[i] + before[i] - 2 * m_middle[i]) / h,
                     allowed = SmoothShare * first.calcSteepness(i) + calcSlopeNoise(i, h);
        if (!(std::abs(rise - first.slope[i]) <= allowed && std::abs(bend) <= allowed))
            return false;
    }
    return true;
}

void ColumnSearch::choose(Index i) {
    const auto at = [this](int level) -> const Level& { return m_levels[size_t(level)]; };
    const Level& last = m_levels.back();
    if (isFinite(i, last) && last.range[i] > AlikeJump * at(1).range[i] &&
        last.range[i] > m_leastJump[i]) {
        m_kinks.push_back({int(i), last.before[i], last.after[i], true});
        return;
    }
    const int finest = findFinest(i);
    if (finest < 0) return;
    const Level& sharp = at(finest);
    const auto agrees = [&](const Level& level) {
        return std::abs(level.slope[i] - sharp.slope[i]) <=
               SmoothShare * std::max(level.calcSteepness(i), sharp.calcSteepness(i)) +
                   calcSlopeNoise(i, sharp.h);
    };
    if (isSmooth(i, sharp)) {
        int level = 0;
        while (level < finest && !(isSmooth(i, at(level)) && agrees(at(level)))) ++level;
        m_slopes[i] = at(level).slope[i];
        return;
    }
    // At a kink slopes change equally at all levels; round-off does not.
    const bool isSeen = finest > 2 && sharp.roughness[i] > SeenKink * sharp.calcSteepness(i);
    const auto isAlike = [&](const Level& level) {
        return level.roughness[i] <= AlikeKink * sharp.roughness[i] &&
               sharp.roughness[i] <= AlikeKink * level.roughness[i];
    };
    if (isSeen && isAlike(at(finest - 1)) && isAlike(at(finest - 2))) {
        // The longest of these steps has the least round-off.
        const Level& level = at(finest - 2);
        m_slopes[i] = level.slope[i];
        m_kinks.push_back({int(i), level.before[i], level.after[i], false});
        return;
    }
    // The step at which two levels agree best.
    double least = std::numeric_limits<double>::infinity();
    for (int level = 0; level < finest; ++level) {
        const double change = std::abs(at(level).slope[i] - at(level + 1).slope[i]);
        if (!(change < least)) continue;
        least = change;
        m_slopes[i] = at(level).slope[i];
    }
}

VectorXd gather(const DifferenceColumn& column, const VectorXd& f) {
    Index size = 0;
    for (const auto& range : column.rows) size += range.second;
    VectorXd own(size);
    size = 0;
    for (const auto& [first, count] : column.rows) {
        own.segment(size, count) = f.segment(first, count);
        size += count;
    }
    return own;
}

}  // namespace

void differentiate(
    const std::function<void(const std::vector<double>& delta, VectorXd& f)>& evaluate,
    const std::vector<double>& steps, const VectorXd& middle,
    const std::vector<std::vector<DifferenceColumn>>& groups, const VectorXd& terms,
    double originDistance) {
    std::vector<double> delta(steps.size(), 0);
    VectorXd f(middle.size());
    using Group = std::vector<ColumnSearch*>;
    const auto sample = [&](const Group& group, int level, int place,
                            const std::function<void(size_t, VectorXd)>& take) {
        for (const ColumnSearch* one : group)
            delta[size_t(one->getColumn().speed)] = place * one->calcStep(level);
        evaluate(delta, f);
        for (size_t k = 0; k < group.size(); ++k) {
            delta[size_t(group[k]->getColumn().speed)] = 0;
            take(k, gather(group[k]->getColumn(), f));
        }
    };
    const auto addLevel = [&](const Group& group, int level) {
        std::vector<ColumnSearch::Samples> samples(group.size());
        for (size_t place = 0; place < 4; ++place)
            sample(group, level, DifferencePlaces[place],
                   [&](size_t k, VectorXd own) { samples[k][place] = std::move(own); });
        for (size_t k = 0; k < group.size(); ++k) group[k]->addLevel(samples[k]);
    };
    std::vector<std::vector<ColumnSearch>> all;
    VectorXd largest = VectorXd::Zero(middle.size());
    for (const std::vector<DifferenceColumn>& columns : groups) {
        all.emplace_back();
        for (const DifferenceColumn& column : columns)
            all.back().emplace_back(column, steps[size_t(column.speed)], gather(column, middle));
        Group group;
        for (ColumnSearch& one : all.back()) group.push_back(&one);
        addLevel(group, 0);
        for (const ColumnSearch* one : group) {
            Index own = 0;
            for (const auto& [first, count] : one->getColumn().rows) {
                for (Index i = 0; i < count; ++i) {
                    const double range = one->getFirstRange()[own + i];
                    if (std::isfinite(range))
                        largest[first + i] = std::max(largest[first + i], range);
                }
                own += count;
            }
        }
    }
    const double mostChange = largest.size() > 0 ? largest.maxCoeff() : 0;
    const VectorXd changing = terms.size() > 0 ? terms : VectorXd(VectorXd::Zero(middle.size()));
    double ofAll = 0;
    for (Index i = 0; i < middle.size(); ++i)
        if (std::isfinite(middle[i])) ofAll = std::max({ofAll, largest[i], std::abs(middle[i])});
    for (std::vector<ColumnSearch>& columns : all) {
        Group group;
        for (ColumnSearch& one : columns) {
            one.setNoise(gather(one.getColumn(), largest), mostChange, ofAll,
                         gather(one.getColumn(), changing), originDistance);
            group.push_back(&one);
        }
        std::vector<VectorXd> before(group.size()), after(group.size());
        sample(group, ProbedLevel, -2, [&](size_t k, VectorXd own) { before[k] = std::move(own); });
        sample(group, ProbedLevel, 2, [&](size_t k, VectorXd own) { after[k] = std::move(own); });
        Group rough;
        for (size_t k = 0; k < group.size(); ++k)
            if (!group[k]->isSmooth(before[k], after[k])) rough.push_back(group[k]);
        for (int level = 1; level < NumLevels && !rough.empty(); ++level) addLevel(rough, level);
        for (ColumnSearch* one : rough) one->choose();
        for (ColumnSearch* one : group) one->tell();
    }
}

}  // namespace simflex
