#include "DeckConstraints.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <sstream>
#include <stdexcept>

#include "simflex/base/DenseAlgebra.h"
#include "simflex/fe/ConstraintSystem.h"
#include "simflex/fe/SurfaceTies.h"

namespace simflex {
namespace {

using Term = ConstraintSystem::Term;
using Outcome = ConstraintSystem::Outcome;

constexpr double TinyCoefficient = 1e-14;
/** Rigid-body motions whose (squared) effect on the nodes is below this share are dropped. **/
constexpr double NoMotion = 1e-12;

/** A slave node and its position on a face of the master. **/
struct TiedNode {
    int slave;
    const std::vector<int>* face;
    double xi, eta;
};

class Tier {
public:
    Tier(const DeckConstraints& constraints, const std::vector<char>& hasElement, Mesh& mesh,
         std::vector<std::string>& notes, std::vector<std::string>& warnings)
        : m_constraints(constraints),
          m_hasElement(hasElement),
          m_mesh(mesh),
          m_notes(notes),
          m_warnings(warnings) {}

    NodalConstraints apply() {
        std::vector<std::vector<TiedNode>> tied;
        for (const DeckTie& tie : m_constraints.ties) tied.push_back(findPlaces(tie));
        placeBetweenNodes();
        ConstraintSystem system(m_mesh.positions);
        addKnots(system);
        addBetweens(system);
        makeBodyMotions(system);
        addBodies(system);
        addEquations(system);
        for (size_t k = 0; k < tied.size(); ++k) addTie(system, m_constraints.ties[k], tied[k]);
        return system.empty() ? NodalConstraints() : system.solve();
    }

private:
    void setPosition(int node, const Vec3d& x) {
        for (size_t a = 0; a < 3; ++a) m_mesh.positions[3 * size_t(node) + a] = x[a];
    }

    std::vector<Vec3d> positionsOf(const std::vector<int>& nodes) const {
        std::vector<Vec3d> x;
        for (const int node : nodes) x.push_back(m_mesh.position(node));
        return x;
    }

    std::string nameOf(int node) const {
        return "node " + std::to_string(m_mesh.nodeNumbers[size_t(node)]);
    }

    /** Finds the positions of the slave nodes and moves nodes to be adjusted. **/
    std::vector<TiedNode> findPlaces(const DeckTie& tie) {
        std::vector<TieFace> faces;
        for (const auto& nodes : tie.faces) faces.push_back({nodes, positionsOf(nodes)});
        const TieSurface surface(std::move(faces));
        const double tolerance = tie.tolerance > 0 ? tie.tolerance : surface.calcDefaultTolerance();
        std::vector<TiedNode> tied;
        size_t numFar = 0;
        double largestMove = 0;
        std::string farthest;
        for (const int slave : tie.slaves) {
            const Vec3d x = m_mesh.position(slave);
            const TiePlace place = surface.findPlace(x);
            if (place.face < 0 || place.normalGap > tolerance ||
                place.tangentGap > surface.calcDefaultTolerance()) {
                if (numFar++ == 0) {
                    std::ostringstream text;
                    text << nameOf(slave) << ", " << std::hypot(place.normalGap, place.tangentGap)
                         << " m away, allowed " << tolerance << " m";
                    farthest = text.str();
                }
                continue;
            }
            const auto& face = tie.faces[size_t(place.face)];
            if (std::find(face.begin(), face.end(), slave) != face.end()) continue;
            tied.push_back({slave, &face, place.xi, place.eta});
            if (!tie.adjust || !m_hasElement[size_t(slave)]) continue;
            largestMove = std::max(largestMove, std::hypot(place.normalGap, place.tangentGap));
            setPosition(slave, place.position);
        }
        if (tied.empty())
            throw std::invalid_argument(tie.where + " ties no node: " +
                                        (farthest.empty() ? "its slave nodes are the master's own"
                                                          : "the first is " + farthest +
                                                                "; give a POSITION TOLERANCE or "
                                                                "move the surfaces together"));
        std::ostringstream text;
        text << tie.where << " ties " << tied.size() << (tied.size() == 1 ? " node" : " nodes");
        // Smaller moves are round-off of the search.
        if (largestMove > 1e-6 * surface.calcDefaultTolerance())
            text << ", moved onto the master by up to " << largestMove << " m";
        m_notes.push_back(text.str());
        if (numFar)
            m_warnings.push_back(tie.where + " leaves " + std::to_string(numFar) +
                                 (numFar == 1 ? " slave node" : " slave nodes") +
                                 " free, the first is " + farthest);
        return tied;
    }

    /** Moves nodes between expanded ones after ties have moved these. **/
    void placeBetweenNodes() {
        for (const auto& between : m_constraints.thin.betweens) {
            const int node = m_mesh.indexOf(between.node);
            if (m_hasElement[size_t(node)]) continue;
            Vec3d x{};
            for (const auto& [number, weight] : between.weights)
                x = sumOf(x, weight, m_mesh.position(m_mesh.indexOf(number)));
            setPosition(node, x);
        }
    }

    void addBetweens(ConstraintSystem& system) {
        for (const auto& between : m_constraints.thin.betweens) {
            const int node = m_mesh.indexOf(between.node);
            for (int a = 0; a < 3; ++a) {
                std::vector<Term> terms{{3 * node + a, -1.0}};
                for (const auto& [number, weight] : between.weights)
                    terms.emplace_back(3 * m_mesh.indexOf(number) + a, weight);
                system.add(terms,
                           m_mesh.nodeNumbers.empty() ? "" : "shell or beam " + nameOf(node));
            }
        }
    }

    /** Adds u = u_node + θ × r + stretch; θ and stretch are scaled by the knot's size to
    lengths. **/
    void addKnots(ConstraintSystem& system) {
        for (const auto& knot : m_constraints.thin.knots) {
            const int node = m_mesh.indexOf(knot.node);
            const Vec3d center = m_mesh.position(node);
            std::vector<int> turns, stretches;
            for (const Vec3d& axis : knot.turns) {
                std::array<double, 6> rigid{};
                for (size_t a = 0; a < 3; ++a) rigid[3 + a] = knot.size * axis[a];
                turns.push_back(system.addCoordinate(rigid));
            }
            for (size_t k = 0; k < knot.stretches.size(); ++k)
                stretches.push_back(system.addCoordinate({}));
            for (const int number : knot.members) {
                const int member = m_mesh.indexOf(number);
                const Vec3d arm = sumOf(m_mesh.position(member), -1, center);
                std::array<std::vector<Term>, 3> terms;
                for (int a = 0; a < 3; ++a)
                    terms[size_t(a)] = {{3 * member + a, -1.0}, {3 * node + a, 1.0}};
                const auto add = [&](int variable, const Vec3d& u) {
                    for (size_t a = 0; a < 3; ++a)
                        if (u[a] != 0) terms[a].emplace_back(variable, u[a] / knot.size);
                };
                for (size_t k = 0; k < turns.size(); ++k) add(turns[k], cross(knot.turns[k], arm));
                for (size_t k = 0; k < stretches.size(); ++k) {
                    const auto& A = knot.stretches[k];
                    Vec3d u{};
                    for (size_t i = 0; i < 3; ++i)
                        u[i] = A[3 * i] * arm[0] + A[3 * i + 1] * arm[1] + A[3 * i + 2] * arm[2];
                    add(stretches[k], u);
                }
                for (const auto& equation : terms) system.add(equation, "knot at " + nameOf(node));
            }
        }
        if (!m_constraints.thin.knots.empty())
            m_notes.push_back(
                std::to_string(m_constraints.thin.knots.size()) +
                " nodes of shells and beams are knots: the expanded nodes of each move "
                "as one body that can stretch");
    }

    /** Calls visit(node, direction, arm) for each direction in which a node follows a body. **/
    template <class Visit>
    void visitFollowers(const DeckRigidBody& body, const Visit& visit) const {
        for (size_t k = 0; k < body.nodes.size(); ++k) {
            const Vec3d arm = sumOf(m_mesh.position(body.nodes[k]), -1, body.place);
            if (body.directions.empty()) {
                for (const Vec3d& d : {Vec3d{1, 0, 0}, Vec3d{0, 1, 0}, Vec3d{0, 0, 1}})
                    visit(body.nodes[k], d, arm);
            } else {
                for (const Vec3d& d : body.directions[k]) visit(body.nodes[k], d, arm);
            }
        }
    }

    /** Adds the coordinates of the bodies' motions, for each group of bodies with common ones. **/
    void makeBodyMotions(ConstraintSystem& system) {
        const auto& bodies = m_constraints.bodies;
        std::vector<size_t> group(bodies.size());
        std::iota(group.begin(), group.end(), size_t(0));
        for (size_t k = 0; k < bodies.size(); ++k)
            for (size_t j = 0; j < k; ++j)
                if (bodies[j].reference == bodies[k].reference ||
                    bodies[j].rotation == bodies[k].rotation)
                    std::replace(group.begin(), group.end(), group[k], group[j]);
        for (size_t first = 0; first < bodies.size(); ++first) {
            if (group[first] != first) continue;
            std::vector<const DeckRigidBody*> members;
            for (size_t k = first; k < bodies.size(); ++k)
                if (group[k] == first) members.push_back(&bodies[k]);
            makeGroupMotions(system, members);
        }
    }

    /** The unknowns are c = (u_ref of references outside the mesh, θ·length). Combinations that
    move no node, such as rotations about a line through all nodes, are removed: c = B y. **/
    void makeGroupMotions(ConstraintSystem& system,
                          const std::vector<const DeckRigidBody*>& bodies) {
        std::map<int, Eigen::Index> shiftOf, turnOf;
        std::vector<std::array<double, 6>> rigid;
        double length = 0;
        for (const DeckRigidBody* body : bodies)
            for (const int node : body->nodes)
                length = std::max(length, normOf(sumOf(m_mesh.position(node), -1, body->place)));
        if (length == 0) length = 1;
        for (const DeckRigidBody* body : bodies) {
            if (!body->isReferenceInMesh &&
                shiftOf.emplace(body->reference, Eigen::Index(rigid.size())).second)
                for (size_t a = 0; a < 3; ++a) {
                    Vec3d e{};
                    e[a] = 1;
                    const Vec3d turned = cross(sumOf(body->place, -1, system.origin()), e);
                    rigid.push_back({e[0], e[1], e[2], turned[0], turned[1], turned[2]});
                }
            if (turnOf.emplace(body->rotation, Eigen::Index(rigid.size())).second)
                for (size_t a = 0; a < 3; ++a) {
                    rigid.emplace_back();
                    rigid.back()[3 + a] = length;
                }
        }
        const Eigen::Index count = Eigen::Index(rigid.size());
        Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(count, count);
        for (const DeckRigidBody* body : bodies) {
            const auto shift = shiftOf.find(body->reference);
            const Eigen::Index turn = turnOf.at(body->rotation);
            visitFollowers(*body, [&](int, const Vec3d& d, const Vec3d& arm) {
                Eigen::VectorXd row = Eigen::VectorXd::Zero(count);
                const Vec3d moment = cross(arm, d);
                for (size_t a = 0; a < 3; ++a) {
                    if (shift != shiftOf.end()) row[shift->second + Eigen::Index(a)] = d[a];
                    row[turn + Eigen::Index(a)] = moment[a] / length;
                }
                gram.selfadjointView<Eigen::Lower>().rankUpdate(row);
            });
        }
        for (const DeckEquation& equation : m_constraints.equations)
            for (const auto& term : equation.terms) {
                const auto turn = turnOf.find(term.node);
                if (turn != turnOf.end())
                    gram(turn->second + term.axis, turn->second + term.axis) += 1;
            }
        const SymmetricEigen motions = calcSymmetricEigen(gram);
        const Eigen::Index numStill =
            (motions.values.array() <= NoMotion * motions.values[count - 1]).count();
        Eigen::MatrixXd B = Eigen::MatrixXd::Identity(count, count);
        if (numStill > 0) B = motions.vectors.rightCols(count - numStill);

        std::vector<int> variables;
        for (Eigen::Index k = 0; k < B.cols(); ++k) {
            std::array<double, 6> values{};
            for (Eigen::Index i = 0; i < count; ++i)
                for (size_t j = 0; j < 6; ++j) values[j] += B(i, k) * rigid[size_t(i)][j];
            variables.push_back(system.addCoordinate(values));
        }
        const auto take = [&](Eigen::Index at, double factor) {
            std::array<std::vector<Term>, 3> terms;
            for (size_t a = 0; a < 3; ++a)
                for (Eigen::Index k = 0; k < B.cols(); ++k)
                    if (B(at + Eigen::Index(a), k) != 0)
                        terms[a].emplace_back(variables[size_t(k)],
                                              factor * B(at + Eigen::Index(a), k));
            return terms;
        };
        for (const auto& [reference, at] : shiftOf) m_shifts[reference] = take(at, 1);
        for (const auto& [rotation, at] : turnOf) m_turns[rotation] = take(at, 1 / length);
    }

    void addBodies(ConstraintSystem& system) {
        for (const DeckRigidBody& body : m_constraints.bodies) {
            std::array<std::vector<Term>, 3> shift;
            if (body.isReferenceInMesh) {
                for (int a = 0; a < 3; ++a)
                    shift[size_t(a)] = {{3 * m_mesh.indexOf(body.reference) + a, 1.0}};
            } else {
                shift = m_shifts.at(body.reference);
            }
            const auto& turn = m_turns.at(body.rotation);
            visitFollowers(body, [&](int node, const Vec3d& d, const Vec3d& arm) {
                std::vector<Term> terms;
                for (int a = 0; a < 3; ++a)
                    if (d[size_t(a)] != 0) terms.emplace_back(3 * node + a, -d[size_t(a)]);
                std::sort(terms.begin(), terms.end(), [](const Term& a, const Term& b) {
                    return std::abs(a.second) > std::abs(b.second);
                });
                const Vec3d moment = cross(arm, d);  // d·(θ×r) = θ·(r×d)
                for (size_t a = 0; a < 3; ++a) {
                    for (const auto& [variable, factor] : shift[a])
                        if (d[a] != 0) terms.emplace_back(variable, d[a] * factor);
                    for (const auto& [variable, factor] : turn[a])
                        if (moment[a] != 0) terms.emplace_back(variable, moment[a] * factor);
                }
                system.add(terms, body.where + " at " + nameOf(node));
            });
            const auto count = std::count_if(body.nodes.begin(), body.nodes.end(), [&](int node) {
                const int number = m_mesh.nodeNumbers[size_t(node)];
                return number != body.reference && !m_constraints.thin.nodes.count(number);
            });
            m_notes.push_back(body.where + " ties " + std::to_string(count) +
                              (count == 1 ? " node" : " nodes") +
                              (body.reference > 0 ? " to node " + std::to_string(body.reference)
                                                  : " to each other"));
        }
    }

    void addEquations(ConstraintSystem& system) {
        std::map<Outcome, std::pair<size_t, std::string>> seen;
        for (const DeckEquation& equation : m_constraints.equations) {
            std::vector<Term> terms;
            for (const auto& term : equation.terms) {
                const auto turn = m_turns.find(term.node);
                if (turn == m_turns.end()) {
                    terms.emplace_back(3 * m_mesh.indexOf(term.node) + term.axis, term.coefficient);
                    continue;
                }
                for (const auto& [variable, factor] : turn->second[size_t(term.axis)])
                    terms.emplace_back(variable, term.coefficient * factor);
            }
            auto& entry = seen[system.add(terms, equation.where)];
            if (entry.first++ == 0) entry.second = equation.where;
        }
        const auto say = [&](Outcome outcome, const char* what) {
            const auto found = seen.find(outcome);
            if (found == seen.end()) return;
            const auto& [count, where] = found->second;
            m_notes.push_back(
                where + (count > 1 ? " and " + std::to_string(count - 1) + " more" : "") + what);
        };
        say(Outcome::Redundant, ": other equations say it already; left out");
        say(Outcome::Corrected,
            ": rigid motions violate it in the last digits of its coefficients; corrected");
    }

    void addTie(ConstraintSystem& system, const DeckTie& tie, const std::vector<TiedNode>& tied) {
        size_t numDependent = 0;
        for (const TiedNode& at : tied) {
            const auto W = calcTieCoefficients(positionsOf(*at.face), at.xi, at.eta,
                                               m_mesh.position(at.slave));
            for (int a = 0; a < 3; ++a) {
                if (system.isDependent(3 * at.slave + a)) {
                    ++numDependent;
                    continue;
                }
                std::vector<Term> terms{{3 * at.slave + a, -1.0}};
                for (size_t k = 0; k < W.size(); ++k)
                    for (int b = 0; b < 3; ++b) {
                        const double w = W[k][size_t(3 * a + b)];
                        if (std::abs(w) > TinyCoefficient)
                            terms.emplace_back(3 * (*at.face)[k] + b, w);
                    }
                system.add(terms, tie.where + " at " + nameOf(at.slave));
            }
        }
        if (numDependent)
            m_warnings.push_back(
                tie.where + " leaves " + std::to_string(numDependent) +
                " translations of slave nodes to the equations that determine them "
                "already");
    }

    const DeckConstraints& m_constraints;
    const std::vector<char>& m_hasElement;
    Mesh& m_mesh;
    std::vector<std::string>&m_notes, &m_warnings;
    /** Translations of references outside the mesh, and rotations, by x, y, z. **/
    std::map<int, std::array<std::vector<Term>, 3>> m_shifts, m_turns;
};

}  // namespace

NodalConstraints applyConstraints(const DeckConstraints& constraints,
                                  const std::vector<char>& hasElement, Mesh& mesh,
                                  std::vector<std::string>& notes,
                                  std::vector<std::string>& warnings) {
    if (constraints.empty()) return {};
    return Tier(constraints, hasElement, mesh, notes, warnings).apply();
}

}  // namespace simflex
