#pragma once
/** @file
The elements of a part: what they are made of and how they are integrated. Internal to fe and
reduction.

Whatever becomes of an element, K, m, stress or geometric stiffness, is a sum over its points:

    K_e = Σ v Bᵀ D B,    m_e = Σ v ρ N Nᵀ,    σ = D B u,    k_σ = Σ v G_i·σ G_j

The rules are CalculiX's, named after its elements (SolidElements.h); beyond them are

- C3D8R: one point with the mean gradients of the element and N = 1/8, and the hourglass stiffness
  c E V Σ|G|² γγᵀ, γ = (1 − G xᵀ) h, of Flanagan and Belytschko (Int. J. Num. Meth. Eng. 17, 1981,
  679–706), c = 0.0005;
- C3D8I: three modes 1 − ξ_a² with gradients taken at the centre and scaled by det J₀/det J (Taylor,
  Beresford, Wilson, Int. J. Num. Meth. Eng. 10, 1976, 1211–1219), as three nodes more,
  u = Σ N_k u_k + Σ (1 − ξ_a²)(u_a − ⅛ Σ u_k), so that rigid motions keep their form;
- shells S3, S4 and S4R: ShellElement.h;
- B32R, a hexahedron of 20 nodes with 2 points along the beam and 5×5 across it, or those of its
  section, in which shear may have points of its own, so that it twists as by Saint-Venant; layered
  S8R and S6, in each layer 2×2 or 3 points in its plane and 2 through
  it.

CalculiX 2.20 takes off but the last of C3D8R's three terms of G xᵀ and leaves det J₀/det J out of
C3D8I, so that both fail the patch test where they are distorted; setCalculixSlips() does as it
does, for comparison. **/

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

/** All points of an element. **/
struct ElementPoints {
    std::vector<ElementPoint> points;
    bool hasOneLaw = false;     ///< D is the same everywhere, and B that of G
    Eigen::MatrixXd hourglass;  ///< K of each direction besides, n×n [N/m]; may be empty

    bool haveSameStiffness(const ElementPoints& other) const;
    bool haveSameMass(const ElementPoints& other) const;
};

/** What an element is made of, from below. **/
struct ElementLayer {
    double thickness = 1;  ///< in any unit: its share counts
    int material = 0;
    int orientation = -1;  ///< −1: the deck's axes
};

class FeElements {
public:
    struct Material {
        ElasticMatrix law{};          ///< in its own axes [Pa]
        double density = 0;           ///< [kg/m³]
        std::optional<double> young;  ///< of an isotropic law [Pa]
    };

    /** @returns its index, as of the others. **/
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

    /** Sets the points of an element of the mesh.
    @throws std::invalid_argument naming it if it is turned inside out. **/
    void calcPoints(int element, const Mesh& mesh, ElementPoints& points) const;

    /** Those whose stress is put out; getExtrapolation() carries it to the nodes. **/
    void calcStressPoints(int element, const Mesh& mesh, ElementPoints& points) const;
    /** nodes×points, row by row. @throws std::invalid_argument naming a type without stress. **/
    const std::vector<double>& getExtrapolation(int element) const;

    /** The mesh, densities and laws are in other units from now on: factors of a length, a stress
    and a density. **/
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

    /** For comparison with CalculiX 2.20, see above. **/
    void setCalculixSlips(bool isOn) { m_hasCalculixSlips = isOn; }

private:
    using Rule = std::shared_ptr<const std::vector<IntegrationPoint>>;

    enum class Strains { All, Shear, AllButShear };  ///< of a beam, between axis and section

    /** Points that share a material. **/
    struct Zone {
        Rule points;  ///< none of shells
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
    std::vector<Element> m_elements{Element{}};  ///< and one behind the last
    std::vector<int> m_nodes;
    /** By type and the part of the thickness, −1…1. **/
    std::map<std::tuple<std::string, double, double>, Rule> m_rules;
    std::map<std::string, std::vector<double>> m_extrapolations;
    double m_length = 1, m_stress = 1, m_density = 1;
    bool m_hasCalculixSlips = false;
};

}  // namespace simflex
