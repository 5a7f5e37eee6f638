#pragma once
/** @file
A flexible part after Craig–Bampton reduction: constant, shared by all bodies made from it.

Its deformation is `u(s) = Φ(s) ξ`. The n_f modes are free-free shapes of the part with tied
interfaces: M-orthonormal (`ΦᵀMΦ = 1`), with diagonal stiffness `ΦᵀKΦ = Ω²`, and orthogonal to the
rigid-body modes. Frame B is the mean-axis frame: origin at the undeformed centre of mass, axes
parallel to those of the deck.

Kinetic energy with angular velocity ω in B, and C_a(ξ) = ξᵀN_a:

    T = ½ m|v|² + ½ ωᵀ(I₀ + ξᵢ I₁ᵢ + ξᵢξⱼ I₂ᵢⱼ)ω + ωᵀ C ξ̇ + ½|ξ̇|²

Geometric stiffening (see Stiffening) reduces I₂ᵢⱼ and makes interface displacements second order.

All matrices are column-major. SI units. Standard types only, so that reduction does not need
Simbody and users do not need Eigen. **/

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "simflex/part/Mesh.h"
#include "simflex/part/ReductionReport.h"

namespace simflex {

/** How the nodes of an interface are tied to its master point: they follow it rigidly (RBE2), or
the master is their weighted mean, which adds no stiffness (RBE3). **/
enum class TieType { Rigid, Distributing };

class ReducedBody {
public:
    /** A joint seat: a set of mesh nodes tied to a master point. **/
    struct Interface {
        std::string name;
        std::array<double, 3> position{};  ///< master point s_I, from the centre of mass, in B [m]
        std::vector<double> Phi;           ///< 3×n_f translation of the master [m per unit ξ]
        std::vector<double> Psi;           ///< 3×n_f rotation of the master [rad per unit ξ]
        std::vector<int> nodes;            ///< mesh indices of the tied nodes, ascending
        TieType tie = TieType::Rigid;
        std::vector<double> weights = {};  ///< of a distributing tie: one per node, sum 1; else
                                           ///< empty
    };

    /** Origin of the data; free text, shown by `simflex info`. **/
    struct Provenance {
        std::string source;   ///< deck or matrix file
        std::string program;  ///< FE program and version
        std::string created;  ///< ISO 8601 date and time, empty if not recorded
        std::string units = "m kg s";
    };

    /** Geometric stiffness due to loads in equilibrium with the part's inertia. Other loads, such
    as forces on nodes, cause no stiffening.

    The modal stiffness under angular velocity ω and interface forces and moments F_k is Ω² + Σ_ab
    ω_aω_b K_ab + Σ_k F_k K_k. It is part of the kinematics: K_ab is subtracted from I₂ᵢⱼ, and −½
    ξᵀK_k ξ is added to the displacement and rotation vector of each interface (see
    InterfaceKinematics.h). **/
    struct Stiffening {
        /** K_ab in the components of I₂ (xx yy zz xy xz yz), n_f×n_f, symmetric; half of a mixed
        product belongs to ab, half to ba. **/
        std::array<std::vector<double>, 6> turning;
        /** K_k of unit forces x, y, z and unit moments x, y, z on the master of each interface, in
        B; n_f×n_f, symmetric. **/
        std::vector<std::array<std::vector<double>, 6>> interfaces;
    };

    /** Cauchy stress and small strain of each mode in B, averaged over the elements at a node. Row
    6·k + component belongs to nodes[k]; components xx yy zz xy xz yz, tensor shear strain (half the
    engineering shear). Single precision, which exceeds the accuracy of linear recovery. **/
    struct ModalStress {
        std::vector<int> nodes;     ///< mesh indices, ascending
        std::vector<float> stress;  ///< (6·nodes)×n_f, column-major [Pa per unit ξ]
        std::vector<float> strain;  ///< the same [1 per unit ξ]
    };

    /** Data of a finer twin: its shapes that the part itself lacks, further normal modes in
    ascending frequency, then further static shapes. They are orthonormal in energy and orthogonal
    to all others, φ_jᵀKφ_k = δ_jk with interfaces held. **/
    struct Further {
        std::vector<double> coordinates;    ///< m×n_f: φᵀKΦ [√J per unit ξ]
        std::vector<double> displacements;  ///< m, largest displacement of each shape [m/√J]
    };

    /** Derivatives of stiffness and mass with respect to a parameter of the FE model, for fixed
    modes:

        ΦᵀK(p)Φ ≈ Ω² + (p − value) K,   ΦᵀM(p)Φ ≈ 1 + (p − value) M,   dΩᵢ²/dp = Kᵢᵢ − Ωᵢ² Mᵢᵢ

    The last equation holds for modes that the basis represents exactly, such as all modes of a part
    without interfaces. Mass, inertia, I₁, I₂ and N are those at `value`; runs do not use
    derivatives. **/
    struct Derivative {
        std::string parameter;  ///< "thickness:SKIN", see DesignParameter.h
        std::string unit;       ///< "Pa", "kg/m^3", "m", "m^2"; "1" for a factor
        double value = 0;       ///< p of this part, in this unit
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
    std::optional<Stiffening> stiffening;    ///< if the reduction computed it
    std::optional<ModalStress> modalStress;  ///< if the reduction computed it
    std::optional<ReductionReport> report;   ///< accuracy of the reduction
    std::vector<Derivative> derivatives;     ///< for the parameters chosen when the model was read

    /** The same part with further modes, with which a run estimates the effect of truncation; if
    the part was reduced with them. **/
    std::shared_ptr<const ReducedBody> finer;
    std::optional<Further> further;  ///< of a finer twin

    Mesh mesh;                ///< positions are s: from the centre of mass, in B [m]
    std::vector<double> Phi;  ///< (3·numNodes)×n_f mode shapes on the mesh; row 3·node + axis
    Provenance provenance;

    /** @throws std::out_of_range naming the part, the interface asked for and the existing
    ones. **/
    const Interface& getInterface(const std::string& interfaceName) const;

    /** @throws std::out_of_range naming the part, the parameter asked for and the existing
    ones. **/
    const Derivative& getDerivative(const std::string& parameter) const;

    /** Returns the largest node displacement |φ_i(s)| of each mode for ξ_i = 1; size n_f.
    O(nodes·n_f). **/
    std::vector<double> calcLargestModeDisplacements() const;

    /** Returns the radius of the smallest sphere about the centre of mass that contains all nodes
    [m]. **/
    double calcRadius() const;

    /** Returns the part with its stiffness scaled: Ω² ← factor·Ω², with all quantities that depend
    on it. **/
    ReducedBody withScaledStiffness(double factor) const;

    /** Checks sizes, finiteness, positive mass and inertia, symmetry of I₂ and K, antisymmetry of
    N, ascending and mass-normalised modes (½ tr I₂ᵢⱼ = δᵢⱼ), ascending node numbers and node lists.
    @throws std::invalid_argument naming the part, the quantity, the value found and the value
    allowed. **/
    void validate() const;
};

}  // namespace simflex
