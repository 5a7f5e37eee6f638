#pragma once
/** @file
The node of a mesh that is displaced most (private header).

Nodes stand in a tree of tiles. In a tile with box b about x̄ a mode is nearly linear, φ_i(x) = c_i +
A_i (x − x̄) up to r_i, so that

    |Φξ| ≤ max over the corners of b |Σ ξ_i c_i + Σ ξ_i A_i (x − x̄)| + Σ |ξ_i| r_i.

Tiles whose bound is less than what a node has are passed over: of a large mesh most. The value
found is the largest of all nodes, as calcDisplacement() has it, to the last bit. **/

#include <Eigen/Dense>
#include <atomic>
#include <memory>
#include <mutex>
#include <vector>

#include "simflex/part/ReducedBody.h"

namespace simflex {

/** Φξ of a node in B [m]. @param node  mesh index **/
::Eigen::Vector3d calcDisplacement(const ReducedBody& part, int node, const double* xi);

class DisplacementSearch {
public:
    /** Reads Φ once. @param part  outlives this **/
    explicit DisplacementSearch(const ReducedBody& part);

    struct Largest {
        double displacement = 0;  ///< |Φξ| [m]; NaN if ξ is not finite
        int node = 0;             ///< mesh index, the first if there are several
    };
    /** @param xi  n_f **/
    Largest find(const double* xi) const;
    /** The same by a look at all nodes, without a tree. O(nodes·n_f). **/
    static Largest findAmongAll(const ReducedBody& part, const double* xi);

private:
    static constexpr int LeafSize = 32, RootSize = 2048;  // nodes
    static constexpr int NumChildren = 8;
    static constexpr int NumCoefficients = 16;  // c (3), A (9), r, padding

    struct Tile {
        int first, last;                                ///< of m_nodes
        int children = -1;                              ///< the first of NumChildren; none: a leaf
        ::Eigen::Vector3d center{0, 0, 0};              ///< x̄, the mean of its nodes
        ::Eigen::Vector3d low{0, 0, 0}, high{0, 0, 0};  ///< corners of the box, from x̄
    };
    /** Displacements in a tile at ξ. **/
    struct Field {
        double linear[NumCoefficients];  ///< Σ ξ_i (c_i, A_i)
        double rest = 0;                 ///< Σ |ξ_i| r_i
    };

    /** Sorts nodes into two halves along their longest direction; returns where the second begins.
     * **/
    int halve(int first, int last);
    void divide(int first, int last);
    void divideTile(int tile);
    void fit(int tile);
    Field calcField(int tile, const double* xi) const;
    /** That no node of the tile is displaced beyond. **/
    double calcBound(int tile, const double* xi) const;
    /** Takes a node that is displaced more than the worst so far. **/
    void searchLeaf(int tile, const double* xi, double& squared, int& worst) const;

    const ReducedBody& m_part;
    std::vector<int> m_nodes;  ///< mesh indices, tile by tile, ascending in leaves
    std::vector<int> m_roots;
    std::vector<Tile> m_tiles;
    std::vector<float> m_coefficients;  ///< by tile, mode
};

/** Looks at all nodes until that would have paid for a tree. From any thread. **/
class LazyDisplacementSearch {
public:
    DisplacementSearch::Largest find(const ReducedBody& part, const double* xi) {
        constexpr int Worth = 50;  // looks that cost what a tree does
        if (m_looks < Worth) {
            ++m_looks;
            return DisplacementSearch::findAmongAll(part, xi);
        }
        std::call_once(m_once, [&] { m_search = std::make_unique<DisplacementSearch>(part); });
        return m_search->find(xi);
    }

private:
    std::atomic<int> m_looks{0};
    std::once_flag m_once;
    std::unique_ptr<const DisplacementSearch> m_search;
};

}  // namespace simflex
