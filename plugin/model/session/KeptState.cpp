#include "simflex/model/session/KeptState.h"
#include "simflex/base/NumberText.h"
#include "simflex/base/UnfinishedFile.h"
#include "simflex/model/analyses/StateNumbers.h"
#include "simflex/model/probes/TurnCounter.h"

#include <cmath>
#include <fstream>
#include <sstream>
#include <stdexcept>

namespace simflex {
namespace model {

using SimTK::State;

namespace {

const char* const StateTitle = "simflex state";
constexpr int StateVersion = 2;

std::string formatLine(const char* name, const std::vector<double>& values) {
    std::string line = name;
    for (const double value : values) line += ' ' + writeGeneral(value);
    return line + '\n';
}

/** Lines of a file, each of which begins with the name that is wanted. **/
class Lines {
public:
    explicit Lines(const std::string& path) : m_path(path), m_file(path) {
        if (!m_file) throw std::runtime_error("cannot read '" + path + "'");
    }

    [[noreturn]] void fail(const std::string& what) const {
        throw std::runtime_error("'" + m_path + "' " + what);
    }

    std::string next(const std::string& name) {
        std::string line;
        if (!std::getline(m_file, line) || line.compare(0, name.size(), name) != 0)
            fail("is damaged: there is no '" + name + "' where it belongs");
        return line.substr(name.size());
    }

    std::vector<double> nextNumbers(const std::string& name, int size) {
        std::istringstream text(next(name));
        text.imbue(std::locale::classic());
        std::vector<double> values;
        for (double value; text >> value;) values.push_back(value);
        for (const double value : values)
            if (!std::isfinite(value)) fail("is damaged: '" + name + "' is not finite");
        if (int(values.size()) != size)
            fail("is of another model: it has " + std::to_string(values.size()) + " values of '" +
                 name + "', this one has " + std::to_string(size));
        return values;
    }

private:
    std::string m_path;
    std::ifstream m_file;
};

}  // namespace

void writeKeptState(const std::string& path, const Model& model, const KeptState& kept) {
    const State& state = kept.state;
    std::string text = StateTitle + (' ' + std::to_string(StateVersion)) + '\n';
    for (const Model::BodyEntry& body : model.getBodies()) {
        const bool isFlexible = body.flexible && !body.flexible->isRigid(state);
        text += std::string("body ") + (isFlexible ? "flexible " : "rigid ") + body.name + '\n';
    }
    text += formatLine("time", {state.getTime()}) + formatLine("q", toNumbers(state.getQ())) +
            formatLine("u", toNumbers(state.getU())) + formatLine("z", toNumbers(state.getZ())) +
            formatLine("turns", kept.turns) + "end\n";
    replaceFile(path, text);
}

KeptState readKeptState(const std::string& path, const Model& model) {
    Lines lines(path);
    std::istringstream head(lines.next(StateTitle));
    int version = 0;
    if (!(head >> version)) lines.fail("is damaged: it has no version");
    if (version != StateVersion)
        lines.fail("is of format " + std::to_string(version) + ", this program reads format " +
                   std::to_string(StateVersion));
    KeptState kept{model.makeInitialState(), TurnCounter(model).save()};
    State& state = kept.state;
    for (const Model::BodyEntry& body : model.getBodies()) {
        const std::string line = lines.next("body ");
        const bool isFlexible = line.compare(0, 9, "flexible ") == 0;
        if (line != (isFlexible ? "flexible " : "rigid ") + body.name)
            lines.fail("is of another model: its bodies are not the same ('" + body.name + "')");
        if (!body.flexible) continue;
        if (isFlexible)
            body.flexible->setFlexible(state);
        else
            body.flexible->setRigid(state);
    }
    const double time = lines.nextNumbers("time", 1)[0];
    const auto q = lines.nextNumbers("q", state.getNQ()), u = lines.nextNumbers("u", state.getNU());
    setNumbers(state, time, q, u);
    state.updZ() = toVector(lines.nextNumbers("z", state.getNZ()));
    kept.turns = lines.nextNumbers("turns", int(kept.turns.size()));
    lines.next("end");
    try {
        model.getSystem().realize(state, SimTK::Stage::Velocity);
    } catch (const std::exception& error) {
        lines.fail(std::string("holds a state that the model cannot take: ") + error.what());
    }
    return kept;
}

}  // namespace model
}  // namespace simflex
