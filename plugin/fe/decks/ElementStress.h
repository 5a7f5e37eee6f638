#pragma once
/** @file
Stress and strain at the nodes of a part under given displacements, as CalculiX would give them.
Internal to fe and reduction.

Strain from the gradients of the shape functions at CalculiX's integration points (of C3D8R: their
mean over the element), stress by the law of each element's material in its *ORIENTATION; both are
carried to the nodes of each element (makeExtrapolation()) and averaged over the elements at a node,
whatever their materials. CalculiX itself does the same with tables of four to six digits; its table
for C3D6 (2.20) confuses the ends of the wedge, which is not followed. **/

#include <map>

#include "ElasticLaw.h"
#include "simflex/base/Progress.h"
#include "simflex/fe/FeModel.h"
#include "simflex/fe/SolidElements.h"

namespace simflex {

class ElementStress {
public:
    /** Reads the deck anew.
    @param model  as readCalculixDeck() gave it; must outlive this
    @throws std::invalid_argument if model.source is no deck, or for a material that is not known.
    @throws std::runtime_error if the deck has changed since the model was read. **/
    explicit ElementStress(const FeModel& model);

    /** Checks that elements and materials make the stiffness of the model, by the energy of the six
    uniform strains. O(entries of K).
    @throws std::invalid_argument naming the strains and both energies if not. **/
    void checkAgainstStiffness() const;

    /** Components xx yy zz xy xz yz, in the deck's axes; of strain the tensor's.
    @param nodes    mesh indices
    @param fields   3·numNodes×count displacements, column-major
    @param stress   (6·nodes)×count, column-major, set
    @param strain   the same
    Time O(elements at the nodes · count); the same bits for any number of threads.
    @throws std::out_of_range for an index outside the mesh. @throws Cancelled. **/
    void calcAtNodes(const std::vector<int>& nodes, const double* fields, int count, float* stress,
                     float* strain, const ProgressCallback& progress = {}) const;

    /** Stress and strain at one integration point. **/
    struct PointStress {
        int element = 0;  ///< number in the deck
        int point = 0;    ///< CalculiX's, from 1
        std::array<double, 6> stress{}, strain{};
    };

    /** At all integration points; elements by type, then as the deck has them. **/
    std::vector<PointStress> calcAtPoints(const double* field) const;

private:
    struct Type {
        std::vector<IntegrationPoint> points;
        std::vector<IntegrationPoint> averaged;  ///< of C3D8R: those its gradients are the mean of
        std::vector<double> extrapolation;       ///< nodes×points
    };
    struct Material {
        ElasticMatrix law{};   ///< in the deck's axes, unless the axes are cylindrical
        int cylindrical = -1;  ///< index of the orientation
        bool isDefined = false;
    };
    struct Element {
        int number = 0;
        const Type* type = nullptr;
        int material = 0;
        std::vector<int> nodes;
    };
    /** An integration point in space. **/
    struct Place {
        double volume = 0;
        std::vector<std::array<double, 3>> gradients;
        ElasticMatrix law{};
    };

    void locate(const Element& element, std::vector<Place>& places) const;
    void calcGroup(const std::vector<int>& rowOf, const std::vector<int>& touched, size_t numRows,
                   const double* fields, int count, float* stress, float* strain) const;

    const FeModel& m_model;
    std::map<std::string, Type> m_types;
    std::vector<Orientation> m_orientations;
    std::vector<Material> m_materials;
    std::vector<Element> m_elements;
};

}  // namespace simflex
