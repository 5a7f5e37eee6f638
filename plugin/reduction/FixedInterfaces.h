#pragma once
/** @file
The stiffness of a part with held interfaces, factored once, K = L Lᵀ. Internal to reduction.

Every shape u with its interfaces at rest is given by Θ and coordinates z that are orthonormal in
energy, and the static deflection under nodal forces f is Θ Θᵀ f:

    u = Θ z,   uᵀKu = |z|²,    Θ = (1 − R G D) T L⁻ᵀ (1 − QQᵀ)

T maps the free coordinates to nodal translations (see Coordinates.h). Coordinates of rigid ties
(see InterfaceTie.h) are removed from K before it is factored. Distributing ties are constraints D u
= 0, enforced by the projection: Q is an orthonormal basis of L⁻¹TᵀDᵀ. A part without rigid ties is
factored on a statically determinate support of six coordinates. Only self-equilibrated loads N,
(DR)ᵀN = 0, then enter Q, and the rigid motion R G D, G = (DR)⁺, returns the interfaces to rest. A
part without interfaces is held on average, D = RᵀM: Θ then gives its free-free shapes.

A StiffnessSolver from the options does not expose L; with Y = K⁻¹TᵀDᵀ complete solves give the
same. **/

#include <memory>

#include "BlockLanczos.h"
#include "CraigBampton.h"

namespace simflex {

class FixedInterfaces {
public:
    /** Keeps references to all arguments. **/
    FixedInterfaces(const std::string& part, const FeModel& model, const FeProducts& products,
                    const RigidMotion& rigid, const InterfaceTies& ties);
    ~FixedInterfaces();

    /** Factors K. @throws std::invalid_argument naming a node if K is singular beyond the rigid
    motions, if interfaces overlap through constraints, or if the predicted memory for the factor
    and this many modes exceeds the available memory. **/
    void factor(int numModes, const ReductionOptions& options, const ProgressCallback& progress);

    /** Returns the number of free coordinates, which is the size of z. @pre factor(), as for all
    below. **/
    Eigen::Index size() const;

    /** Returns the deflection under forces with the interfaces held. **/
    Shapes solve(const Shapes& f) const;

    /** Returns the static shapes for a unit of each boundary coordinate:
    numDofs×numBoundaryDofs. **/
    Shapes calcConstraintModes() const;

    struct NormalModes {
        Eigen::VectorXd omegaSquared;  ///< ascending
        Shapes shapes;                 ///< φᵀKφ = 1
        int numBlocks = 0;             ///< blocks solved for by Lanczos
    };

    /** Computes the lowest modes with the interfaces held; `range` is of 1/ω². **/
    NormalModes calcNormalModes(const ModeRange& range, const ProgressCallback& progress) const;

    Shapes toShapes(const Vectors& z) const;    ///< Θ z; not with another StiffnessSolver
    Vectors fromForces(const Shapes& f) const;  ///< Θᵀ f; not with another StiffnessSolver

    long numFactorEntries() const;
    /** Returns a lower bound of ‖K‖₁‖K⁻¹‖₁ of the factored matrix, seldom too small by more than a
    factor of 3. Costs a few solves. **/
    double estimateConditionNumber() const;

private:
    struct Data;
    std::unique_ptr<Data> m_data;
};

}  // namespace simflex
