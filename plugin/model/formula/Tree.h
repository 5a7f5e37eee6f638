#pragma once
/** @file
A formula as a tree: what the parser makes, and what is evaluated (Evaluation.h) and searched for
switches (Switches.h).

    2*t + step(t, 0, 0, 1, 5)      Add(Multiply(2, t), Step(t, 0, 0, 1, 5))

Operands stand before what is made of them, and may be of several: deadband(x, w) names x twice.
What depends on no variable is a Number. **/

#include <memory>
#include <vector>

#include "simflex/model/formula/OwnFunction.h"
#include "simflex/model/formula/SurfaceTable.h"
#include "simflex/model/formula/Table.h"

namespace simflex {
namespace formula {

enum class Operation {
    Number,
    Variable,
    Lookup,     ///< in a table
    LookupTwo,  ///< in a table of two variables
    Call,       ///< of a function of a program's own
    Negate,
    Add,
    Subtract,
    Multiply,
    Divide,
    Power,
    Less,
    LessOrEqual,
    Equal,
    NotEqual,
    And,
    Or,
    If,  ///< condition, then, else: only what is taken is evaluated
    Sin,
    Cos,
    Tan,
    Asin,
    Acos,
    Atan,
    Sinh,
    Cosh,
    Tanh,
    Exp,
    Ln,
    Log10,
    Sqrt,
    Abs,
    Sign,
    Floor,
    Ceil,
    Mod,
    Atan2,
    Hypot,
    Min,
    Max,
    Step,
    Ramp,
    Pulse
};

struct Node {
    Operation operation = Operation::Number;
    std::vector<int> operands;                    ///< numbers of nodes
    double number = 0;                            ///< of Number
    int variable = -1;                            ///< of Variable
    std::shared_ptr<const Table> table;           ///< of Lookup
    std::shared_ptr<const SurfaceTable> surface;  ///< of LookupTwo
    std::shared_ptr<const OwnFunction> function;  ///< of Call
    int begin = 0, end = 0;                       ///< its characters
    int depth = 1;                                ///< of the tree below
};

struct Tree {
    std::vector<Node> nodes;  ///< the last is the root
    bool isShared = false;    ///< whether a node is an operand of several

    /** The part below a node, each of whose nodes is copied once. **/
    Tree copyPart(int root) const;

    int getRoot() const { return static_cast<int>(nodes.size()) - 1; }
    const Node& operator[](int node) const { return nodes[static_cast<std::size_t>(node)]; }
};

namespace tree {

inline int copy(const Tree& from, int number, std::vector<int>& copies, Tree& to) {
    int& own = copies[static_cast<std::size_t>(number)];
    if (own >= 0) {
        to.isShared |= !from[number].operands.empty();
        return own;
    }
    Node node = from[number];
    for (int& operand : node.operands) operand = copy(from, operand, copies, to);
    to.nodes.push_back(std::move(node));
    return own = to.getRoot();
}

}  // namespace tree

inline Tree Tree::copyPart(int root) const {
    Tree part;
    std::vector<int> copies(nodes.size(), -1);
    tree::copy(*this, root, copies, part);
    return part;
}

}  // namespace formula
}  // namespace simflex
