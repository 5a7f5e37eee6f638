/** @file
Result files: bytes changed despite the checksum must be detected; objects changed by another
program give results or a refusal; a damaged journal gives rows that were written, or none. **/

#include "FuzzHdf5.h"
#include "simflex/model/results/ResultWriter.h"

using namespace simflex;

namespace {

constexpr int kRows = 12;

/** Results with every kind of content, and their journal as left by a kill. **/
struct Files {
    std::string results, journal;
};

const Files& getFiles() {
    static const Files files = [] {
        const std::string path = fuzz::getFolder() / "base.h5";
        Files made;
        const std::vector<ResultColumn> probes = {{"tip", "m", {"x", "y"}}, {"angle", "rad", {""}}};
        {
            model::ResultWriter writer(path, {"Title",
                                              "m.yaml",
                                              "simflex: 1\n",
                                              {"speed=1"},
                                              false,
                                              "0.1",
                                              {{"the part of body 'a'", "0f"}}});
            Results::Analysis rest, modes, map, control;
            rest.name = "rest", rest.type = "static", rest.q = {{4}},
            rest.stateColumns["q"] = {"a"};
            rest.probes = {{probes[0], {{1, 2}}}, {probes[1], {{3}}}};
            modes.name = "modes", modes.type = "eigen", modes.frequency = {{1, 2}};
            modes.dampingRatio = {{0.1, 0.2}};
            map.name = "map", map.type = "campbell", map.speeds = {0, 1}, map.isComplete = true;
            map.frequency = {{1, 2}, {3, 4}}, map.dampingRatio = {{0, 0}, {0, 0}};
            control.name = "control", control.type = "linear";
            control.inputs = {"loads.push"}, control.inputUnits = {"N"};
            control.outputs = {"tip.x"}, control.outputUnits = {"m"};
            control.matrices = {
                {"A", {{0, 1}, {-4, 0}}}, {"B", {{0}, {1}}}, {"C", {{1, 0}}}, {"D", {{0}}}};
            for (const Results::Analysis& analysis : {rest, modes, map, control})
                writer.add(analysis);
            writer.beginTransient("run", probes, {{"q", {"a"}}, {"u", {"b"}}});
            for (int k = 0; k < kRows; ++k) {
                writer.addRow(k, {1.0 * k, 2.0 * k, 3.0 * k}, {4.0 * k, 5.0 * k});
                if (k == 5) {
                    writer.setStatistics("run", {{"steps", 7}});
                    writer.setComplete("map");
                }
            }
            const auto read = [](const std::string& name) {
                std::ifstream in(name, std::ios::binary);
                return std::string(std::istreambuf_iterator<char>(in), {});
            };
            made.results = read(path);
            made.journal = read(path + ".rows");
        }
        return made;
    }();
    return files;
}

const char* const kObjects[] = {"model",
                                "analyses",
                                "analyses/rest",
                                "analyses/rest/probes/tip",
                                "analyses/rest/states/q",
                                "analyses/modes",
                                "analyses/modes/frequency",
                                "analyses/modes/damping_ratio",
                                "analyses/map/speeds",
                                "analyses/map/frequency",
                                "analyses/map/damping_ratio",
                                "analyses/run",
                                "analyses/run/time",
                                "analyses/run/probes",
                                "analyses/run/probes/tip",
                                "analyses/run/probes/angle",
                                "analyses/run/states",
                                "analyses/run/states/q",
                                "analyses/run/states/u",
                                "analyses/run/statistics",
                                "."};
const char* const kAttributes[] = {"simflex_results", "version", "title",   "path", "settings",
                                   "bodies",          "type",    "columns", "unit", "index",
                                   "complete",        "steps"};

/** Readable rows must match written ones. **/
void checkRows(const Results& data) {
    for (const auto& analysis : data.analyses) {
        if (analysis.name != "run") continue;
        for (size_t k = 0; k < analysis.time.size(); ++k)
            if (analysis.time[k] != double(k) ||
                analysis.probes.at(1).rows.at(k).at(0) != 3.0 * double(k))
                fuzz::fail("a row that was never written");
    }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    fuzz::Input input(data, size);
    Files files = getFiles();
    const unsigned kind = input.take() % 8;
    const std::string journal = fuzz::getFolder() / "run.h5.rows";
    std::remove(journal.c_str());
    if (kind == 0 && !fuzz::changeBytes(files.results, input)) return 0;
    const std::string path = fuzz::getFolder().write("run.h5", files.results);
    if (kind == 1) {
        std::string& bytes = files.journal;
        if (input.take() % 2) bytes.resize(input.take2() % bytes.size());
        while (!input.empty() && !bytes.empty())
            bytes[input.take2() % bytes.size()] ^= char(input.take());
        fuzz::getFolder().write("run.h5.rows", bytes);
    }
    if (kind > 1) fuzz::changeHdf5(path, kObjects, kAttributes, input);
    const bool accepted = fuzz::accepts([&] {
        const Results results = readResults(path);
        if (kind == 1) checkRows(results);
        for (const auto& analysis : results.analyses)
            writeResultCsv(fuzz::getFolder() / "run.csv", analysis);
    });
    if (accepted && kind == 0) fuzz::fail("a damaged file was accepted");
    if (!accepted && kind == 1) fuzz::fail("a damaged journal spoiled its file");
    return 0;
}
