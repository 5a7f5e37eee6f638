/** @file
Stored sweep data: the state of its cases, and its table. Bytes of the table changed despite the
checksum must be detected; objects changed by another program give curves or a refusal. **/

#include <cmath>

#include "FuzzHdf5.h"
#include "simflex/model/results/ResultWriter.h"
#include "simflex/model/sweep/SweepResults.h"
#include "simflex/model/sweep/SweepTable.h"

using namespace simflex;

namespace {

struct Sweep {
    model::SweepPlan plan;
    std::string folder, table;
};

const Sweep& getSweep() {
    static const Sweep sweep = [] {
        Sweep made;
        made.folder = fuzz::getFolder() / "sweep";
        made.plan.model.path = "model.yaml";
        made.plan.inputs = {{"the file 'm.yaml'", "0123456789abcdef"}};
        made.plan.keys = {{"speed", {"1", "2"}, "parameters.speed"},
                          {"kind", {"a", "b"}, "parameters.kind"}};
        model::makeSweepCases(made.plan, model::SweepOrder::Grid);
        double value = 0;
        for (const model::SweepCase& one : made.plan.cases) {
            const std::string folder = made.folder + "/" + one.folder;
            std::filesystem::create_directories(folder);
            {
                model::ResultWriter writer(folder + "/results.h5",
                                           {"Title", "m.yaml", "", {}, false, "0.1", {}});
                Results::Analysis rest;
                rest.name = "rest", rest.type = "static";
                rest.probes = {{{"tip", "m", {"x", "y"}}, {{value += 1, 2}}}};
                writer.add(rest);
            }
            std::ofstream(folder + "/case.txt")
                << model::makeCaseText(made.plan.calcInputs(one), "complete");
        }
        model::writeSweepTable(made.plan, made.folder);
        std::ifstream in(made.folder + "/sweep.h5", std::ios::binary);
        made.table = std::string(std::istreambuf_iterator<char>(in), {});
        return made;
    }();
    return sweep;
}

const char* const kObjects[] = {
    "values",  "values/speed",  "values/kind",   "texts",  "texts/speed", "texts/kind",
    "columns", "columns/tip.x", "columns/tip.y", "status", "folders",     "warnings",
    "."};
const char* const kAttributes[] = {"simflex_sweep", "unit", "texts"};

void checkCurves(const model::SweepResults& sweep) {
    if (sweep.labels.size() != sweep.results.size() || sweep.results.empty())
        fuzz::fail("curves without labels");
    for (const Results& results : sweep.results) {
        const auto& analysis = results.analyses.at(0);
        for (size_t k = 0; k < analysis.time.size(); ++k)
            if (std::isnan(analysis.time[k]) || (k > 0 && analysis.time[k] < analysis.time[k - 1]))
                fuzz::fail("a curve that does not go on");
        for (const auto& probe : analysis.probes)
            if (probe.rows.size() != analysis.time.size()) fuzz::fail("a curve without its values");
    }
}

/** Checks one case's file: its state has a name, and it can enter the table. **/
void checkCase(fuzz::Input& input) {
    const Sweep& sweep = getSweep();
    const model::SweepCase& one = sweep.plan.cases[0];
    std::string text = model::makeCaseText(sweep.plan.calcInputs(one), "failed: it fell");
    if (input.take() % 2) text.resize(input.take2() % text.size());
    while (!input.empty() && !text.empty()) text[input.take2() % text.size()] = char(input.take());
    const std::string path = sweep.folder + "/" + one.folder + "/case.txt";
    std::ofstream(path, std::ios::binary) << text;
    const std::vector<model::SweepOutcome> outcomes =
        model::readSweepOutcomes(sweep.plan, sweep.folder);
    if (outcomes.size() != sweep.plan.cases.size()) fuzz::fail("another number of outcomes");
    for (const model::SweepOutcome& outcome : outcomes) {
        model::nameOf(outcome.status);
        if (outcome.error.find('\n') != std::string::npos) fuzz::fail("an error of two lines");
    }
    model::writeSweepTable(sweep.plan, sweep.folder);
    checkCurves(model::readSweepTable(sweep.folder + "/sweep.h5", "speed"));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    fuzz::Input input(data, size);
    std::string bytes = getSweep().table;
    const unsigned kind = input.take() % 8;
    if (kind == 0) {
        checkCase(input);
        return 0;
    }
    if (kind == 1 && !fuzz::changeBytes(bytes, input)) return 0;
    const std::string path = fuzz::getFolder().write("table.h5", bytes);
    if (kind > 1) fuzz::changeHdf5(path, kObjects, kAttributes, input);
    const bool isTable = model::isSweepTable(path);
    if (isTable && kind == 1) fuzz::fail("a damaged table counts as one");
    for (const char* key : {"", "speed", "kind"}) {
        model::SweepResults sweep;
        if (!fuzz::accepts([&] { sweep = model::readSweepTable(path, key); })) continue;
        if (kind == 1) fuzz::fail("a damaged table was accepted");
        checkCurves(sweep);
    }
    return 0;
}
