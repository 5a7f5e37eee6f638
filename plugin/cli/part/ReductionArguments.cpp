#include "simflex/cli/part/ReductionArguments.h"
#include "simflex/base/AsciiText.h"
#include "simflex/base/NumberText.h"
#include "simflex/cli/Options.h"
#include "simflex/part/TextLines.h"

#include <algorithm>
#include <cstdio>

namespace simflex {
namespace cli {
namespace {

StressOptions parseStress(const std::string& text) {
    StressOptions options;
    if (text == "skin") return options;
    options.nodes = StressOptions::Nodes::All;
    if (text == "all") return options;
    options.nodes = StressOptions::Nodes::Sets;
    if (text.find(':') != std::string::npos) {  // a shape, whose numbers have commas
        options.sets = {text};
        return options;
    }
    options.sets = splitAt(text, ',');
    for (const std::string& set : options.sets)
        if (set.empty())
            throw CLI::ValidationError("--stress", "'" + text + "' is not all, skin or SET,SET…");
    return options;
}

}  // namespace

void ReductionArguments::addTo(CLI::App& command) {
    addRepeated(command, "-i,--interface", _rigid,
                "joint seat tied rigidly to its master point. NODES: a node set or surface, or "
                "sphere:x,y,z,r, cylinder:x,y,z,ax,ay,az,r[,length], plane:x,y,z,nx,ny,nz in "
                "metres",
                "NAME=NODES");
    addRepeated(command, "--distributing", _distributing,
                "joint seat whose master point is the mean of its nodes and stiffens nothing",
                "NAME=NODES");
    addRepeated(command, "--master", _masters,
                "master point of an interface [m] (default: middle of its surface or volume; "
                "of a cylinder, on its axis)",
                "NAME=X,Y,Z");
    addRepeated(command, "--load-point", _loadPoints,
                "static (attachment) modes for forces on NODES (also node:NUMBER), along x, y "
                "and z or the AXES given",
                "NODES[=AXES]");
    CLI::Option* modes = command.add_option(
        "-m,--modes", _numModes,
        "Craig-Bampton modes, 6 per interface among them; the part keeps 6 fewer");
    modes->capture_default_str()->check(makePositiveCheck());
    command
        .add_option("--up-to", _highestFrequency,
                    "all normal modes up to this frequency, instead of --modes")
        ->type_name("HZ")
        ->check(makePositiveCheck())
        ->excludes(modes);
    command
        .add_option("--check", _numCheckedModes,
                    "compare so many frequencies of the part with those of the full model")
        ->type_name("COUNT")
        ->check(makePositiveCheck());
    command.add_flag("--stress{skin}", _stress,
                     "stress and strain of the modes at the nodes of the part's skin, at `all`, or "
                     "at NODES (--stress=SET,SET or =sphere:x,y,z,r)");
    command
        .add_option("--memory", _memory,
                    "memory the reduction may take; more is refused before K is factored (default: "
                    "what the machine has left)")
        ->type_name("GIB")
        ->check(makePositiveCheck());
}

ReductionOptions ReductionArguments::parse() const {
    ReductionOptions options;
    for (const std::string& text : _rigid) {
        const auto [name, nodes] = splitAssignment("--interface", text);
        options.interfaces.emplace_back(name, nodes);
    }
    for (const std::string& text : _distributing) {
        const auto [name, nodes] = splitAssignment("--distributing", text);
        options.interfaces.emplace_back(name, nodes, TieType::Distributing);
    }
    for (const std::string& text : _masters) {
        const auto [name, point] = splitAssignment("--master", text);
        std::array<double, 3> x{};
        const std::vector<std::string> numbers = splitAt(point, ',');
        bool isPoint = numbers.size() == 3;
        for (size_t k = 0; isPoint && k < 3; ++k)
            isPoint = readNumber(trimBlanks(numbers[k]), x[k]);
        if (!isPoint)
            throw CLI::ValidationError("--master", "'" + text + "' is not of the form NAME=X,Y,Z");
        bool found = false;
        for (InterfaceOptions& interface : options.interfaces)
            if (interface.name == name) interface.master = x, found = true;
        if (!found) throw CLI::ValidationError("--master", "there is no interface '" + name + "'");
    }
    for (const std::string& text : _loadPoints) {
        const size_t equals = text.find('=');
        LoadPoint point{text.substr(0, equals)};
        if (equals != std::string::npos) point.axes = text.substr(equals + 1);
        if (point.nodes.empty())
            throw CLI::ValidationError("--load-point", "'" + text + "' names no nodes");
        options.loadPoints.push_back(point);
    }
    options.numModes = _numModes;
    if (_highestFrequency > 0) options.highestFrequency = _highestFrequency;
    options.numCheckedModes = _numCheckedModes;
    if (!_stress.empty()) options.stress = parseStress(_stress);
    if (_memory > 0) options.memoryLimit = _memory * 1073741824;
    return options;
}

}  // namespace cli
}  // namespace simflex
