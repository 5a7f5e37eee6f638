#pragma once
/** @file
Sums of element matrices in sparse matrices, in parallel. Internal to fe and reduction.

Elements come in chunks of 64; chunks that share no node have one colour and are summed up at the
same time, colours one after the other. The order in which an entry's terms are added, and so its
bits, never depends on the number of threads. **/

#include <Eigen/Dense>
#include <functional>
#include <vector>

#include "FeElements.h"
#include "simflex/base/Progress.h"
#include "simflex/fe/FeModel.h"

namespace simflex {

/** What one thread works with. **/
struct ElementWork {
    ElementPoints points;
    Eigen::MatrixXd K;  ///< 3n×3n, 3·node + axis; its lower triangle counts
    Eigen::MatrixXd m;  ///< n×n, the same
    Eigen::MatrixXd W, A;
    Eigen::Matrix<double, 6, Eigen::Dynamic> B, DB;
};

class ElementAssembly {
public:
    /** @param elements  must outlive this **/
    ElementAssembly(const FeElements& elements, int numNodes);

    /** Sets work.K and work.m of an element, or what of them is asked for. **/
    using Calc = std::function<void(int element, ElementWork& work)>;

    /** @param K, m  null: not asked for.
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
    std::vector<std::int32_t> m_rows;        ///< of m
    std::vector<std::vector<int>> m_colors;  ///< chunks
};

/** K of an element of which work has the points. **/
void integrateStiffness(ElementWork& work);

/** K and m of one element into work. **/
void integrateElement(const FeElements& elements, const Mesh& mesh, int element, ElementWork& work);

/** K and m of all elements of the mesh. @throws std::invalid_argument naming an element that is
turned inside out. @throws Cancelled **/
void assembleElements(const FeElements& elements, const Mesh& mesh, SymmetricMatrix& K,
                      SymmetricMatrix& m, const ProgressCallback& progress);

}  // namespace simflex
