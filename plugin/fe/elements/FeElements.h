#pragma once
/** @file
The elements of a part, their materials and integration. Internal to fe and reduction.

All results of an element, K, m, stress or geometric stiffness, are sums over its points:

    K_e = Σ v Bᵀ D B,    m_e = Σ v ρ N Nᵀ,    σ = D B u,    k_σ = Σ v G_i·σ G_j

The integration rules are CalculiX's, named after its elements (SolidElements.h), with the following
extensions:

- C3D8R: one point with the mean gradients of the element and N = 1/8, and the hourglass stiffness c
  E V Σ|G|² γγᵀ, γ = (1 − G xᵀ) h, of Flanagan and Belytschko (Int. J. Num. Meth. Eng. 17, 1981,
  679–706), c = 0.0005;
- C3D8I: three modes 1 − ξ_a² with gradients evaluated at the centre and scaled by det J₀/det J
  (Taylor, Beresford, Wilson, Int. J. Num. Meth. Eng. 10, 1976, 1211–1219), as three additional
  nodes, u = Σ N_k u_k + Σ (1 − ξ_a²)(u_a − ⅛ Σ u_k), so that rigid motions keep their form;
- shells S3, S4 and S4R: ShellElement.h;
- B32R, a hexahedron of 20 nodes with 2 points along the beam and 5×5 across it, or those of its
  section, in which shear may have points of its own, so that it twists as by Saint-Venant; layered
  S8R and S6, in each layer 2×2 or 3 points in its plane and 2 through
  it.

CalculiX 2.20 subtracts only the last of C3D8R's three terms of G xᵀ and omits det J₀/det J in
C3D8I, so that both fail the patch test if distorted; setCalculixSlips() reproduces this for
comparison. **/

#include <Eigen/Dense>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "ElasticLaw.h"
#include "ElementPoint.h"
#include "ShellElement.h"
#include "SolidElements.h"
#include "simflex/fe/FeModel.h"

namespace simflex {

/** All integration points of an element. **/
struct ElementPoints {
    std::vector<ElementPoint> points;
    bool hasOneLaw = false;     ///< uniform D, and B computed from G
    Eigen::MatrixXd hourglass;  ///< additional K of each direction, n×n [N/m]; may be empty

    bool haveSameStiffness(const ElementPoints& other) const;
    bool haveSameMass(const ElementPoints& other) const;
};

/** A layer of an element; layers are listed from below. **/
struct ElementLayer {
    double thickness = 1;  ///< in any unit: only the ratio matters
    int material = 0;
    int orientation = -1;  ///< −1: the deck's axes
};

class FeElements {
public:
    struct Material {
        ElasticMatrix law{};          ///< in the material's axes [Pa]
        double density = 0;           ///< [kg/m³]
        std::optional<double> young;  ///< of an isotropic law [Pa]
    };

    /** @returns its index; so do the other functions. **/
    int addMaterial(const Material& material);
    int addOrientation(const Orientation& orientation);
    /** What elements of a type are made of.
    @param section  of a beam; without points, its 5×5. A law that is not isotropic takes all
        strains at its points. **/
    int addMakeup(const std::string& type, const std::vector<ElementLayer>& layers,
                  const BeamRule& section = {});
    /** @param nodes  mesh indices; of C3D8I its three internal ones, too **/
    void addElement(int number, int makeup, const std::vector<int>& nodes);

    int size() const { return int(m_elements.size()) - 1; }
    int numberOf(int element) const { return m_elements[size_t(element)].number; }
    int numNodesOf(int element) const {
        return int(m_elements[size_t(element) + 1].firstNode -
                   m_elements[size_t(element)].firstNode);
    }
    const int* nodesOf(int element) const {
        return &m_nodes[m_elements[size_t(element)].firstNode];
    }
    const std::string& typeOf(int element) const { return makeupOf(element).type; }

    /** Computes the points of an element of the mesh.
    @throws std::invalid_argument naming it if it is inverted. **/
    void calcPoints(int element, const Mesh& mesh, ElementPoints& points) const;

    /** Computes the points of stress output; getExtrapolation() extrapolates it to the nodes. **/
    void calcStressPoints(int element, const Mesh& mesh, ElementPoints& points) const;
    /** Returns nodes×points, row-major. @throws std::invalid_argument naming a type without
    stress. **/
    const std::vector<double>& getExtrapolation(int element) const;

    /** Converts densities and laws to the units of a converted mesh, by the factors of length,
    stress and density. **/
    void convertUnits(double length, double stress, double density);

    /** √(E/ρ), the median of all elements [m/s]; 0 without any. O(elements). **/
    double calcWaveSpeed() const;

    /** What the part has beside these elements. **/
    struct Beside {
        bool hasSprings = false, hasHinged = false;  ///< trusses, membranes
        std::vector<std::vector<int>> rigidBodies;   ///< mesh indices that move as one
        /** Rigid bodies that hang on each other or hold nodes in some directions alone. **/
        bool hasOtherBodies = false;
        SymmetricMatrix K;  ///< of springs and hinged elements, 3·node + axis; may be empty [N/m]
    } beside;

    /** Reproduces CalculiX 2.20 for comparison, see above. **/
    void setCalculixSlips(bool isOn) { m_hasCalculixSlips = isOn; }

private:
    using Rule = std::shared_ptr<const std::vector<IntegrationPoint>>;

    enum class Strains { All, Shear, AllButShear };  ///< of a beam, between axis and section

    /** Points that share a material. **/
    struct Zone {
        Rule points;  ///< empty for shells
        int material, orientation;
        double from = -1, to = 1;  ///< of the thickness
        Strains strains = Strains::All;
    };
    struct Makeup {
        std::string type;
        std::string extrapolation;  ///< its name in m_extrapolations
        std::vector<Zone> zones;
    };
    struct Element {
        int number = 0, makeup = 0;
        size_t firstNode = 0;
    };

    const Makeup& makeupOf(int element) const {
        return m_makeups[size_t(m_elements[size_t(element)].makeup)];
    }
    ElasticMatrix calcLaw(int material, int orientation, const std::array<double, 3>& at) const;
    void calcAtZones(int element, const std::vector<Zone>& zones, const Mesh& mesh,
                     ElementPoints& points) const;
    void calcUniform(int element, const Mesh& mesh, ElementPoints& points) const;
    void addIncompatibleModes(int element, const Mesh& mesh, ElementPoints& points) const;
    void calcShell(int element, const Mesh& mesh, ElementPoints& points) const;
    void calcShellStress(int element, const Mesh& mesh, ElementPoints& points) const;
    std::vector<ShellLayer> makeShellLayers(int element, const Eigen::Matrix3Xd& x) const;

    std::vector<Material> m_materials;
    std::vector<Orientation> m_orientations;
    std::vector<Makeup> m_makeups;
    std::vector<Element> m_elements{Element{}};  ///< with one past the end
    std::vector<int> m_nodes;
    /** By type and range through the thickness, −1…1. **/
    std::map<std::tuple<std::string, double, double>, Rule> m_rules;
    std::map<std::string, std::vector<double>> m_extrapolations;
    double m_length = 1, m_stress = 1, m_density = 1;
    bool m_hasCalculixSlips = false;
};

}  // namespace simflex
