#pragma once
/** @file
J of a tree of rigid bodies, stored by bodies: J x and J⁻¹ r (TreeFactors) cost O(n). A change x_j
of a speed moves all outboard bodies alike, by 12 numbers X_j x_j:

    z_B = z_P + X_B x_B,   φ_B = Q_B z_B + Σ_outboard (φ_C + C_C x_C)
    (J x)_B = S_Bᵀ φ_B + E_B x_B

z_P belongs to the parent (zero at a root), and the sum runs over the bodies mobilized on B.
RigidTree.h defines the symbols. X, C and E are linear in 1/mass and in the stiffness factor; Q and
S are real and do not depend on the factors. **/

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

namespace simflex {

class Checkpoint;

/** A body, stored after its parent; parent −1: a root. **/
struct TreeNode {
    int parent, firstSpeed, numSpeeds;
};

template <class Scalar>
struct BasicTreeMatrix {
    static constexpr int NumForces = 6, NumMotions = 12;

    using Node = TreeNode;
    std::vector<Node> nodes;      ///< constant
    std::vector<double> inertia;  ///< Q: 6×12 per body
    std::vector<double> screws;   ///< S: 6 per speed
    std::vector<Scalar> motions;  ///< X: 12 per speed
    std::vector<Scalar> turned;   ///< C: 6 per speed
    std::vector<Scalar> own;      ///< E: 6 per speed, those of its body first

    void resize(std::vector<Node> bodies, int numSpeeds) {
        nodes = std::move(bodies);
        const size_t n = size_t(numSpeeds);
        inertia.assign(nodes.size() * NumForces * NumMotions, 0);
        screws.assign(n * NumForces, 0);
        motions.assign(n * NumMotions, 0);
        turned.assign(n * NumForces, 0);
        own.assign(n * NumForces, 0);
    }

    /** y ← J x. **/
    void multiply(const Scalar* x, Scalar* y, std::vector<Scalar>& workspace) const {
        workspace.assign(nodes.size() * (NumMotions + NumForces), Scalar(0));
        Scalar *z = workspace.data(), *force = z + nodes.size() * NumMotions;
        for (size_t b = 0; b < nodes.size(); ++b) {
            const Node& node = nodes[b];
            Scalar* zB = z + NumMotions * b;
            if (node.parent >= 0) std::copy_n(z + NumMotions * node.parent, NumMotions, zB);
            for (int k = node.firstSpeed; k < node.firstSpeed + node.numSpeeds; ++k)
                for (int i = 0; i < NumMotions; ++i) zB[i] += motions[at(k, NumMotions, i)] * x[k];
        }
        for (size_t b = nodes.size(); b-- > 0;) {
            const Node& node = nodes[b];
            Scalar* forceB = force + NumForces * b;
            const double* Q = inertia.data() + NumForces * NumMotions * b;
            for (int j = 0; j < NumMotions; ++j)
                for (int i = 0; i < NumForces; ++i)
                    forceB[i] += Q[i + NumForces * j] * z[NumMotions * b + size_t(j)];
            for (int k = 0; k < node.numSpeeds; ++k) {
                Scalar& yK = y[node.firstSpeed + k];
                yK = Scalar(0);
                for (int i = 0; i < NumForces; ++i)
                    yK += screws[at(node.firstSpeed + k, NumForces, i)] * forceB[i];
                for (int j = 0; j < node.numSpeeds; ++j)
                    yK += own[at(node.firstSpeed + j, NumForces, k)] * x[node.firstSpeed + j];
            }
            if (node.parent < 0) continue;
            Scalar* forceP = force + NumForces * node.parent;
            for (int i = 0; i < NumForces; ++i) forceP[i] += forceB[i];
            for (int k = node.firstSpeed; k < node.firstSpeed + node.numSpeeds; ++k)
                for (int i = 0; i < NumForces; ++i) forceP[i] += turned[at(k, NumForces, i)] * x[k];
        }
    }

    /** Writes J as a dense n×n matrix, in O(n·depth). **/
    void expand(int n, Scalar* J, std::vector<Scalar>& workspace) const {
        constexpr int Most = 6;  // speeds of a body
        // Q of each body including its outboard bodies.
        workspace.assign(inertia.begin(), inertia.end());
        std::fill_n(J, size_t(n) * size_t(n), Scalar(0));
        for (size_t b = nodes.size(); b-- > 0;) {
            const Node& node = nodes[b];
            const Scalar* Q = workspace.data() + NumForces * NumMotions * b;
            Scalar rows[Most][NumMotions], columns[Most][NumForces];
            for (int k = 0; k < node.numSpeeds; ++k) {
                const int speed = node.firstSpeed + k;
                for (int j = 0; j < NumMotions; ++j) {
                    rows[k][j] = Scalar(0);
                    for (int i = 0; i < NumForces; ++i)
                        rows[k][j] += screws[at(speed, NumForces, i)] * Q[i + NumForces * j];
                }
                for (int i = 0; i < NumForces; ++i) {
                    columns[k][i] = turned[at(speed, NumForces, i)];
                    for (int j = 0; j < NumMotions; ++j)
                        columns[k][i] += Q[i + NumForces * j] * motions[at(speed, NumMotions, j)];
                }
            }
            // Columns of inboard bodies and its own; then rows of inboard bodies.
            for (int a = int(b); a >= 0; a = nodes[size_t(a)].parent)
                for (int j = 0; j < nodes[size_t(a)].numSpeeds; ++j) {
                    const int inboard = nodes[size_t(a)].firstSpeed + j;
                    for (int k = 0; k < node.numSpeeds; ++k) {
                        const int speed = node.firstSpeed + k;
                        Scalar& down = J[size_t(speed) + size_t(inboard) * size_t(n)];
                        for (int i = 0; i < NumMotions; ++i)
                            down += rows[k][i] * motions[at(inboard, NumMotions, i)];
                        if (a == int(b)) {
                            down += own[at(inboard, NumForces, k)];
                            continue;
                        }
                        Scalar& up = J[size_t(inboard) + size_t(speed) * size_t(n)];
                        for (int i = 0; i < NumForces; ++i)
                            up += screws[at(inboard, NumForces, i)] * columns[k][i];
                    }
                }
            if (node.parent < 0) continue;
            Scalar* parent = workspace.data() + NumForces * NumMotions * node.parent;
            for (int i = 0; i < NumForces * NumMotions; ++i) parent[i] += Q[i];
        }
    }

    /** Real matrices only: saves or restores sizes and all numbers. **/
    void visit(Checkpoint& checkpoint, int numSpeeds);

private:
    static size_t at(int speed, int length, int i) { return size_t(speed * length + i); }
};

template <>
void BasicTreeMatrix<double>::visit(Checkpoint& checkpoint, int numSpeeds);

}  // namespace simflex
