#pragma once
/** @file
Equations of motion of one flexible body about its mean-axis frame B (private header: Eigen inside).

    I(ξ) ω̇ + C(ξ) ξ̈ + İ ω + ω×(I ω + C ξ̇)                       = τ
    ξ̈ + C(ξ)ᵀ ω̇ − 2 Σ_a ω_a N_a ξ̇ − ½ ωᵀ(∂I/∂ξ)ω + D ξ̇ + Ω² ξ   = f_ξ

with ω, τ in B and C_a = ξᵀN_a. Translation, `m v̇ = F`, is decoupled and left to the caller.

`FlexibleBodyModel` is constant and shared by all bodies of a part; `FlexibleBodyData` is the
workspace of one body. **/

#include <Eigen/Dense>
#include <memory>

#include "simflex/base/TiledMatrix.h"
#include "simflex/body/DisplacementSearch.h"
#include "simflex/body/InterfaceKinematics.h"
#include "simflex/part/ReducedBody.h"

namespace simflex {

// SimTK has a class named Eigen, which clang finds ambiguous after `using namespace SimTK`.
namespace Eigen = ::Eigen;

/** Invariants of a part laid out for evaluation. **/
struct FlexibleBodyModel {
    FlexibleBodyModel() = default;
    explicit FlexibleBodyModel(std::shared_ptr<const ReducedBody> reducedPart);

    /** Returns the model with geometric stiffening: the part's rotational stiffening K is
    subtracted from I₂. Interface shapes are shared; use them with their curvature. @pre
    part->stiffening. **/
    std::shared_ptr<const FlexibleBodyModel> makeStiffened() const;
    bool isStiffened = false;

    /** Returns the model without modes; interfaces in the same order. **/
    std::shared_ptr<const FlexibleBodyModel> makeRigid() const;

    std::shared_ptr<const ReducedBody> part;
    int n = 0;  ///< n_f
    double mass = 0;
    Eigen::Matrix3d inertia;      ///< I₀
    Eigen::VectorXd I1Values;     ///< I₁, n×6 column-major, padded by ChunkSize zeros
    Eigen::MatrixXd I2;           ///< 6n×n: rows c·n … of component c (xx yy zz xy xz yz)
    Eigen::MatrixXd N;            ///< 3n×n: N_x, N_y, N_z
    TiledMatrix I2Tiles, NTiles;  ///< the same for matrix–vector products
    TiledMatrix shapeTiles;       ///< Φ (3) and Ψ (3) of each interface, 6·interfaces×n
    Eigen::VectorXd omegaSquared;
    Eigen::VectorXd displacementPerMode;  ///< largest node displacement for ξ_i = 1 [m]
    double radius = 0;                    ///< largest distance of the part from its centre of mass
                                          ///< [m]
    std::shared_ptr<LazyDisplacementSearch> displacementSearch;
    std::vector<std::shared_ptr<const FrameShapes>> interfaceShapes;  ///< as part->interfaces

    /** @throws std::out_of_range naming the part, the interface asked for and the existing
    ones. **/
    const std::shared_ptr<const FrameShapes>& getInterfaceShapes(const std::string& name) const;

    /** Finds the node with the largest displacement at ξ. **/
    DisplacementSearch::Largest findLargestDisplacement(const double* xi) const {
        return displacementSearch->find(*part, xi);
    }

    /** I₁, n×6. **/
    auto getI1() const {
        return Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, 6>>(I1Values.data(), n, 6);
    }
};

/** Results of an evaluation. Allocated once by resize(). **/
struct FlexibleBodyData {
    void resize(const FlexibleBodyModel& model);
    /** Adapts to another model of the same workspace: only enlarges the buffers for products. **/
    void fit(const FlexibleBodyModel& model);

    /** Products with ξ and ξ̇, of size 6n, 3n and 3n, padded so that whole chunks can be read. **/
    Eigen::VectorXd I2Xi, NXi, NXiDot;
    Eigen::Matrix3d I, IDot;
    Eigen::Vector3d CXiDot;  ///< C ξ̇
    int numModes = -1;

    /** Cᵀ = −Nξ, n×3. **/
    auto getCTransposed() const {
        return -Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, 3>>(NXi.data(), numModes, 3);
    }
};

/** Builds a symmetric matrix from components xx yy zz xy xz yz. **/
Eigen::Matrix3d symmetricMatrix(const Eigen::Matrix<double, 6, 1>& components);

/** Computes the products of the invariants with ξ and ξ̇ for several bodies of one part, reading
the invariants once for all of them. 24 n_f² flops per body.
@param xi, xiDot  `count` pointers to n_f entries **/
void calcProducts(const FlexibleBodyModel& model, int count, const double* const* xi,
                  const double* const* xiDot, FlexibleBodyData* const* data);

/** Computes I at ξ, İ and Cξ̇. O(n_f). @pre calcProducts(). **/
void calcInertiaFromProducts(const FlexibleBodyModel& model, const double* xi, const double* xiDot,
                             FlexibleBodyData& data);

/** calcProducts() and calcInertiaFromProducts() for one body. **/
void calcInertia(const FlexibleBodyModel& model, const Eigen::Ref<const Eigen::VectorXd>& xi,
                 const Eigen::Ref<const Eigen::VectorXd>& xiDot, FlexibleBodyData& data);

/** B = ∂I/∂ξ, n×6: I₁ⱼ + 2 I₂ⱼᵢ ξᵢ by component. @pre calcProducts(). **/
Eigen::Matrix<double, Eigen::Dynamic, 6> calcInertiaGradient(const FlexibleBodyModel& model,
                                                             const FlexibleBodyData& data);

/** Computes the velocity-dependent terms of the left-hand side: rotation `İω + ω×(Iω + Cξ̇)`, modes
`−2Σω_aN_aξ̇ − ½ωᵀBω`.
@pre calcInertia(). **/
void calcVelocityTerms(const FlexibleBodyModel& model, const FlexibleBodyData& data,
                       const Eigen::Vector3d& omega, Eigen::Vector3d& rotation,
                       Eigen::Ref<Eigen::VectorXd> modes);

/** Adds M(ξ)·(ω̇, ξ̈) to (rotation, modes). @pre calcInertia(). **/
void addInInertiaTerms(const FlexibleBodyData& data, const Eigen::Vector3d& omegaDot,
                       const Eigen::Ref<const Eigen::VectorXd>& xiDotDot, Eigen::Vector3d& rotation,
                       Eigen::Ref<Eigen::VectorXd> modes);

/** Computes the body's Newton matrix with every term of the equations above, `∂r/∂u̇ /γ + ∂r/∂u + γ
∂r/∂q`, for unknowns [ω_B (3), v_G (3), ξ̇ (n_f)]. `mass` and `stiffness` are the γ of u̇ and of q
[s]. Elastic and damping terms are the diagonal 1/γ + d + γΩ². O(n_f²).
@param[in] damping  n_f modal damping coefficients d [1/s]
@param[out] J       (6+n_f)×(6+n_f)
@pre calcInertia(). **/
void calcNewtonMatrix(const FlexibleBodyModel& model, const FlexibleBodyData& data, double mass,
                      double stiffness, const Eigen::Vector3d& omega,
                      const Eigen::Vector3d& omegaDot,
                      const Eigen::Ref<const Eigen::VectorXd>& xiDot,
                      const Eigen::Ref<const Eigen::VectorXd>& xiDotDot,
                      const Eigen::Ref<const Eigen::VectorXd>& damping,
                      Eigen::Ref<Eigen::MatrixXd> J);

/** Computes the left-hand side of the equations above: inertia, velocity terms, damping and
elasticity, without the applied torque and modal forces. Writes I, İ and Cξ̇ as well. O(n_f).
@pre calcProducts().
@param[out] rotation, modes  overwritten **/
void calcBodyResidual(const FlexibleBodyModel& model, FlexibleBodyData& data,
                      const Eigen::Vector3d& omega, const Eigen::Vector3d& omegaDot,
                      const double* xi, const double* xiDot, const double* xiDotDot,
                      const Eigen::VectorXd& damping, Eigen::Vector3d& rotation, double* modes);

/** T = ½ m|v|² + ½ ωᵀIω + ωᵀCξ̇ + ½|ξ̇|². @pre calcInertia(). **/
double calcKineticEnergy(const FlexibleBodyModel& model, const FlexibleBodyData& data,
                         const Eigen::Vector3d& omega, const Eigen::Vector3d& v,
                         const Eigen::Ref<const Eigen::VectorXd>& xiDot);

}  // namespace simflex
