#include "simflex/model/session/KeptState.h"

#include "simflex/base/Archive.h"
#include "simflex/base/Hash.h"
#include "simflex/base/NumberText.h"
#include "simflex/base/UnfinishedFile.h"
#include "simflex/model/Session.h"
#include "simflex/model/analyses/StateNumbers.h"
#include "simflex/part/TextLines.h"

namespace simflex {
namespace model {

using SimTK::State;

namespace {

const char* const StateTitle = "simflex state";
constexpr int StateVersion = 4;

std::string formatLine(const char* name, const std::vector<double>& values) {
    std::string line = name;
    for (const double value : values) line += ' ' + writeGeneral(value);
    return line + '\n';
}

/** Rest of the next line, which must begin with `name`. **/
std::string readLine(TextLines& lines, const std::string& name) {
    if (!lines.next() || lines.line().substr(0, name.size()) != name)
        lines.refuse("the state is damaged: there is no '" + name + "' where it belongs");
    return std::string(lines.line().substr(name.size()));
}

std::vector<double> readNumbers(TextLines& lines, const std::string& name, int size) {
    const std::string text = readLine(lines, name);
    std::vector<std::string_view> fields;
    splitFields(text, fields);
    if (int(fields.size()) != size)
        lines.refuse("the state is of another model: it has " + std::to_string(fields.size()) +
                     " values of '" + name + "', this one has " + std::to_string(size));
    std::vector<double> values;
    for (const std::string_view field : fields)
        values.push_back(lines.parseNumber(field, name.c_str()));
    return values;
}

void visitNumbers(Archive& archive, SimTK::Vector& numbers) {
    std::vector<double> values = toNumbers(numbers);
    archive.visit(values);
    if (int(values.size()) != numbers.size())
        throw std::runtime_error("the state is of another model: it has other coordinates");
    numbers = toVector(values);
}

/** Visits a State's flags, time, coordinates, speeds and z. **/
void visitState(Archive& archive, const Model& model, State& state) {
    for (const Model::BodyEntry& body : model.getBodies()) {
        if (!body.flexible) continue;
        bool isRigid = body.flexible->isRigid(state);
        archive.visit(isRigid);
        if (!archive.isReading()) continue;
        if (isRigid)
            body.flexible->setRigid(state);
        else
            body.flexible->setFlexible(state);
    }
    SimTK::Vector holding = model.getFlexibleBodies().getHolding(state);
    visitNumbers(archive, holding);
    if (archive.isReading()) {
        model.getFlexibleBodies().setHolding(state, holding);
        model.getSystem().realizeModel(state);
    }
    double time = state.getTime();
    SimTK::Vector y = state.getY();
    archive.visit(time);
    visitNumbers(archive, y);
    if (!archive.isReading()) return;
    state.setTime(time);
    state.updY() = y;
    model.getSystem().realize(state, SimTK::Stage::Velocity);
}

}  // namespace

void visitSaved(Archive& archive, const Model& model, SavedState& saved) {
    Hash hash;
    hash.add(saved.model);
    std::uint64_t sum = hash.get();
    archive.visit(sum);
    if (sum != hash.get()) throw std::runtime_error("the state is of another model");
    visitState(archive, model, saved.begun);
    archive.visit(saved.integrator, saved.warnings, saved.energyBefore);
}

void writeKeptState(const std::string& path, const Model& model, const State& state) {
    checkReplaceable(path, StateTitle, "kept state");
    const std::vector<std::string> controllers = model.getFile().get("controllers").getKeys();
    if (!controllers.empty())
        throw std::runtime_error("a file of a state does not have what controller '" +
                                 controllers.front() + "' remembers: nothing is kept");
    std::string text = StateTitle + (' ' + std::to_string(StateVersion)) + '\n';
    for (const Model::BodyEntry& body : model.getBodies()) {
        const bool isFlexible = body.flexible && !body.flexible->isRigid(state);
        text += std::string("body ") + (isFlexible ? "flexible " : "rigid ") + body.name + '\n';
    }
    text += formatLine("time", {state.getTime()}) + formatLine("q", toNumbers(state.getQ())) +
            formatLine("u", toNumbers(state.getU())) + formatLine("z", toNumbers(state.getZ())) +
            formatLine("holding", toNumbers(model.getFlexibleBodies().getHolding(state))) + "end\n";
    replaceFile(path, text);
}

State readKeptState(const std::string& path, const Model& model) {
    TextLines lines(path, "state");
    const int version = lines.parseInteger(trimBlanks(readLine(lines, StateTitle)), "the version");
    if (version != StateVersion)
        lines.refuse("the state is of format " + std::to_string(version) +
                     ", this program reads format " + std::to_string(StateVersion));
    State state = model.makeInitialState();
    for (const Model::BodyEntry& body : model.getBodies()) {
        const std::string line = readLine(lines, "body ");
        const bool isFlexible = line.compare(0, 9, "flexible ") == 0;
        if (line != (isFlexible ? "flexible " : "rigid ") + body.name)
            lines.refuse("the state is of another model: its bodies are not the same ('" +
                         body.name + "')");
        if (!body.flexible) continue;
        if (isFlexible)
            body.flexible->setFlexible(state);
        else
            body.flexible->setRigid(state);
    }
    const double time = readNumbers(lines, "time", 1)[0];
    const auto q = readNumbers(lines, "q", state.getNQ()),
               u = readNumbers(lines, "u", state.getNU());
    setNumbers(state, time, q, u);
    state.updZ() = toVector(readNumbers(lines, "z", state.getNZ()));
    const FlexibleBodySubsystem& flexible = model.getFlexibleBodies();
    const int numHolding = flexible.getHolding(state).size();
    flexible.setHolding(state, toVector(readNumbers(lines, "holding", numHolding)));
    readLine(lines, "end");
    try {
        model.getSystem().realize(state, SimTK::Stage::Velocity);
    } catch (const std::exception& error) {
        lines.refuse(std::string("the model cannot take this state: ") + error.what());
    }
    return state;
}

}  // namespace model
}  // namespace simflex
