#pragma once
/** @file
A chain of equal flexible links, held at one end by Ground:

    Ground ──ball── link 1 ──ball── link 2 ──ball── … ──ball── link N

At first it lies undeformed and at rest along x; gravity acts along −y. All links share one reduced
part, whose interfaces "fork" and "eye" are the two ends: a fork takes up the eye of the link
before. The link of examples/parts has 54 modes. **/

#include <vector>

#include "Simbody.h"
#include "simflex/body/FlexibleBody.h"
#include "simflex/body/Joint.h"

namespace simflex::examples {

struct ChainOptions {
    /** What holds the links together. `FrameBall` is Simbody's own Constraint::Ball between the
    links' body frames, blind to their deformation: for comparisons, not for BdfIntegrator. **/
    enum class Joints { Ball, Pin, Weld, FrameBall };

    int numLinks = 40;
    Joints joints = Joints::Ball;
    double gravity = 9.81;  ///< [m/s²]
    double damping = 0.01;  ///< of each mode, as a part of critical
    double speed = 0;       ///< of a driven pin along z that stands for the first joint [rad/s]
};

class ChainModel {
public:
    /** @param part  interfaces "fork" and "eye", the second at +x from the first
    @throws std::invalid_argument if there is no link at all. **/
    ChainModel(const ChainOptions& options, std::shared_ptr<const ReducedBody> part);

    /** The straight, undeformed chain at rest. O(numLinks). **/
    SimTK::State makeInitialState();

    /** Distance of a link's two ends, undeformed [m]. **/
    double getPitch() const { return m_pitch; }
    double getLength() const { return m_pitch * m_options.numLinks; }

    /** Location of the free end, the last link's eye [m]. Stage::Position. **/
    SimTK::Vec3 calcTip(const SimTK::State& state) const;

private:
    /** Location on the part of an interface's master point with ξ multiplied, in B. **/
    SimTK::Vec3 calcPoint(const FlexibleBody& link, const SimTK::State& state,
                          const std::string& interface, double factor) const;
    void addJoints(const ReducedBody& part);
    void addDecorations(const ReducedBody& part);

    ChainOptions m_options;
    double m_pitch;

public:
    SimTK::MultibodySystem system;
    SimTK::SimbodyMatterSubsystem matter;
    SimTK::GeneralForceSubsystem forces;
    SimTK::Force::Gravity gravity;
    FlexibleBodySubsystem flexible;  // after the other forces
    std::vector<FlexibleBody> links;
    std::vector<Joint> joints;  ///< joints[k] holds the fork of links[k]; none with FrameBall
};

}  // namespace simflex::examples
