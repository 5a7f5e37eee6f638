/** @file
Commands of the prompt that list the model's contents and current quantities. **/

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "simflex/base/Interruption.h"
#include "simflex/base/Progress.h"
#include "simflex/body/JointEquations.h"
#include "simflex/cli/Format.h"
#include "simflex/cli/Messages.h"
#include "simflex/cli/shell/Shell.h"
#include "simflex/model/file/NearestName.h"
#include "simflex/model/file/ScalarCheck.h"
#include "simflex/model/session/JointDrag.h"
#include "simflex/solver/Eigenmodes.h"
#include "simflex/solver/StaticEquilibrium.h"

namespace simflex {
namespace cli {

using SimTK::State;

namespace {

std::string formatPlace(const SimTK::Vec3& p) {
    return formatNumber(p[0]) + ", " + formatNumber(p[1]) + ", " + formatNumber(p[2]);
}

// ---- list

void listBodies(Shell& shell) {
    const Session& session = shell.updSession();
    TextTable table({"body", "kind", "mass [kg]", "place [m]", "largest displacement [m]"});
    for (const Model::BodyEntry& body : session.getModel().getBodies()) {
        std::string kind = "rigid", displacement = "-";
        if (body.flexible) {
            kind = std::to_string(body.flexible->getNumModes()) + " modes";
            if (body.flexible->isRigid(session.getState())) kind += ", held rigid";
            displacement = formatNumber(body.flexible->calcLargestDisplacement(session.getState()));
        }
        const SimTK::Transform X_GP = body.mobod.getBodyTransform(session.getState()) * body.X_BP;
        table.add({body.name, kind,
                   formatNumber(body.mobod.getBodyMassProperties(session.getState()).getMass()),
                   formatPlace(X_GP.p()), displacement});
    }
    writeOut("%s", table.format().c_str());
}

void listJoints(Shell& shell) {
    const Session& session = shell.updSession();
    TextTable table({"joint", "type", "from", "to", "coordinates", "error"});
    for (const Model::JointEntry& entry : session.getModel().getJoints()) {
        const Joint& joint = entry.joint;
        const std::vector<std::string> names = getCoordinateNames(joint);
        const SimTK::Vector values =
            names.empty() ? SimTK::Vector() : joint.calcCoordinates(session.getState());
        std::string coordinates;
        for (size_t i = 0; i < names.size(); ++i)
            coordinates += (i ? ", " : "") + names[i] + ' ' + formatNumber(values[int(i)]);
        const bool isCoupler = joint.getEquations().isCoupler();
        table.add(
            {entry.name, joint.getEquations().getKind(),
             isCoupler ? "-" : joint.getFrameF().getName(),
             isCoupler ? "-" : joint.getFrameM().getName(), coordinates,
             formatNumber(SimTK::max(SimTK::abs(joint.calcPositionErrors(session.getState()))))});
    }
    writeOut("%s", table.format().c_str());
    for (const std::string& line : session.getIntegrator().getRedundantConstraints())
        writeOut("%s\n", line.c_str());
}

void listMotions(Shell& shell) {
    const Session& session = shell.updSession();
    TextTable table({"motion", "now", "position"});
    for (const Model::MotionEntry& motion : session.getModel().getMotions())
        table.add({motion.name, formatNumber(motion.position.calcValue(session.getTime())),
                   motion.position.getText()});
    writeOut("%s", table.format().c_str());
}

void listModes(Shell& shell, const std::string& name) {
    const Session& session = shell.updSession();
    const Model::BodyEntry& body = findNamed(session.getModel().getBodies(), "body", name);
    if (!body.flexible) throw std::runtime_error("'" + name + "' is rigid: it has no modes");
    const FlexibleBody& flexible = *body.flexible;
    const SimTK::Vector xi = flexible.getModalCoordinates(session.getState());
    const SimTK::Vector energies = flexible.calcModalStrainEnergies(session.getState());
    TextTable table({"mode", "frequency [Hz]", "coordinate", "strain energy [J]"});
    for (int i = 0; i < flexible.getNumModes(); ++i) {
        const double omegaSquared = flexible.getPart().omegaSquared[size_t(i)];
        table.add({std::to_string(i + 1), formatNumber(std::sqrt(omegaSquared) / (2 * SimTK::Pi)),
                   formatNumber(xi[i]), formatNumber(energies[i])});
    }
    writeOut("%s", table.format().c_str());
}

void listProbes(Shell& shell) {
    TextTable table({"probe", "unit", "parts"});
    for (const Probe& probe : shell.updSession().getProbes()) {
        std::string columns;
        for (const std::string& column : probe.columns)
            columns += (columns.empty() ? "" : ", ") + column;
        table.add({probe.name, probe.unit, columns});
    }
    writeOut("%s", table.format().c_str());
}

void listParameters(Shell& shell) {
    const ModelValue parameters = shell.updSession().getModel().getFile().get("parameters");
    TextTable table({"parameter", "value"});
    for (const std::string& name : parameters.getKeys())
        table.add({name, formatNumber(parameters.get(name).getNumber())});
    writeOut("%s", table.format().c_str());
}

void listFrames(Shell& shell) {
    const Session& session = shell.updSession();
    TextTable table({"frame", "on", "place [m]"});
    const auto add = [&](const std::string& name) {
        const Attachment frame = session.getModel().findFrame(name);
        const SimTK::Vec3 place = frame.calcMotion(session.getState()).X.p();
        table.add({name, frame.getName(), formatPlace(place)});
    };
    for (const std::string& name : session.getModel().getFile().get("frames").getKeys()) add(name);
    for (const Model::BodyEntry& body : session.getModel().getBodies())
        if (body.flexible)
            for (const auto& interface : body.flexible->getPart().interfaces)
                add(body.name + '.' + interface.name);
    writeOut("%s", table.format().c_str());
}

void listStates(Shell& shell) {
    const Session& session = shell.updSession();
    TextTable table({"state", "value"});
    for (const auto& [name, value] : session.getModel().getStates())
        table.add({name, formatNumber(value.calcValue(session.getModel().getFlexibleBodies(),
                                                      session.getState()))});
    writeOut("%s", table.format().c_str());
}

const struct NamedList {
    const char* name;
    void (*print)(Shell&);  ///< null: requires a body
} NamedLists[] = {{"bodies", listBodies}, {"joints", listJoints}, {"motions", listMotions},
                  {"modes", nullptr},     {"probes", listProbes}, {"parameters", listParameters},
                  {"frames", listFrames}, {"states", listStates}};

void printList(Shell& shell, const Words& words) {
    const NamedList& list = findNamed(NamedLists, "list of", words[0]);
    if (!list.print && words.size() < 2)
        throw std::runtime_error("the body is missing: write 'list modes BODY'");
    if (!list.print) return listModes(shell, words[1]);
    if (words.size() > 1) throw std::runtime_error("'" + words[1] + "' is too much");
    list.print(shell);
}

// ---- probe, energy

void printProbes(Shell& shell, const Words& words) {
    const Session& session = shell.updSession();
    for (const std::string& name : words.empty() ? getNames(session.getProbes()) : words) {
        const Probe* probe = seekNamed(session.getProbes(), name);
        if (!probe && isName(name, false)) probe = &findNamed(session.getProbes(), "probe", name);
        writeOut("%s = %s\n", name.c_str(),
                 probe ? formatValues(session.calcProbe(*probe), probe->unit).c_str()
                       : formatNumber(session.calcFormula(name)).c_str());
    }
}

void printEnergy(Shell& shell, const Words&) {
    const Session& session = shell.updSession();
    const FlexibleBodySubsystem& bodies = session.getModel().getFlexibleBodies();
    const State& state = session.getState();
    double strain = 0;
    for (const Model::BodyEntry& body : session.getModel().getBodies())
        if (body.flexible) strain += body.flexible->calcStrainEnergy(state);
    const double total = session.calcEnergy(), work = session.getIntegrator().getWork();
    const std::pair<const char*, double> lines[] = {
        {"kinetic", bodies.calcKineticEnergy(state)},
        {"strain", strain},
        {"gravity, springs", bodies.calcPotentialEnergy(state) - strain},
        {"total", total},
        {"work of loads, motions and dampers", work},
        {"error of the balance", total - session.getEnergyBefore() - work}};
    for (const auto& [name, value] : lines)
        writeOut("%-34s  %s J\n", name, formatNumber(value).c_str());
}

// ---- eigen

/** Returns the body with the largest displacement in a mode, and whether it deforms. **/
std::string findLargest(const Model& model, const Linearization& linear, const Eigenmode& mode) {
    std::string largest = "-";
    double size = 0;
    const auto look = [&](const SimTK::MobilizedBody& mobod, const std::string& text) {
        double sum = 0;
        const int first = mobod.getFirstUIndex(linear.state);
        for (int i = first; i < first + mobod.getNumU(linear.state); ++i)
            sum += std::norm(mode.shape[i]) * linear.metres[i] * linear.metres[i];
        if (sum <= size) return;
        size = sum;
        largest = text;
    };
    for (const Model::BodyEntry& body : model.getBodies()) {
        look(body.mobod, body.name);
        if (!body.flexible) continue;
        for (int k = 0; k < body.flexible->getNumModalMobilizers(); ++k)
            look(body.flexible->getModalMobilizer(k), body.name + ", deformed");
    }
    return largest;
}

/** Prints one row per motion: a rigid-body motion may have two eigenvalues ± due to round-off. **/
void printEigenmodes(Shell& shell, const Words& words) {
    const Session& session = shell.updSession();
    const int count = words.empty() ? 10 : shell.calcCount(words[0], 10000);
    const SimTK::MultibodySystem& system = session.getModel().getSystem();
    const auto observe = [] {
        if (wasInterrupted()) throw Cancelled("nothing has changed");
    };
    const Linearization linear = calcLinearization(
        system, findEquilibriumNearby(system, session.copyState(), observe), observe);
    requireEquilibrium(system, linear);
    const std::vector<Eigenmode> modes = calcEigenmodes(linear);
    TextTable table({"mode", "frequency [Hz]", "damping [%]", "moves most"});
    int numMotions = 0;
    bool hasPartner = false;
    for (const Eigenmode& mode : modes) {
        const bool isFree = mode.isUncertain();
        const bool oscillates = mode.eigenvalue.imag() != 0;
        hasPartner = isFree && !oscillates && !mode.isRigidMotion() && !hasPartner;
        const bool isSecond = isFree && !oscillates && !mode.isRigidMotion() && !hasPartner;
        if (isSecond || ++numMotions > count) continue;
        const std::string damping = isFree                  ? "rigid-body mode"
                                    : oscillates            ? formatNumber(100 * mode.dampingRatio)
                                    : mode.dampingRatio > 0 ? "decays"
                                                            : "grows";
        table.add({std::to_string(numMotions), isFree ? "0" : formatNumber(mode.frequency), damping,
                   findLargest(session.getModel(), linear, mode)});
    }
    writeOut("%s", table.format().c_str());
    if (numMotions > count) writeOut("%d modes in all\n", numMotions);
    for (const std::string& line : session.getIntegrator().getRedundantConstraints())
        writeOut("%s\n", line.c_str());
}

std::vector<std::string> completeList(const Shell& shell, const Words& before, const std::string&) {
    if (before.empty()) return getNames(NamedLists);
    std::vector<std::string> names;
    if (before[0] == "modes" && before.size() == 1 && shell.hasSession())
        for (const Model::BodyEntry& body : shell.updSession().getModel().getBodies())
            if (body.flexible) names.push_back(body.name);
    return names;
}

}  // namespace

void addListCommands(std::vector<Command>& commands) {
    const std::string group = "What there is";
    commands.push_back(
        {group, "list",
         "bodies | joints | motions | modes BODY | probes | parameters | frames | states",
         "List what the model has, as it is now", "", 1, 2, printList, completeList});
    commands.push_back(
        {group, "probe", "[NAME | FORMULA ...]", "Print probes as they are now; alone: all",
         "Formulas may use t, probes, states, parameters and tables: probe 'hypot(tip.x, tip.y)'",
         0, 1000, printProbes, [](const Shell& shell, const Words&, const std::string&) {
             return shell.hasSession() ? getNames(shell.updSession().getProbes())
                                       : std::vector<std::string>();
         }});
    commands.push_back({group, "energy", "", "Print the energies and their balance",
                        "The balance counts from the start, or from the last change by hand.", 0, 0,
                        printEnergy});
    commands.push_back(
        {group, "eigen", "[N]", "Print the natural modes about this state (default: 10)",
         "Rigid-body modes, which nothing restores, come first; 'grows' and 'decays' are modes "
         "that do not\n"
         "oscillate. The speeds of the state count: a rotating body has gyroscopic terms.\n"
         "A state that is neither an equilibrium nor a steady motion has no modes and is refused.",
         0, 1, printEigenmodes});
}

}  // namespace cli
}  // namespace simflex
