#pragma once
/** @file
Search for the mesh node with the largest displacement (private header).

Nodes are sorted into a tree of tiles. Within a tile with bounding box b about x̄, mode i is nearly
linear, φ_i(x) = c_i + A_i (x − x̄) with a remainder of at most r_i, so that

    |Φξ| ≤ max over the corners of b |Σ ξ_i c_i + Σ ξ_i A_i (x − x̄)| + Σ |ξ_i| r_i.

Tiles whose bound is below a displacement already found are skipped, which is most of a large mesh.
The result equals the maximum of calcDisplacement() over all nodes to the last bit. **/

#include <Eigen/Dense>
#include <atomic>
#include <memory>
#include <mutex>
#include <vector>

#include "simflex/part/ReducedBody.h"

namespace simflex {

/** Returns the displacement Φξ of a node in B [m]. @param node  mesh index **/
::Eigen::Vector3d calcDisplacement(const ReducedBody& part, int node, const double* xi);

class DisplacementSearch {
public:
    /** Reads Φ once. @param part  must outlive this object **/
    explicit DisplacementSearch(const ReducedBody& part);

    struct Largest {
        double displacement = 0;  ///< |Φξ| [m]; NaN if ξ is not finite
        int node = 0;             ///< mesh index, the lowest of several
    };
    /** @param xi  n_f **/
    Largest find(const double* xi) const;
    /** As find(), over all nodes without a tree. O(nodes·n_f). **/
    static Largest findAmongAll(const ReducedBody& part, const double* xi);

private:
    static constexpr int LeafSize = 32, RootSize = 2048;  // nodes
    static constexpr int NumChildren = 8;
    static constexpr int NumCoefficients = 16;  // c (3), A (9), r, padding

    struct Tile {
        int first, last;                    ///< range in m_nodes
        int children = -1;                  ///< index of the first of NumChildren; −1:
                                            ///< a leaf
        ::Eigen::Vector3d center{0, 0, 0};  ///< x̄, mean of the nodes
        ::Eigen::Vector3d low{0, 0, 0}, high{0, 0, 0};  ///< corners of the bounding box relative to
                                                        ///< x̄
    };
    /** Displacement field in a tile at ξ. **/
    struct Field {
        double linear[NumCoefficients];  ///< Σ ξ_i (c_i, A_i)
        double rest = 0;                 ///< Σ |ξ_i| r_i
    };

    /** Partitions nodes into two halves along their longest direction. Returns the start of the
    second. **/
    int halve(int first, int last);
    void divide(int first, int last);
    void divideTile(int tile);
    void fit(int tile);
    Field calcField(int tile, const double* xi) const;
    /** Returns an upper bound of the displacement in a tile. **/
    double calcBound(int tile, const double* xi) const;
    /** Updates `worst` if a node of the leaf is displaced more. **/
    void searchLeaf(int tile, const double* xi, double& squared, int& worst) const;

    const ReducedBody& m_part;
    std::vector<int> m_nodes;  ///< mesh indices, tile by tile, ascending in leaves
    std::vector<int> m_roots;
    std::vector<Tile> m_tiles;
    std::vector<float> m_coefficients;  ///< by tile, mode
};

/** Searches all nodes until the cost of these searches exceeds that of a tree, then builds one.
Thread-safe. **/
class LazyDisplacementSearch {
public:
    DisplacementSearch::Largest find(const ReducedBody& part, const double* xi) {
        constexpr int Worth = 50;  // searches that cost as much as a tree
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
