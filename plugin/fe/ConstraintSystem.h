#pragma once
/** @file
Homogeneous linear equations among nodal translations and further coordinates (those of knots),
solved for u = T q. Internal to fe.

Equations are eliminated one after the other, each for one *dependent* variable. Every equation must
be satisfied by the six rigid motions, R_e = 0; an equation that is so only to the digits it was
written with is corrected by the least change of its coefficients. **/

#include <array>
#include <string>
#include <utility>
#include <vector>

#include "simflex/fe/FeModel.h"

namespace simflex {

class ConstraintSystem {
public:
    /** A variable and its coefficient. Variables: 3·node + axis, then added coordinates. **/
    using Term = std::pair<int, double>;
    /** What became of an equation. **/
    enum class Outcome { Solved, Corrected, Redundant };

    /** Of the nodes at these places, 3×numNodes. **/
    explicit ConstraintSystem(std::vector<double> positions);

    /** A coordinate that is no nodal translation, with its values under rigid translation along and
    rotation about x, y, z (about the point `origin()`).
    @returns its variable. **/
    int addCoordinate(const std::array<double, 6>& rigid);

    const std::array<double, 3>& origin() const { return m_origin; }

    /** True if an equation was solved for the variable. **/
    bool isDependent(int variable) const { return m_ruleOf[size_t(variable)] >= 0; }

    /** Adds Σ terms = 0 and solves it for the variable of its first term if that is still free,
    else for the one with the largest coefficient. Redundant: earlier equations say it already.
    @param where  "FILE:LINE: *EQUATION", what messages begin with.
    @throws std::invalid_argument if a rigid motion violates it. **/
    Outcome add(std::vector<Term> terms, const std::string& where);

    bool empty() const { return m_rules.empty(); }

    /** T, with the coordinates in the order of their variables. O(entries). **/
    NodalConstraints solve() const;

private:
    /** A dependent variable in terms of others; those of later rules may be among them. **/
    struct Rule {
        int variable;
        std::vector<Term> terms;
    };

    std::array<double, 6> rigidOf(int variable) const;
    bool correct(std::vector<Term>& terms, const std::string& where) const;
    void substitute(std::vector<Term>& terms) const;

    std::vector<double> m_positions;
    std::array<double, 3> m_origin{};
    double m_size = 0;
    std::vector<std::array<double, 6>> m_rigid;  ///< of added coordinates
    std::vector<int> m_ruleOf;                   ///< of each variable, −1 where it is free
    std::vector<Rule> m_rules;
};

}  // namespace simflex
