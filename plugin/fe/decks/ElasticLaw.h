#pragma once
/** @file
Linear elastic materials and their directions, as CalculiX reads them from a deck. Internal to fe.

    σ = D ε,    ε = (ε_xx, ε_yy, ε_zz, 2ε_xy, 2ε_xz, 2ε_yz)

*ELASTIC with TYPE=ISOTROPIC, ENGINEERING CONSTANTS, ORTHOTROPIC and ANISOTROPIC; of a material
given for several temperatures the first, which is what K is made of too. *ORIENTATION with
SYSTEM=RECTANGULAR and CYLINDRICAL. **/

#include <array>
#include <vector>

#include "InpCards.h"

namespace simflex {

/** 6×6, symmetric; components xx yy zz xy xz yz. **/
using ElasticMatrix = std::array<std::array<double, 6>, 6>;

/** Columns are the local axes. **/
using Axes = std::array<std::array<double, 3>, 3>;

/** D of an *ELASTIC card in the material's own axes.
@throws std::invalid_argument naming file and line for constants that make no solid. **/
ElasticMatrix parseElasticLaw(const DeckCard& elastic);

/** The local axes of an *ORIENTATION card at every point. **/
class Orientation {
public:
    /** @throws std::invalid_argument naming file and line. **/
    explicit Orientation(const DeckCard& orientation);

    /** Whether they differ from point to point. **/
    bool isCylindrical() const { return m_isCylindrical; }
    Axes calcAxes(const std::array<double, 3>& point) const;

private:
    bool m_isCylindrical = false;
    std::array<double, 3> m_a{}, m_b{};
    Axes m_axes{};  ///< if rectangular
};

/** D in the deck's axes of a material whose own axes are given. **/
ElasticMatrix turnElasticLaw(const ElasticMatrix& D, const Axes& axes);

}  // namespace simflex
