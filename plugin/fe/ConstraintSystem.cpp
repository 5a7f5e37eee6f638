#include "ConstraintSystem.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>

#include "simflex/base/DenseAlgebra.h"

namespace simflex {
namespace {

/** Of the largest coefficient: an equation may miss rigid motion by so much … **/
constexpr double kExact = 1e-12;   // … and count as exact,
constexpr double kRounded = 2e-4;  // … and count as rounded to four digits.
/** Coefficients below this share of the equation's largest are cancelled ones. **/
constexpr double kCancelled = 1e-11;
/** The first variable is eliminated unless its coefficient is this much below the largest. **/
constexpr double kWeak = 1e-3;

using Term = ConstraintSystem::Term;

/** Sorts by variable and adds up. **/
void collect(std::vector<Term>& terms) {
    std::sort(terms.begin(), terms.end(),
              [](const Term& a, const Term& b) { return a.first < b.first; });
    size_t count = 0;
    for (const Term& term : terms)
        if (count && terms[count - 1].first == term.first) {
            terms[count - 1].second += term.second;
        } else {
            terms[count++] = term;
        }
    terms.resize(count);
}

double largestOf(const std::vector<Term>& terms) {
    double largest = 0;
    for (const Term& term : terms) largest = std::max(largest, std::abs(term.second));
    return largest;
}

}  // namespace

ConstraintSystem::ConstraintSystem(std::vector<double> positions)
    : _positions(std::move(positions)), _ruleOf(_positions.size(), -1) {
    for (size_t a = 0; a < 3; ++a) {
        double low = 0, high = 0;
        for (size_t i = a; i < _positions.size(); i += 3) {
            low = i == a ? _positions[i] : std::min(low, _positions[i]);
            high = i == a ? _positions[i] : std::max(high, _positions[i]);
        }
        _origin[a] = 0.5 * (low + high);
        _size = std::max(_size, high - low);
    }
}

int ConstraintSystem::addCoordinate(const std::array<double, 6>& rigid) {
    _rigid.push_back(rigid);
    _ruleOf.push_back(-1);
    return int(_ruleOf.size()) - 1;
}

/** Values under the six rigid motions, rotations by 1/size. **/
std::array<double, 6> ConstraintSystem::rigidOf(int variable) const {
    std::array<double, 6> r{};
    if (size_t(variable) >= _positions.size()) {
        r = _rigid[size_t(variable) - _positions.size()];
        for (size_t j = 3; j < 6; ++j) r[j] /= _size;
        return r;
    }
    const size_t node = size_t(variable) / 3, a = size_t(variable) % 3;
    std::array<double, 3> s;
    for (size_t b = 0; b < 3; ++b) s[b] = (_positions[3 * node + b] - _origin[b]) / _size;
    r[a] = 1;
    // u = θ × s
    r[3 + (a + 1) % 3] = s[(a + 2) % 3];
    r[3 + (a + 2) % 3] = -s[(a + 1) % 3];
    return r;
}

/** True if the coefficients were changed. **/
bool ConstraintSystem::correct(std::vector<Term>& terms, const std::string& where) const {
    const double largest = largestOf(terms);
    const Eigen::Index count = Eigen::Index(terms.size());
    Eigen::MatrixXd R(count, 6);
    Eigen::VectorXd c(count);
    for (Eigen::Index k = 0; k < count; ++k) {
        const auto rigid = rigidOf(terms[size_t(k)].first);
        c[k] = terms[size_t(k)].second;
        for (Eigen::Index j = 0; j < 6; ++j) R(k, j) = rigid[size_t(j)];
    }
    const Eigen::VectorXd residual = R.transpose() * c;
    Eigen::Index worst = 0;
    const double miss = residual.cwiseAbs().maxCoeff(&worst) / largest;
    if (miss <= kExact) return false;
    if (miss <= kRounded) {
        const Eigen::VectorXd change = solveLeastSquares(R.transpose(), residual, 1e-9);
        const double left = (residual - R.transpose() * change).cwiseAbs().maxCoeff() / largest;
        if (left <= kExact) {
            for (Eigen::Index k = 0; k < count; ++k) terms[size_t(k)].second -= change[k];
            return true;
        }
    }
    std::ostringstream text;
    text << where << " holds the part to the ground: rigid "
         << (worst < 3 ? "translation along " : "rotation about ") << "xyz"[worst % 3]
         << " violates it by " << miss << " of its largest coefficient"
         << (miss <= kRounded
                 ? ", and no other coefficients would do. Let nodes that are to coincide "
                   "do so to the last digit, or use *TIE."
                 : ". Write it so that a motion of the whole part satisfies it, or take "
                   "it out and hold the part in the multibody model.");
    throw std::invalid_argument(text.str());
}

/** Replaces dependent variables until none is left. **/
void ConstraintSystem::substitute(std::vector<Term>& terms) const {
    for (bool changed = true; changed;) {
        changed = false;
        std::vector<Term> next;
        next.reserve(terms.size());
        for (const Term& term : terms) {
            const int rule = _ruleOf[size_t(term.first)];
            if (rule < 0) {
                next.push_back(term);
                continue;
            }
            changed = true;
            for (const Term& other : _rules[size_t(rule)].terms)
                next.emplace_back(other.first, term.second * other.second);
        }
        terms.swap(next);
    }
    collect(terms);
}

ConstraintSystem::Outcome ConstraintSystem::add(std::vector<Term> terms, const std::string& where) {
    if (terms.empty()) throw std::invalid_argument(where + " has no terms");
    const int first = terms.front().first;
    collect(terms);
    const double given = largestOf(terms);
    if (given == 0) throw std::invalid_argument(where + " has no coefficient other than 0");
    const bool corrected = correct(terms, where);
    substitute(terms);
    terms.erase(
        std::remove_if(terms.begin(), terms.end(),
                       [&](const Term& t) { return std::abs(t.second) <= kCancelled * given; }),
        terms.end());
    if (terms.empty()) return Outcome::Redundant;
    const double largest = largestOf(terms);
    auto pivot = std::find_if(terms.begin(), terms.end(), [&](const Term& t) {
        return t.first == first && std::abs(t.second) >= kWeak * largest;
    });
    if (pivot == terms.end())
        pivot = std::max_element(terms.begin(), terms.end(), [](const Term& a, const Term& b) {
            return std::abs(a.second) < std::abs(b.second);
        });
    Rule rule;
    rule.variable = pivot->first;
    for (const Term& term : terms)
        if (term.first != pivot->first)
            rule.terms.emplace_back(term.first, -term.second / pivot->second);
    _ruleOf[size_t(rule.variable)] = int(_rules.size());
    _rules.push_back(std::move(rule));
    return corrected ? Outcome::Corrected : Outcome::Solved;
}

NodalConstraints ConstraintSystem::solve() const {
    // A rule holds no variables of earlier rules: resolve from the last to the first.
    std::vector<std::vector<Term>> resolved(_rules.size());
    for (size_t k = _rules.size(); k-- > 0;) {
        std::vector<Term>& terms = resolved[k];
        for (const Term& term : _rules[k].terms) {
            const int rule = _ruleOf[size_t(term.first)];
            if (rule < 0) {
                terms.push_back(term);
                continue;
            }
            for (const Term& other : resolved[size_t(rule)])
                terms.emplace_back(other.first, term.second * other.second);
        }
        collect(terms);
        const double largest = largestOf(terms);
        terms.erase(
            std::remove_if(terms.begin(), terms.end(),
                           [&](const Term& t) { return std::abs(t.second) <= 1e-15 * largest; }),
            terms.end());
    }
    const size_t numDofs = _positions.size();
    std::vector<char> isUsed(_ruleOf.size(), 0);
    for (size_t i = 0; i < numDofs; ++i) isUsed[i] = _ruleOf[i] < 0;
    for (size_t k = 0; k < _rules.size(); ++k)
        if (size_t(_rules[k].variable) < numDofs)
            for (const Term& term : resolved[k]) isUsed[size_t(term.first)] = 1;

    NodalConstraints T;
    std::vector<int> columnOf(_ruleOf.size(), -1);
    for (size_t i = 0; i < _ruleOf.size(); ++i)
        if (isUsed[i]) columnOf[i] = T.numCoordinates++;
    T.rowStarts.push_back(0);
    for (size_t i = 0; i < numDofs; ++i) {
        if (_ruleOf[i] < 0) {
            T.columns.push_back(columnOf[i]);
            T.coefficients.push_back(1);
        } else {
            for (const Term& term : resolved[size_t(_ruleOf[i])]) {
                T.columns.push_back(columnOf[size_t(term.first)]);
                T.coefficients.push_back(term.second);
            }
        }
        T.rowStarts.push_back(std::int64_t(T.columns.size()));
    }
    return T;
}

}  // namespace simflex
