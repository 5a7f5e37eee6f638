#pragma once
/** @file
A formula as a tree: the parser's result, to be evaluated (Evaluation.h) and searched for switches
(Switches.h).

    2*t + step(t, 0, 0, 1, 5)      Add(Multiply(2, t), Step(t, 0, 0, 1, 5))

Operands precede the nodes that use them, and may be shared: deadband(x, w) uses x twice. Nodes that
depend on no variable are Numbers. **/

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
    Call,       ///< of a user-defined function
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
    If,  ///< condition, then, else; only one branch is evaluated
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
    std::vector<int> operands;                    ///< indices of nodes
    double number = 0;                            ///< for Number
    int variable = -1;                            ///< for Variable
    std::shared_ptr<const Table> table;           ///< for Lookup
    std::shared_ptr<const SurfaceTable> surface;  ///< for LookupTwo
    std::shared_ptr<const OwnFunction> function;  ///< for Call
    int begin = 0, end = 0;                       ///< in the text
    int depth = 1;                                ///< of the subtree
};

struct Tree {
    std::vector<Node> nodes;  ///< the last is the root
    bool isShared = false;    ///< some node is an operand of several others

    /** Copies the subtree below a node, each node once. **/
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
