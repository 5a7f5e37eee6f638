#pragma once
/** @file
Positions of slave nodes on a master surface, for *TIE. Internal to fe.

A slave node at p follows the nearest face point x(ξ,η) = Σ N_k x_k:

    u_p = Σ N_k u_k + δg,    g = p − x = a ∂x/∂ξ + b ∂x/∂η + d n

δg rotates the gap g with the face, so that a rigid motion of the face moves the node rigidly. If
the node is moved onto the face (ADJUST), g = 0. **/

#include <string>
#include <vector>

#include "FaceShapes.h"

namespace simflex {

/** A face of a surface: mesh indices and positions of its nodes. **/
struct TieFace {
    std::vector<int> nodes;
    std::vector<Vec3d> positions;
};

/** Position of a slave node on a face. **/
struct TiePlace {
    int face = -1;  ///< −1: no face is near enough
    double xi = 0, eta = 0;
    double normalGap = 0;   ///< distance along the face's normal [m]
    double tangentGap = 0;  ///< distance beyond the face's boundary [m]
    Vec3d position{};       ///< of the point on the face [m]
};

/** Searches for positions on a surface. **/
class TieSurface {
public:
    explicit TieSurface(std::vector<TieFace> faces);

    /** Default for a missing POSITION TOLERANCE, as in CalculiX, and for positions beyond the
    boundary: 2.5 % of a face's size. **/
    double calcDefaultTolerance() const { return m_defaultTolerance; }

    /** Finds the nearest position; its gaps give the distance. O(faces near) **/
    TiePlace findPlace(const Vec3d& point) const;

private:
    struct Box {
        Vec3d low, high;
    };
    std::vector<TieFace> m_faces;
    std::vector<Box> m_boxes;
    double m_defaultTolerance = 0;
};

/** Returns the coefficients W of u_p = Σ W_k u_k, 3×3 row-major, one per node of a face, for a
slave node at ξ, η. **/
std::vector<std::array<double, 9>> calcTieCoefficients(const std::vector<Vec3d>& face, double xi,
                                                       double eta, const Vec3d& slave);

}  // namespace simflex
