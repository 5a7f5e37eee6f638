#include "simflex/model/Results.h"

#include <stdexcept>

#include "simflex/model/analyses/ModelRun.h"
#include "simflex/model/file/NearestName.h"

namespace simflex {

using namespace model;

namespace {

template <class Items, class GetName>
const auto& findItem(const Items& items, const std::string& name, const char* what,
                     const GetName& getName) {
    std::vector<std::string> known;
    for (const auto& item : items) {
        if (getName(item) == name) return item;
        known.push_back(getName(item));
    }
    throw std::out_of_range(describeUnknown(what, name, known));
}

}  // namespace

const Results::Series& Results::Analysis::findProbe(const std::string& probe) const {
    return findItem(probes, probe, "probe", [](const Series& s) { return s.column.name; });
}

const Results::Analysis& Results::findAnalysis(const std::string& analysis) const {
    return findItem(analyses, analysis, "analysis", [](const Analysis& a) { return a.name; });
}

Results runAnalyses(const ModelText& text, const RunOptions& options) {
    ModelRun run(text, ModelOptions::Bodies::AsGiven, options);
    if (options.onlyChecks) return {};
    run.perform();
    run.refuseFailures();
    return readResults(run.getResultPath());
}

}  // namespace simflex
