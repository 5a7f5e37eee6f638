#include "simflex/model/Results.h"

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
