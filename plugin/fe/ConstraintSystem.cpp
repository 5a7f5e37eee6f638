#include "ConstraintSystem.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>

#include "simflex/base/DenseAlgebra.h"

namespace simflex {
namespace {

/** Largest rigid-motion residual of an equation, relative to its largest coefficient, … **/
constexpr double Exact = 1e-12;   // … to count as exact,
constexpr double Rounded = 2e-4;  // … to count as rounded to four digits.
/** Smaller coefficients, relative to the equation's largest, are cancellation errors. **/
constexpr double CancelledPart = 1e-11;
/** The first variable is eliminated unless its coefficient is smaller than this relative to the
largest. **/
constexpr double Weak = 1e-3;

using Term = ConstraintSystem::Term;

/** Sorts by variable and adds duplicates. **/
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
    : m_positions(std::move(positions)), m_ruleOf(m_positions.size(), -1) {
    for (size_t a = 0; a < 3; ++a) {
        double low = 0, high = 0;
        for (size_t i = a; i < m_positions.size(); i += 3) {
            low = i == a ? m_positions[i] : std::min(low, m_positions[i]);
            high = i == a ? m_positions[i] : std::max(high, m_positions[i]);
        }
        m_origin[a] = 0.5 * (low + high);
        m_size = std::max(m_size, high - low);
    }
}

int ConstraintSystem::addCoordinate(const std::array<double, 6>& rigid) {
    m_rigid.push_back(rigid);
    m_ruleOf.push_back(-1);
    return int(m_ruleOf.size()) - 1;
}

/** Values under the six rigid motions; rotations are scaled by 1/size. **/
std::array<double, 6> ConstraintSystem::rigidOf(int variable) const {
    std::array<double, 6> r{};
    if (size_t(variable) >= m_positions.size()) {
        r = m_rigid[size_t(variable) - m_positions.size()];
        for (size_t j = 3; j < 6; ++j) r[j] /= m_size;
        return r;
    }
    const size_t node = size_t(variable) / 3, a = size_t(variable) % 3;
    std::array<double, 3> s;
    for (size_t b = 0; b < 3; ++b) s[b] = (m_positions[3 * node + b] - m_origin[b]) / m_size;
    r[a] = 1;
    // u = θ × s
    r[3 + (a + 1) % 3] = s[(a + 2) % 3];
    r[3 + (a + 2) % 3] = -s[(a + 1) % 3];
    return r;
}

/** Returns whether the coefficients were changed. **/
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
    if (miss <= Exact) return false;
    if (miss <= Rounded) {
        const Eigen::VectorXd change = solveLeastSquares(R.transpose(), residual, 1e-9);
        const double left = (residual - R.transpose() * change).cwiseAbs().maxCoeff() / largest;
        if (left <= Exact) {
            for (Eigen::Index k = 0; k < count; ++k) terms[size_t(k)].second -= change[k];
            return true;
        }
    }
    std::ostringstream text;
    text << where << " holds the part to the ground: rigid "
         << (worst < 3 ? "translation along " : "rotation about ") << "xyz"[worst % 3]
         << " violates it by " << miss << " of its largest coefficient"
         << (miss <= Rounded
                 ? ", and no other coefficients would do. Let nodes that are to coincide "
                   "do so to the last digit, or use *TIE."
                 : ". Write it so that a motion of the whole part satisfies it, or take "
                   "it out and hold the part in the multibody model.");
    throw std::invalid_argument(text.str());
}

/** Substitutes dependent variables until none is left. **/
void ConstraintSystem::substitute(std::vector<Term>& terms) const {
    for (bool changed = true; changed;) {
        changed = false;
        std::vector<Term> next;
        next.reserve(terms.size());
        for (const Term& term : terms) {
            const int rule = m_ruleOf[size_t(term.first)];
            if (rule < 0) {
                next.push_back(term);
                continue;
            }
            changed = true;
            for (const Term& other : m_rules[size_t(rule)].terms)
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
                       [&](const Term& t) { return std::abs(t.second) <= CancelledPart * given; }),
        terms.end());
    if (terms.empty()) return Outcome::Redundant;
    const double largest = largestOf(terms);
    auto pivot = std::find_if(terms.begin(), terms.end(), [&](const Term& t) {
        return t.first == first && std::abs(t.second) >= Weak * largest;
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
    m_ruleOf[size_t(rule.variable)] = int(m_rules.size());
    m_rules.push_back(std::move(rule));
    return corrected ? Outcome::Corrected : Outcome::Solved;
}

NodalConstraints ConstraintSystem::solve() const {
    // A rule contains no variables of earlier rules, so resolve from the last to the first.
    std::vector<std::vector<Term>> resolved(m_rules.size());
    for (size_t k = m_rules.size(); k-- > 0;) {
        std::vector<Term>& terms = resolved[k];
        for (const Term& term : m_rules[k].terms) {
            const int rule = m_ruleOf[size_t(term.first)];
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
    const size_t numDofs = m_positions.size();
    std::vector<char> isUsed(m_ruleOf.size(), 0);
    for (size_t i = 0; i < numDofs; ++i) isUsed[i] = m_ruleOf[i] < 0;
    for (size_t k = 0; k < m_rules.size(); ++k)
        if (size_t(m_rules[k].variable) < numDofs)
            for (const Term& term : resolved[k]) isUsed[size_t(term.first)] = 1;

    NodalConstraints T;
    std::vector<int> columnOf(m_ruleOf.size(), -1);
    for (size_t i = 0; i < m_ruleOf.size(); ++i)
        if (isUsed[i]) columnOf[i] = T.numCoordinates++;
    T.rowStarts.push_back(0);
    for (size_t i = 0; i < numDofs; ++i) {
        if (m_ruleOf[i] < 0) {
            T.columns.push_back(columnOf[i]);
            T.coefficients.push_back(1);
        } else {
            for (const Term& term : resolved[size_t(m_ruleOf[i])]) {
                T.columns.push_back(columnOf[size_t(term.first)]);
                T.coefficients.push_back(term.second);
            }
        }
        T.rowStarts.push_back(std::int64_t(T.columns.size()));
    }
    return T;
}

}  // namespace simflex
