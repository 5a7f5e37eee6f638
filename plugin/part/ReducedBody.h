#pragma once
/** @file
A flexible part after Craig–Bampton reduction: constant, shared by every body made of it.

Its deformation is `u(s) = Φ(s) ξ` with n_f modes that are free-free shapes of the part with its
interfaces tied: M-orthonormal (`ΦᵀMΦ = 1`), with diagonal stiffness `ΦᵀKΦ = Ω²`, and orthogonal to
the rigid-body modes. Frame B is the mean-axis frame: origin at the undeformed centre of mass, axes
parallel to those of the deck.

Kinetic energy with angular velocity ω in B, and C_a(ξ) = ξᵀN_a:

    T = ½ m|v|² + ½ ωᵀ(I₀ + ξᵢ I₁ᵢ + ξᵢξⱼ I₂ᵢⱼ)ω + ωᵀ C ξ̇ + ½|ξ̇|²

With geometric stiffening (see Stiffening) I₂ᵢⱼ is lessened, and interfaces move to second order.

All matrices are column-major. SI units. Standard types only, so that reduction needs no Simbody and
users no Eigen. **/

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "simflex/part/Mesh.h"
#include "simflex/part/ReductionReport.h"

namespace simflex {

/** How the nodes of an interface hang on its master point: they follow it rigidly (RBE2), or the
master is their weighted mean and stiffens nothing (RBE3). **/
enum class TieType { Rigid, Distributing };

class ReducedBody {
public:
    /** A joint seat: a set of mesh nodes tied to a master point. **/
    struct Interface {
        std::string name;
        std::array<double, 3> position{};  ///< master point s_I, from the centre of mass, in B [m]
        std::vector<double> Phi;  ///< 3×n_f translation of the master per mode [m/√kg/m …]
        std::vector<double> Psi;  ///< 3×n_f rotation of the master per mode [rad per unit ξ]
        std::vector<int> nodes;   ///< mesh indices of the tied nodes, ascending
        TieType tie = TieType::Rigid;
        std::vector<double> weights = {};  ///< of a distributing tie: per node, sum 1; else empty
    };

    /** Where the numbers came from; free text for people and for `simflex info`. **/
    struct Provenance {
        std::string source;   ///< deck or matrix file
        std::string program;  ///< FE program and version
        std::string created;  ///< ISO 8601 date and time, empty if not recorded
        std::string units = "m kg s";
    };

    /** Geometric stiffness by loads in equilibrium with the part's inertia. Loads other than these,
    such as forces on nodes, stiffen nothing.

    The modes' stiffness under angular velocity ω, forces F_k and moments on the interfaces is
    Ω² + Σ_ab ω_aω_b K_ab + Σ_k F_k K_k; it enters through the kinematics: I₂ᵢⱼ lessened by K_ab,
    and displacement and rotation vector of each interface (of exp, see InterfaceKinematics.h) by −½
    ξᵀK_k ξ.
    **/
    struct Stiffening {
        /** K_ab by component as I₂ (xx yy zz xy xz yz), n_f×n_f, symmetric; a mixed product's half
        stands for each of ab and ba. **/
        std::array<std::vector<double>, 6> turning;
        /** For each interface K_k of unit forces x, y, z and unit moments x, y, z on its master, in
        B; n_f×n_f, symmetric. **/
        std::vector<std::array<std::vector<double>, 6>> interfaces;
    };

    /** Cauchy stress and small strain of each mode, averaged over the elements at a node, in B.
    Row 6·k + component belongs to nodes[k]; components xx yy zz xy xz yz, of strain the tensor's
    (half the engineering shear). Single precision: linear recovery is no more exact. **/
    struct ModalStress {
        std::vector<int> nodes;     ///< mesh indices, ascending
        std::vector<float> stress;  ///< (6·nodes)×n_f, column-major [Pa per unit ξ]
        std::vector<float> strain;  ///< the same [1 per unit ξ]
    };

    /** Of a finer twin: what its motion has of the shapes that the part itself lacks, its further
    normal modes in ascending frequency, then its further static shapes. They are orthonormal in
    energy and orthogonal to all others, φ_jᵀKφ_k = δ_jk with interfaces held. **/
    struct Further {
        std::vector<double> coordinates;    ///< m×n_f: φᵀKΦ, of a motion ξ [√J per unit ξ]
        std::vector<double> displacements;  ///< m, largest of each shape [m/√J]
    };

    /** How stiffness and mass change with a number of the model, the modes kept as they are:

        ΦᵀK(p)Φ ≈ Ω² + (p − value) K,   ΦᵀM(p)Φ ≈ 1 + (p − value) M,   dΩᵢ²/dp = Kᵢᵢ − Ωᵢ² Mᵢᵢ

    The last holds of modes that the basis has exactly, such as all of a part without interfaces.
    Mass, inertia, I₁, I₂ and N are those at `value`; no run reads derivatives. **/
    struct Derivative {
        std::string parameter;  ///< "thickness:SKIN", see DesignParameter.h
        std::string unit;       ///< "Pa", "kg/m^3", "m", "m^2"; "1" of a factor
        double value = 0;       ///< p of the part, in this unit
        std::vector<double> K;  ///< n_f×n_f, symmetric [rad²/s² per unit]
        std::vector<double> M;  ///< n_f×n_f, symmetric [1 per unit]
    };

    std::string name;
    double mass = 0;  ///< m [kg]
    std::array<double, 3>
        centerOfMass{};               ///< in deck coordinates [m]: deck position = s + centerOfMass
    std::array<double, 6> inertia{};  ///< I₀ about the centre of mass: xx yy zz xy xz yz, tensor
                                      ///< sign (xy = −∑mxy) [kg m²]
    int numModes = 0;                 ///< n_f
    std::vector<double> omegaSquared;       ///< n_f, Ω² ascending [rad²/s²]
    std::vector<double> I1;                 ///< 6×n_f, components as in `inertia`
    std::array<std::vector<double>, 6> I2;  ///< per component n_f×n_f, symmetric
    std::array<std::vector<double>, 3> N;   ///< N_a, n_f×n_f, antisymmetric: ∑m (φ_i × φ_j)_a
    std::vector<Interface> interfaces;
    std::optional<Stiffening> stiffening;    ///< if the part was reduced with it
    std::optional<ModalStress> modalStress;  ///< if the part was reduced with it
    std::optional<ReductionReport> report;   ///< how good the reduction is
    std::vector<Derivative> derivatives;     ///< those that the model was read with

    /** The same part with further modes, by which a run knows what the modes left out would change;
    if the part was reduced with it. **/
    std::shared_ptr<const ReducedBody> finer;
    std::optional<Further> further;  ///< of a finer twin

    Mesh mesh;                ///< positions are s: from the centre of mass, in B [m]
    std::vector<double> Phi;  ///< (3·numNodes)×n_f mode shapes on the mesh; row 3·node + axis
    Provenance provenance;

    /** @throws std::out_of_range that names the part, the interface asked for and those that exist.
     * **/
    const Interface& getInterface(const std::string& interfaceName) const;

    /** @throws std::out_of_range that names the part, the parameter asked for and those that it has
    derivatives by. **/
    const Derivative& getDerivative(const std::string& parameter) const;

    /** Largest node displacement |φ_i(s)| of each mode for ξ_i = 1; size n_f. O(nodes·n_f). **/
    std::vector<double> calcLargestModeDisplacements() const;

    /** Radius of the smallest sphere about the centre of mass that holds every node [m]. **/
    double calcRadius() const;

    /** The same part with its stiffness multiplied: Ω² ← factor·Ω², and its derivatives. **/
    ReducedBody withScaledStiffness(double factor) const;

    /** Checks sizes, finiteness, positive mass and inertia, symmetry of I₂ and K, antisymmetry of
    N, that the modes ascend and are mass-normalised (½ tr I₂ᵢⱼ = δᵢⱼ), that node numbers and lists
    of nodes ascend.
    @throws std::invalid_argument that names the part, the quantity, the value found and the value
    allowed. **/
    void validate() const;
};

}  // namespace simflex
