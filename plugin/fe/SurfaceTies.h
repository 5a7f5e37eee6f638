#pragma once
/** @file
Places of slave nodes on a master surface, for *TIE. Internal to fe.

A slave node at p follows the face point x(ξ,η) = Σ N_k x_k nearest to it:

    u_p = Σ N_k u_k + δg,    g = p − x = a ∂x/∂ξ + b ∂x/∂η + d n

δg turns the gap g with the face, so that a rigid motion of the face carries the node along. Where
the node is moved onto the face (ADJUST), g = 0. **/

#include <string>
#include <vector>

#include "FaceShapes.h"

namespace simflex {

/** One face of a surface: mesh indices and positions of its nodes. **/
struct TieFace {
    std::vector<int> nodes;
    std::vector<Vec3d> positions;
};

/** Where a slave node sits on a face. **/
struct TiePlace {
    int face = -1;  ///< −1: no face near enough
    double xi = 0, eta = 0;
    double normalGap = 0;   ///< distance along the face's normal [m]
    double tangentGap = 0;  ///< distance beyond the face's border [m]
    Vec3d position{};       ///< of the place [m]
};

/** Finds places on a surface. **/
class TieSurface {
public:
    explicit TieSurface(std::vector<TieFace> faces);

    /** As CalculiX takes it where no POSITION TOLERANCE is given, and for places beyond the
    border: 2.5 % of a face's size. **/
    double calcDefaultTolerance() const { return m_defaultTolerance; }

    /** The nearest place; its gaps tell how far. O(faces near) **/
    TiePlace findPlace(const Vec3d& point) const;

private:
    struct Box {
        Vec3d low, high;
    };
    std::vector<TieFace> m_faces;
    std::vector<Box> m_boxes;
    double m_defaultTolerance = 0;
};

/** Coefficients W of u_p = Σ W_k u_k, 3×3 by rows, one for each node of a face: for a slave node at
its place ξ, η. **/
std::vector<std::array<double, 9>> calcTieCoefficients(const std::vector<Vec3d>& face, double xi,
                                                       double eta, const Vec3d& slave);

}  // namespace simflex
