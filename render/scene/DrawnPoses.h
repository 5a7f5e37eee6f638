#pragma once
/** @file
Where bodies are drawn whose deformation is exaggerated. Internal to the renderer.

Exaggerated parts would leave their joints. So bodies are moved, with the exaggerated shapes of
their parts held, until every joint has the errors e₀ again that it has in the State: by
Levenberg–Marquardt steps from where the bodies are,

    Δu = −(JᵀJ + μW)⁻¹ Jᵀ (e − e₀),

J of rigid motions alone, W the squares of the displacements that speeds mean, of turns at half the
assembly's radius: what is not held by joints moves as little as it can, and a chain whose links are
drawn longer gets longer instead of folding itself up. A loop that cannot close is left open in the
sense of least squares: rather in the directions of axes than in gaps, rather elsewhere than at
joints with Ground. What comes out is a function of the State alone, as smooth from picture to
picture as the motion.

Driven joints keep their drives; couplers, joints that are disabled and those that have come apart
are left out. **/

#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "ReferenceMotion.h"
#include "Simbody.h"
#include "simflex/body/Attachment.h"
#include "simflex/body/FlexibleBodySubsystem.h"

namespace simflex {

class DrawnPoses {
public:
    /** Measures deformation of parts from their mean axes, instead of from their joints: the first
    one with Ground or else the first one, as far as that holds the frame on the part. A pin does
    not hold it about its axis, unless it is driven. **/
    void setMeanAxes(bool areMeant) { usesMeanAxes = areMeant; }
    /** Measures deformation of the part that it is on from a frame. **/
    void setReference(const Attachment& frame) {
        chosen.insert_or_assign(frame.getFlexibleBodyIndex(), frame);
    }

    /** Those whose deformation is exaggerated; empty: all. **/
    void setBodies(std::set<FlexibleBodyIndex> exaggerated) { bodies = std::move(exaggerated); }

    /** Finds the poses of a State. @pre realized to Stage::Position; outlives the use of this **/
    void update(const SimTK::System& system, const SimTK::State& state, double factor);

    /** The State with bodies where they are drawn; modal coordinates are the true ones.
    Stage::Position. **/
    const SimTK::State& getState() const { return isMoved ? moved : *given; }
    double getFactor() const { return factor; }
    /** In Ground, of a frame as it is drawn. **/
    SimTK::Transform calcPose(const Attachment& frame) const;
    /** What the deformation of a body is measured from. **/
    ReferenceMotion calcReference(FlexibleBodyIndex body) const;
    /** The frame that it is; empty: the mean axes. **/
    std::string getReferenceName(FlexibleBodyIndex body) const;

    /** The joint whose seats are drawn farthest apart, against their true distance [m]. **/
    struct Gap {
        std::string joint;
        double distance = 0;
    };
    const Gap& getLargestGap() const { return gap; }

private:
    struct Reference {
        Attachment frame;
        SimTK::Mat33 held;  ///< projects rotation vectors in B on axes about which it is held
    };
    class Closing;

    void findReferences();

    std::set<FlexibleBodyIndex> bodies;
    bool usesMeanAxes = false;
    std::map<FlexibleBodyIndex, Attachment> chosen;
    std::map<FlexibleBodyIndex, Reference> references;
    const FlexibleBodySubsystem* flexible = nullptr;
    const SimTK::SimbodyMatterSubsystem* matter = nullptr;
    const SimTK::State* given = nullptr;
    double factor = 1;
    bool isMoved = false;
    SimTK::State moved;
    Gap gap;
};

}  // namespace simflex
