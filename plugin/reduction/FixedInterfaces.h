#pragma once
/** @file
The stiffness of a part whose interfaces are held, factored once, K = L Lᵀ. Internal to reduction.

Every shape u with its interfaces at rest is made by Θ from coordinates z that are orthonormal in
energy, and the static deflection under nodal forces f is Θ Θᵀ f:

    u = Θ z,   uᵀKu = |z|²,    Θ = (1 − R G D) T L⁻ᵀ (1 − QQᵀ)

T makes nodal translations of the free coordinates (see Coordinates.h). Rigid ties (see
InterfaceTie.h) take their coordinates out of K before it is factored. Distributing ties are the
constraints D u = 0, met by the projection: Q is an orthonormal basis of L⁻¹TᵀDᵀ. A part without any
rigid tie is factored on a statically determinate support of six coordinates; there only loads N in
equilibrium, (DR)ᵀN = 0, enter Q, and the rigid motion R G D, G = (DR)⁺, puts the interfaces back. A
part without interfaces is held in the mean, D = RᵀM: Θ then makes its free-free shapes.

A StiffnessSolver of the options knows no L; with Y = K⁻¹TᵀDᵀ it does the same by whole solves. **/

#include <memory>

#include "BlockLanczos.h"
#include "CraigBampton.h"

namespace simflex {

class FixedInterfaces {
public:
    /** Keeps references to all that it is given. **/
    FixedInterfaces(const std::string& part, const FeModel& model, const FeProducts& products,
                    const RigidMotion& rigid, const InterfaceTies& ties);
    ~FixedInterfaces();

    /** Factors K. @throws std::invalid_argument that names a node if K is singular beyond the rigid
    motions, if interfaces overlap through constraints, or, before it is factored, if that and as
    many modes take more memory than there is. **/
    void factor(int numModes, const ReductionOptions& options, const ProgressCallback& progress);

    /** Number of free coordinates, which is that of z. @pre factor(), as for all below. **/
    Eigen::Index size() const;

    /** Deflection under forces with the interfaces held. **/
    Shapes solve(const Shapes& f) const;

    /** Static shapes for a unit of each boundary coordinate: numDofs×numBoundaryDofs. **/
    Shapes calcConstraintModes() const;

    struct NormalModes {
        Eigen::VectorXd omegaSquared;  ///< ascending
        Shapes shapes;                 ///< φᵀKφ = 1
        int numBlocks = 0;             ///< that Lanczos solved for
    };

    /** The lowest modes with the interfaces held; `range` is of 1/ω². **/
    NormalModes calcNormalModes(const ModeRange& range, const ProgressCallback& progress) const;

    Shapes toShapes(const Eigen::MatrixXd& z) const;    ///< Θ z; not of another StiffnessSolver
    Eigen::MatrixXd fromForces(const Shapes& f) const;  ///< Θᵀ f; not of another StiffnessSolver

    long numFactorEntries() const;
    /** ‖K‖₁‖K⁻¹‖₁ of the factored matrix, from below and seldom by more than a factor of 3. A few
    solves. **/
    double estimateConditionNumber() const;

private:
    struct Data;
    std::unique_ptr<Data> m_data;
};

}  // namespace simflex
