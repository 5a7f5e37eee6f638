#include "simflex/model/session/KeptState.h"
#include "simflex/base/NumberText.h"
#include "simflex/base/UnfinishedFile.h"

#include <cmath>
#include <fstream>
#include <sstream>
#include <stdexcept>

namespace simflex {
namespace model {

using SimTK::State;
using SimTK::Vector;

namespace {

const char* const kTitle = "simflex state";
constexpr int kStateVersion = 1;

std::string formatVector(const char* name, const Vector& values) {
    std::string line = name;
    for (int i = 0; i < values.size(); ++i) line += ' ' + writeGeneral(values[i]);
    return line + '\n';
}

/** Lines of a file, each of which begins with the name that is wanted. **/
class Lines {
public:
    explicit Lines(const std::string& path) : _path(path), _file(path) {
        if (!_file) throw std::runtime_error("cannot read '" + path + "'");
    }

    [[noreturn]] void fail(const std::string& what) const {
        throw std::runtime_error("'" + _path + "' " + what);
    }

    std::string next(const std::string& name) {
        std::string line;
        if (!std::getline(_file, line) || line.compare(0, name.size(), name) != 0)
            fail("is damaged: there is no '" + name + "' where it belongs");
        return line.substr(name.size());
    }

    Vector nextVector(const std::string& name, int size) {
        std::istringstream text(next(name));
        text.imbue(std::locale::classic());
        std::vector<double> values;
        for (double value; text >> value;) values.push_back(value);
        for (const double value : values)
            if (!std::isfinite(value)) fail("is damaged: '" + name + "' is not finite");
        if (int(values.size()) != size)
            fail("is of another model: it has " + std::to_string(values.size()) + " values of '" +
                 name + "', this one has " + std::to_string(size));
        return Vector(size, values.data());
    }

private:
    std::string _path;
    std::ifstream _file;
};

}  // namespace

void writeKeptState(const std::string& path, const Model& model, const State& state) {
    std::string text = kTitle + (' ' + std::to_string(kStateVersion)) + '\n';
    for (const Model::BodyEntry& body : model.getBodies()) {
        const bool isFlexible = body.flexible && !body.flexible->isRigid(state);
        text += std::string("body ") + (isFlexible ? "flexible " : "rigid ") + body.name + '\n';
    }
    text += formatVector("time", Vector(1, state.getTime())) + formatVector("q", state.getQ()) +
            formatVector("u", state.getU()) + formatVector("z", state.getZ()) + "end\n";
    replaceFile(path, text);
}

State readKeptState(const std::string& path, const Model& model) {
    Lines lines(path);
    std::istringstream head(lines.next(kTitle));
    int version = 0;
    if (!(head >> version)) lines.fail("is damaged: it has no version");
    if (version > kStateVersion)
        lines.fail("is of format " + std::to_string(version) + ", this program knows up to " +
                   std::to_string(kStateVersion));
    State state = model.makeInitialState();
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
    const double time = lines.nextVector("time", 1)[0];
    const Vector q = lines.nextVector("q", state.getNQ()), u = lines.nextVector("u", state.getNU()),
                 z = lines.nextVector("z", state.getNZ());
    lines.next("end");
    state.setTime(time);
    state.updQ() = q;
    state.updU() = u;
    state.updZ() = z;
    try {
        model.getSystem().realize(state, SimTK::Stage::Velocity);
    } catch (const std::exception& error) {
        lines.fail(std::string("holds a state that the model cannot take: ") + error.what());
    }
    return state;
}

}  // namespace model
}  // namespace simflex
