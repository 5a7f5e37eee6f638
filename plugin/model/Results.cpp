#include "simflex/model/Results.h"

#include <filesystem>
#include <stdexcept>

#include "simflex/model/analyses/ErrorBars.h"
#include "simflex/model/file/NearestName.h"

namespace simflex {

using namespace model;

const Results::Series& Results::Analysis::findProbe(const std::string& probe) const {
    std::vector<std::string> known;
    for (const Series& series : probes) {
        if (series.column.name == probe) return series;
        known.push_back(series.column.name);
    }
    throw std::out_of_range(describeUnknown("probe", probe, known));
}

const Results::Analysis& Results::findAnalysis(const std::string& analysis) const {
    return findNamed<std::out_of_range>(analyses, "analysis", analysis);
}

std::string makePathBeside(const std::string& results, const std::string& ending) {
    std::filesystem::path path(results);
    const std::filesystem::path own = path.extension();
    if (own == ".h5" || own == ".hdf5") path.replace_extension();
    return path.string() + ending;
}

Results runAnalyses(const ModelText& text, const RunOptions& options) {
    ModelRun run(text, ModelOptions::Bodies::AsGiven, options);
    if (options.onlyChecks) return {};
    if (options.hasErrorBars) {
        ErrorBarRun twin(run, options);
        twin.perform(run);
        twin.keep(run);
    } else {
        run.perform();
    }
    run.refuseFailures();
    return readResults(run.getResultPath());
}

}  // namespace simflex
