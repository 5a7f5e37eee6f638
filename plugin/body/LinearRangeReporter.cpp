#include "simflex/body/LinearRangeReporter.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <iostream>
#include <sstream>
#include <stdexcept>

#include "simflex/body/FlexibleBody.h"
#include "simflex/body/FlexibleBodySubsystemGuts.h"
#include "simflex/body/Joint.h"
#include "simflex/body/ReportInterval.h"
#include "simflex/part/PartColumns.h"

namespace simflex {

using namespace SimTK;
using ::Eigen::Map;
using ::Eigen::MatrixXd;

namespace {

/** How far a body is deformed. **/
struct Deformation {
    Real displacement = 0;  ///< largest displacement of a node [m]
    int nodeNumber = 0;
    Real size = 0;      ///< size of the part [m]
    Real rotation = 0;  ///< largest rotation of an interface [rad]
    std::string interface;

    /** Share of the linear range used; 1 at its limit. **/
    Real calcShare() const {
        return std::max(displacement / (LinearRangeReporter::LargestShare * size),
                        rotation / LinearRangeReporter::LargestRotation);
    }
};

/** @param least  share of the part's size. Nodes are not searched if the modes' own largest
displacements add up to less. **/
Deformation calcDeformation(const FlexibleBodySubsystem::Guts& guts, const State& state,
                            FlexibleBodyIndex index, Real least) {
    const FlexibleBodyRecord& record = guts.body(index);
    const FlexibleBodyModel& model = *record.model;
    const ReducedBody& part = *model.part;
    const ::Eigen::VectorXd xi = guts.getXi(state, record);
    Deformation found;
    found.size = 2 * model.radius;
    if (model.displacementPerMode.dot(xi.cwiseAbs()) > least * found.size) {
        const DisplacementSearch::Largest largest = model.findLargestDisplacement(xi.data());
        found.displacement = largest.displacement;
        found.nodeNumber = part.mesh.nodeNumbers[size_t(largest.node)];
    }
    for (const ReducedBody::Interface& interface : part.interfaces) {
        const Real angle =
            (Map<const MatrixXd>(interface.Psi.data(), 3, part.numModes) * xi).norm();
        if (!(angle > found.rotation)) continue;
        found.rotation = angle;
        found.interface = interface.name;
    }
    return found;
}

std::string toThreeDigits(Real value) {
    std::ostringstream text;
    text.precision(3);
    text << value;
    return text.str();
}

std::string describeDisplacement(const Deformation& found) {
    return "node " + std::to_string(found.nodeNumber) + " is displaced by " +
           toThreeDigits(found.displacement) + " m, " +
           toThreeDigits(100 * found.displacement / found.size) + " % of the part's size (" +
           toThreeDigits(found.size) + " m); modes describe deformations up to 10 % of it";
}

std::string describeRotation(const Deformation& found) {
    return "interface '" + found.interface + "' is rotated by " + toThreeDigits(found.rotation) +
           " rad relative to the body's frame; modes describe up to 0.2 rad";
}

/** Describes the joint with the largest position error, "joint 'pin' was open by 0.3 m"; "" if all
are closed. **/
std::string describeWidestJoint(const FlexibleBodySubsystem& subsystem, State state) {
    constexpr Real Closed = 1e-9;  // [m, rad]
    const SimbodyMatterSubsystem& matter = subsystem.getGuts().getMatter();
    subsystem.getMultibodySystem().realize(state, Stage::Velocity);
    Real largest = Closed;
    std::string widest;
    for (JointIndex j(0); j < subsystem.getNumJoints(); ++j) {
        const Joint joint = subsystem.getJoint(j);
        if (matter.getConstraint(joint.getConstraintIndex()).isDisabled(state)) continue;
        const Real error = joint.calcPositionErrors(state).normInf();
        if (!(error > largest)) continue;
        largest = error;
        widest = joint.getName();
    }
    return widest.empty() ? ""
                          : "joint '" + widest + "' is furthest from closed, with an error of " +
                                toThreeDigits(largest) + " (m, rad)";
}

}  // namespace

std::string describeForcedDeformation(const FlexibleBodySubsystem& subsystem, const State& given,
                                      const State& assembled) {
    constexpr Real Further = 1.1;  // a body outside the range may exceed its former deformation by
                                   // this factor
    for (FlexibleBodyIndex b(0); b < subsystem.getNumBodies(); ++b) {
        const auto calc = [&](const State& state) {
            return calcDeformation(subsystem.getGuts(), state, b,
                                   LinearRangeReporter::LargestShare);
        };
        const Deformation found = calc(assembled);
        if (!(found.calcShare() > 1) || !(found.calcShare() > Further * calc(given).calcShare()))
            continue;
        const bool isDisplaced =
            found.displacement > LinearRangeReporter::LargestShare * found.size;
        const std::string widest = describeWidestJoint(subsystem, given);
        return "to close the joints, assembly would deform flexible body '" +
               subsystem.getBody(b).getName() + "' beyond its linear range: " +
               (isDisplaced ? describeDisplacement(found) : describeRotation(found)) +
               (widest.empty() ? "" : "; in the State given " + widest);
    }
    return "";
}

void requireUnforcedShapes(const FlexibleBodySubsystem& subsystem, const State& given,
                           const State& assembled) {
    const std::string deformation = describeForcedDeformation(subsystem, given, assembled);
    if (!deformation.empty()) throw std::runtime_error(deformation);
}

LinearRangeReporter::LinearRangeReporter(const FlexibleBodySubsystem& subsystem, Real interval,
                                         Warn warn)
    : PeriodicEventReporter(checkReportInterval(interval, "LinearRangeReporter")),
      m_subsystem(subsystem),
      m_warn(std::move(warn)) {
    if (!m_warn) m_warn = [](const std::string& text) { std::cerr << "simflex: " << text << '\n'; };
}

void LinearRangeReporter::warnOnce(int body, Kind kind, const std::string& message) const {
    if (m_warned.emplace(body, kind).second) m_warn(message);
}

void LinearRangeReporter::checkAxialLoad(const State& state, FlexibleBodyIndex index) const {
    const FlexibleBodySubsystem::Guts& guts = m_subsystem.getGuts();
    const FlexibleBody body = m_subsystem.getBody(index);
    if (m_warned.count({int(index), Kind::AxialLoad}) > 0 || body.isRigid(state) ||
        body.isStiffeningEnabled(state))
        return;
    const ReducedBody& part = body.getPart();
    std::shared_ptr<PartColumns>& columns = m_columns[&part];
    if (!columns) columns = std::make_shared<PartColumns>(part);
    const ::Eigen::VectorXd xi = guts.getXi(state, guts.body(index));
    const auto [compression, tension] = columns->findLargest(xi.data());
    const bool isPressed = compression.share > LargestCompression;
    if (!isPressed && !(tension.share > LargestTension)) return;
    const PartColumns::Load& load = isPressed ? compression : tension;
    warnOnce(int(index), Kind::AxialLoad,
             "'" + body.getName() + "' at t = " + toThreeDigits(state.getTime()) +
                 " s: without geometric stiffening it is " +
                 (isPressed ? "compressed" : "pulled apart") +
                 (load.to < 0 ? " from interface '" + part.interfaces[size_t(load.from)].name +
                                    "' to its free end by its weight or acceleration, "
                              : " between interfaces '" + part.interfaces[size_t(load.from)].name +
                                    "' and '" + part.interfaces[size_t(load.to)].name + "' by ") +
                 toThreeDigits(load.force) + " N" + (load.to < 0 ? " at the interface" : "") +
                 ", about " + toThreeDigits(load.share) +
                 " times the load at which it would buckle" +
                 (load.to < 0 ? ", held there; " : " on hinges there; ") +
                 (isPressed ? "its bending is too stiff by about that part, and it buckles too "
                              "late or not at all. "
                            : "its bending is too soft by that part and more. ") +
                 (body.hasStiffening() ? "Enable its stiffening ('stiffening: true' of the body)."
                                       : "Reduce its part with stiffening ('stiffening: true' of "
                                         "the part, or 'simflex reduce --stiffening')."));
}

void LinearRangeReporter::handleEvent(const State& state) const {
    for (FlexibleBodyIndex b(0); b < m_subsystem.getNumBodies(); ++b) {
        checkAxialLoad(state, b);
        const Deformation found = calcDeformation(m_subsystem.getGuts(), state, b, LargestShare);
        const bool isDisplaced = found.displacement > LargestShare * found.size;
        const bool isTurned = found.rotation > LargestRotation;
        if (!isDisplaced && !isTurned) continue;
        const std::string at = "'" + m_subsystem.getBody(b).getName() +
                               "' at t = " + toThreeDigits(state.getTime()) + " s: ";
        const char* advice = ". Divide the part into several, or reduce its load.";
        if (isDisplaced)
            warnOnce(int(b), Kind::Displacement, at + describeDisplacement(found) + advice);
        if (isTurned) warnOnce(int(b), Kind::Rotation, at + describeRotation(found) + advice);
    }
}

void requireLinearRange(const FlexibleBodySubsystem& subsystem, const State& state,
                        const std::string& where) {
    constexpr Real FarOutside = 5;
    for (FlexibleBodyIndex b(0); b < subsystem.getNumBodies(); ++b) {
        const FlexibleBody body = subsystem.getBody(b);
        const Deformation found = calcDeformation(subsystem.getGuts(), state, b,
                                                  FarOutside * LinearRangeReporter::LargestShare);
        const bool isDisplaced =
            found.displacement > FarOutside * LinearRangeReporter::LargestShare * found.size;
        if (!isDisplaced && !(found.rotation > FarOutside * LinearRangeReporter::LargestRotation))
            continue;
        throw std::invalid_argument(
            where + ": in the State given flexible body '" + body.getName() + "' is deformed: " +
            (isDisplaced ? describeDisplacement(found) : describeRotation(found)) +
            ". If a run has brought it there, its loads are too large for what modes describe: "
            "stiffen the part, or divide it into several. If SimTK::Assembler or "
            "SimTK::System::project() has, which know no stiffness, call "
            "FlexibleBodySubsystem::lockModes(assembler), or leave the assembly to the integrator");
    }
}

}  // namespace simflex
