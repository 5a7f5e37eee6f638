#pragma once
/** @file
Stress and strain at the nodes of a part under given displacements, as computed by CalculiX.
Internal to fe and reduction.

Strain and stress at the points of each element (FeElements.h) are extrapolated to its nodes and
averaged over the elements at a node, across materials. CalculiX itself uses tables of four to six
digits; its table for C3D6 (2.20) swaps the ends of the wedge, which is not reproduced. **/

#include "FeElements.h"
#include "simflex/base/Progress.h"
#include "simflex/fe/FeModel.h"

namespace simflex {

class ElementStress {
public:
    /** @param model  must outlive this object
    @throws std::invalid_argument if it was read as matrices, or has elements without stress. **/
    explicit ElementStress(const FeModel& model);

    /** Components xx yy zz xy xz yz, in the deck's axes; tensor strain. Time O(elements at the
    nodes · count); bit-identical for any number of threads.
    @param nodes    mesh indices
    @param fields   3·numNodes×count displacements, column-major
    @param stress   (6·nodes)×count, column-major, overwritten
    @param strain   the same
    @throws std::out_of_range for an index outside the mesh. @throws Cancelled. **/
    void calcAtNodes(const std::vector<int>& nodes, const double* fields, int count, float* stress,
                     float* strain, const ProgressCallback& progress = {}) const;

    /** Stress and strain at an integration point. **/
    struct PointStress {
        int element = 0;  ///< deck number
        int point = 0;    ///< CalculiX's number, from 1
        std::array<double, 6> stress{}, strain{};
    };

    /** Computes all integration points; elements by type, then in deck order. **/
    std::vector<PointStress> calcAtPoints(const double* field) const;

private:
    void calcGroup(const std::vector<int>& rowOf, const std::vector<int>& touched, size_t numRows,
                   const double* fields, int count, float* stress, float* strain) const;

    const FeModel& m_model;
    const FeElements& m_elements;
};

}  // namespace simflex
