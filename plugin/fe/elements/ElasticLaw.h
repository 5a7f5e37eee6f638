#pragma once
/** @file
Linear elastic laws and their material axes. Internal to fe.

    σ = D ε,    ε = (ε_xx, ε_yy, ε_zz, 2ε_xy, 2ε_xz, 2ε_yz)  **/

#include <array>

namespace simflex {

/** 6×6, symmetric; components xx yy zz xy xz yz. **/
using ElasticMatrix = std::array<std::array<double, 6>, 6>;

/** Columns are the local axes. **/
using Axes = std::array<std::array<double, 3>, 3>;

/** Material axes at every point. **/
class Orientation {
public:
    /** Uniform axes e₁, e₂, e₃. **/
    Orientation(const std::array<double, 3>& e1, const std::array<double, 3>& e2,
                const std::array<double, 3>& e3);

    /** Radial, tangential and axial axes about the line from a to b. @pre a ≠ b **/
    static Orientation makeCylindrical(const std::array<double, 3>& a,
                                       const std::array<double, 3>& b);

    /** Returns whether the axes differ from point to point. **/
    bool isCylindrical() const { return m_isCylindrical; }
    Axes calcAxes(const std::array<double, 3>& point) const;

private:
    Orientation() = default;

    bool m_isCylindrical = false;
    std::array<double, 3> m_a{}, m_b{};
    Axes m_axes{};  ///< if not cylindrical
};

/** Returns D in the deck's axes for a material with the given axes. **/
ElasticMatrix turnElasticLaw(const ElasticMatrix& D, const Axes& axes);

}  // namespace simflex
