#pragma once
/** @file
Homogeneous linear equations among nodal translations and additional coordinates (those of knots),
solved for u = T q. Internal to fe.

Equations are eliminated one after another, each for one *dependent* variable. Every equation must
be satisfied by the six rigid motions, R_e = 0; one that satisfies this only to the digits given is
corrected by the smallest change of its coefficients. **/

#include <array>
#include <string>
#include <utility>
#include <vector>

#include "simflex/fe/FeModel.h"

namespace simflex {

class ConstraintSystem {
public:
    /** A variable and its coefficient. Variables: 3·node + axis, then additional coordinates. **/
    using Term = std::pair<int, double>;
    /** Result of adding an equation. **/
    enum class Outcome { Solved, Corrected, Redundant };

    /** @param positions  of the nodes, 3×numNodes **/
    explicit ConstraintSystem(std::vector<double> positions);

    /** Adds a coordinate that is no nodal translation, given its values under rigid translation
    along and rotation about x, y, z (about the point `origin()`).
    @returns its variable. **/
    int addCoordinate(const std::array<double, 6>& rigid);

    const std::array<double, 3>& origin() const { return m_origin; }

    /** Returns whether an equation was solved for the variable. **/
    bool isDependent(int variable) const { return m_ruleOf[size_t(variable)] >= 0; }

    /** Adds Σ terms = 0 and solves it for the variable of its first term if that is still free,
    else for the one with the largest coefficient. Redundant: implied by earlier equations.
    @param where  beginning of messages: "FILE:LINE: *EQUATION"
    @throws std::invalid_argument if a rigid motion violates it. **/
    Outcome add(std::vector<Term> terms, const std::string& where);

    bool empty() const { return m_rules.empty(); }

    /** Returns T, with the coordinates in the order of their variables. O(entries). **/
    NodalConstraints solve() const;

private:
    /** Expresses a dependent variable by others, which may depend on later rules. **/
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
    std::vector<std::array<double, 6>> m_rigid;  ///< rigid motion values of added coordinates
    std::vector<int> m_ruleOf;                   ///< rule of each variable, −1: free
    std::vector<Rule> m_rules;
};

}  // namespace simflex
