#pragma once
/** @file
The aeroengine stator of C. Yang et al., Appl. Sci. 2025, 15(8), 4541: five flexible casings along
the engine axis, bolted flange to flange.

    Ground ══ two balls ══ connector ── compressor casing ── combustion chamber ── turbine casing
                                                                        nozzle ──╯
    Ground ══ ball ══ nozzle

x is the engine axis from front to rear, y is up. The connector hangs in two hinges at its sides,
the nozzle stands on one below. Compressor and turbine casing carry a bearing of the rotor. The
rotor itself is not modelled, only what its unbalance does to the bearings while it is run up from
rest:

    F = m e (ω² e_r − ω̇ e_t)   in each bearing, e_r turning with the rotor

The paper gives no dimensions and loads: those of the parts are in examples/parts, the rest is in
StatorOptions. **/

#include <array>

#include "Simbody.h"
#include "simflex/body/FlexibleBody.h"
#include "simflex/body/Joint.h"
#include "support/LinearModel.h"

namespace simflex::examples {

struct StatorOptions {
    double speed = 250;             ///< of the rotor after the run-up [Hz]
    double runUp = 1.5;             ///< duration [s]
    double frontUnbalance = 0.004;  ///< m e at the compressor casing's bearing [kg m]
    double rearUnbalance = 0.004;   ///< turbine casing's bearing, a quarter turn behind [kg m]
    double gravity = 9.81;          ///< [m/s²]
    double damping = 0.05;          ///< of each part's modes, as a part of critical

    /** Rotor angle, rate and acceleration [rad, rad/s, rad/s²]; acceleration is continuous. **/
    SimTK::Vec3 calcAngle(double time) const;
};

class StatorModel {
public:
    enum Bearing { FrontBearing, RearBearing };
    static constexpr int NumParts = 5;
    /** Names of the parts' files, from front to rear. **/
    static const std::array<const char*, NumParts>& getPartNames();

    /** @param parts  in the order of getPartNames() **/
    StatorModel(const StatorOptions& options,
                const std::vector<std::shared_ptr<const ReducedBody>>& parts);
    StatorModel(const StatorModel&) = delete;  // its forces refer to it
    StatorModel& operator=(const StatorModel&) = delete;

    /** Undeformed and at rest, as gravity would not act. **/
    SimTK::State makeUndeformedState();
    /** At rest in the static equilibrium of small displacements. **/
    SimTK::State makeInitialState();

    /** Small motions about the undeformed state. **/
    LinearModel makeLinearModel();

    std::vector<FlexibleBody> getBodies() const {
        return {connector, compressor, chamber, turbine, nozzle};
    }
    Attachment getBearing(Bearing bearing) const;

    /** Force of the unbalance on a bearing, in Ground [N]. **/
    SimTK::Vec3 calcUnbalanceForce(Bearing bearing, double time) const;
    /** How far a bearing has moved from its undeformed place, in Ground [m]. Stage::Velocity. **/
    SimTK::Vec3 calcBearingDisplacement(const SimTK::State& state, Bearing bearing) const;
    /** Amplitude of a bearing's vertical and lateral motion at constant speed, by modal
    superposition [m]. @param speed  [Hz] **/
    SimTK::Vec2 calcSteadyAmplitude(const LinearModel& linear, Bearing bearing, double speed) const;

    /** @name Pictures **/
    /**@{**/
    /** The rotor, with a blade that has lost its tip opposite to the unbalance. **/
    void addRotorDecorations(double angle,
                             SimTK::Array_<SimTK::DecorativeGeometry>& geometry) const;
    /** A part whose displacements include the small motion of its frame, which stays where it is
    undeformed: what is exaggerated then still fits together. Six rigid modes follow its own. **/
    std::shared_ptr<const ReducedBody> makePicturePart(const FlexibleBody& body) const;
    SimTK::Transform getUndeformedPose(const FlexibleBody& body) const;
    SimTK::Vector calcPictureCoordinates(const FlexibleBody& body, const SimTK::State& state) const;
    /**@}**/

    const StatorOptions& getOptions() const { return m_options; }

private:
    void addStand();

    StatorOptions m_options;

public:
    SimTK::MultibodySystem system;
    SimTK::SimbodyMatterSubsystem matter;
    SimTK::GeneralForceSubsystem forces;
    SimTK::Force::Gravity gravity;
    FlexibleBodySubsystem flexible;  // after the other forces
    FlexibleBody connector, compressor, chamber, turbine, nozzle;
    Joint::Ball leftHinge, rightHinge, rearHinge;
    Joint::Weld compressorFlange, chamberFlange, turbineFlange, nozzleFlange;
};

}  // namespace simflex::examples
