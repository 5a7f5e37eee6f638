#pragma once
/** @file
Assembles element matrices into sparse matrices, in parallel. Internal to fe and reduction.

Elements are grouped in chunks of 64. Chunks without common nodes have the same colour and are
processed in parallel, one colour after another. The order in which the terms of an entry are added
is fixed, so results are bit-identical for any number of threads. **/

#include <Eigen/Dense>
#include <functional>
#include <vector>

#include "FeElements.h"
#include "simflex/base/Progress.h"
#include "simflex/fe/FeModel.h"

namespace simflex {

/** Workspace of one thread. **/
struct ElementWork {
    ElementPoints points;
    Eigen::MatrixXd K;  ///< 3n×3n, 3·node + axis; lower triangle only
    Eigen::MatrixXd m;  ///< n×n, lower triangle only
    Eigen::MatrixXd W, A;
    Eigen::Matrix<double, 6, Eigen::Dynamic> B, DB;
};

class ElementAssembly {
public:
    /** @param elements  must outlive this object **/
    ElementAssembly(const FeElements& elements, int numNodes);

    /** Sets work.K and work.m of an element, or those requested. **/
    using Calc = std::function<void(int element, ElementWork& work)>;

    /** @param K, m  null: not requested.
    @throws Cancelled **/
    void assemble(const Calc& calc, SymmetricMatrix* K, SymmetricMatrix* m,
                  const ProgressCallback& progress = {}) const;

private:
    void findNeighbours(int numNodes);
    void colorChunks(int numNodes);
    void addElement(int element, const ElementWork& work, SymmetricMatrix* K,
                    SymmetricMatrix* m) const;

    const FeElements& m_elements;
    std::vector<std::int64_t> m_starts;      ///< of the columns of m
    std::vector<std::int32_t> m_rows;        ///< row indices of m
    std::vector<std::vector<int>> m_colors;  ///< chunks by colour
};

/** Computes K of an element whose points are in `work`. **/
void integrateStiffness(ElementWork& work);

/** Computes K and m of one element in `work`. **/
void integrateElement(const FeElements& elements, const Mesh& mesh, int element, ElementWork& work);

/** Assembles K and m of all elements of the mesh. @throws std::invalid_argument naming an inverted
element. @throws Cancelled **/
void assembleElements(const FeElements& elements, const Mesh& mesh, SymmetricMatrix& K,
                      SymmetricMatrix& m, const ProgressCallback& progress);

}  // namespace simflex
