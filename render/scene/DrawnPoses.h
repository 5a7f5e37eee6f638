#pragma once
/** @file
Drawn poses of bodies with exaggerated deformation. Internal to the renderer.

Exaggerated parts would separate from their joints. Bodies are therefore moved, with their
exaggerated shapes held, until every joint has the same errors e₀ as in the State, by
Levenberg–Marquardt steps from the State's poses,

    Δu = −(JᵀJ + μW)⁻¹ Jᵀ (e − e₀),

with J of rigid motions only, and W the squares of the displacements caused by unit speeds (for
rotations at half the assembly's radius). Motions that joints leave free are thus minimal, and a
chain with lengthened links is extended instead of folded. A loop that cannot be closed is left open
in the least-squares sense: preferably in the directions of axes rather than in gaps, and away from
joints with Ground. The result is a function of the State alone and as smooth as the motion.

Driven joints keep their drives. Couplers, disabled joints and those that have come apart are
ignored. **/

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
    /** Measures the deformation of parts from their mean axes instead of their joints. The default
    is the first joint with Ground or else the first joint, in the directions in which it holds the
    frame on the part; a pin does not hold it about its axis, unless it is driven. **/
    void setMeanAxes(bool areMeant) { usesMeanAxes = areMeant; }
    /** Measures the deformation of a part from a frame on it. **/
    void setReference(const Attachment& frame) {
        chosen.insert_or_assign(frame.getFlexibleBodyIndex(), frame);
    }

    /** Selects the bodies whose deformation is exaggerated; empty: all. **/
    void setBodies(std::set<FlexibleBodyIndex> exaggerated) { bodies = std::move(exaggerated); }

    /** Computes the poses of a State. @pre the State is realized to Stage::Position and outlives
    the use of this object **/
    void update(const SimTK::System& system, const SimTK::State& state, double factor);

    /** Returns the State with bodies at their drawn poses; modal coordinates are not exaggerated.
    Stage::Position. **/
    const SimTK::State& getState() const { return isMoved ? moved : *given; }
    double getFactor() const { return factor; }
    /** Returns the drawn pose of a frame, in Ground. **/
    SimTK::Transform calcPose(const Attachment& frame) const;
    /** Returns the reference motion of a body's deformation. **/
    ReferenceMotion calcReference(FlexibleBodyIndex body) const;
    /** Returns the name of the reference frame; empty: mean axes. **/
    std::string getReferenceName(FlexibleBodyIndex body) const;

    /** The joint with the largest drawn gap, beyond its true one [m]. **/
    struct Gap {
        std::string joint;
        double distance = 0;
    };
    const Gap& getLargestGap() const { return gap; }

private:
    struct Reference {
        Attachment frame;
        SimTK::Mat33 held;  ///< projects rotation vectors in B onto the constrained axes
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
