#pragma once
/** @file
Contour values at the skin nodes of a part. Internal to the renderer.

Linear quantities are matrix products in single precision; invariants are computed from them:

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
    /** @throws std::invalid_argument naming the body and the remedy if stress is requested and its
    part was reduced without, or has none on its skin. **/
    ContourField(std::shared_ptr<const SkinModes> skin, Contour contour,
                 const std::string& bodyName);

    /** Returns whether the contour shows displacements, which are relative to a reference. **/
    bool isOfDisplacements() const { return !needsStress() && !getTraits(contour).needsVelocity; }

    /** Returns whether every skin node has a value; missing values are NaN. **/
    bool isComplete() const {
        return !needsStress() || int(stressNodes.size()) == skin->numNodes();
    }

    struct Workspace {
        std::vector<float> values;  ///< one per skin node
    private:
        friend class ContourField;
        std::vector<float> coordinates, first, second;  // products
    };

    /** Computes the values. O(skin nodes·n_f).
    @param displacements  Φξ, 3 per skin node; relative to the part's reference for displacement
    contours
    @return the smallest and the largest value
    @throws std::invalid_argument naming the part if ξ or ξ̇ has the wrong size. **/
    Extremes calcValues(const PartSnapshot& motion, const std::vector<float>& displacements,
                        Workspace& workspace) const;

    /** Adds the part's stress, which SkinModes do not contain. **/
    void addTo(Hash& hash) const;

private:
    // Rows of a matrix with n_f columns.
    struct Rows {
        const float* data = nullptr;
        std::size_t numRows = 0, stride = 0;
        std::vector<float> own;  // copy, if rows must be selected
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
    std::vector<int> stressPlaces;  // their indices in the modal stress
    Rows shapes, stress, strain;
};

}  // namespace simflex
