#pragma once
/** @file
Values of a contour at the skin nodes of a part. Internal to the renderer.

Linear quantities are one matrix product each, their rows kept in single precision; invariants are
taken of the products:

    u = Φξ,   v_B = R_BG v_GB + ω_B×(s + u) + Φξ̇,   σ = Sξ,   ε = Eξ

The field is constant and shared by threads; each has its own workspace. **/

#include <memory>
#include <string>
#include <vector>

#include "ContourScale.h"
#include "SkinModes.h"

namespace simflex {

class Hash;
struct PartSnapshot;

class ContourField {
public:
    /** @throws std::invalid_argument that names the body and what to do when stress is wanted and
    its part was reduced without, or has none on its skin. **/
    ContourField(std::shared_ptr<const SkinModes> skin, Contour contour,
                 const std::string& bodyName);

    /** True of displacements, which are shown from a reference. **/
    bool isOfDisplacements() const { return !needsStress() && !getTraits(contour).needsVelocity; }

    /** True if every skin node has a value; the others' are NaN. **/
    bool isComplete() const {
        return !needsStress() || int(stressNodes.size()) == skin->numNodes();
    }

    struct Workspace {
        std::vector<float> values;  ///< one per skin node
    private:
        friend class ContourField;
        std::vector<float> coordinates, first, second;  // products
    };

    /** Writes the values.
    @param displacements  Φξ, 3 per skin node; from the part's reference if they are shown
    @return the smallest and the largest
    @throws std::invalid_argument that names the part, when ξ or ξ̇ has another size.
    O(skin nodes·n_f). **/
    Extremes calcValues(const PartSnapshot& motion, const std::vector<float>& displacements,
                        Workspace& workspace) const;

    /** Adds the stress it has of the part, which SkinModes have not. **/
    void addTo(Hash& hash) const;

private:
    // Rows of a matrix with n_f columns.
    struct Rows {
        const float* data = nullptr;
        std::size_t numRows = 0, stride = 0;
        std::vector<float> own;  // where they had to be picked
    };

    bool needsStress() const { return getTraits(contour).needsStress; }
    Rows pickRows(const std::vector<float>& tensors) const;
    void multiply(const Rows& rows, const SimTK::Vector& coordinates, Workspace& workspace,
                  std::vector<float>& product) const;
    void calcOfDisplacements(const std::vector<float>& displacements,
                             std::vector<float>& values) const;
    void calcOfVelocities(const PartSnapshot& motion, const std::vector<float>& displacements,
                          Workspace& workspace) const;
    void calcOfTensors(Workspace& workspace) const;

    std::shared_ptr<const SkinModes> skin;
    Contour contour;
    std::vector<int> stressNodes;   // skin nodes with stress, ascending
    std::vector<int> stressPlaces;  // their places in the modal stress
    Rows shapes, stress, strain;
};

}  // namespace simflex
