#include "simflex/model/analyses/ErrorBars.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <future>
#include <map>

#include "simflex/base/Progress.h"
#include "simflex/model/analyses/StateNumbers.h"
#include "simflex/model/file/NearestName.h"

namespace simflex {
namespace model {
namespace {

/** Removes errors added by an earlier run. **/
void dropErrors(Results& results) {
    for (Results::Analysis& analysis : results.analyses) {
        const std::vector<Results::Series> all = analysis.probes;
        const auto isOfAnother = [&](const Results::Series& error) {
            return std::any_of(all.begin(), all.end(), [&](const Results::Series& series) {
                return error.column.name == series.column.name + ErrorSuffix;
            });
        };
        auto& probes = analysis.probes;
        probes.erase(std::remove_if(probes.begin(), probes.end(), isOfAnother), probes.end());
    }
}

/** Share of the allowed error at which enough modes are advised, since the remaining error is an
estimate. **/
constexpr double AdvisedShare = 0.7;

/** Resolution of a run, relative to the largest value of a unit. **/
constexpr double Unresolved = 1e-6;

bool isLinear(const Results::Analysis& analysis) {
    return analysis.type == "linear";
}

/** The errors of a probe's columns, finer minus given; empty if some cannot be compared. **/
std::vector<std::vector<double>> calcErrors(const Results::Analysis& analysis,
                                            const ResultComparison& comparison,
                                            const ResultColumn& probe) {
    std::vector<const ColumnDifference*> columns;
    for (const ColumnDifference& column : comparison.columns)
        if (column.analysis == analysis.name && column.probe == probe.name)
            columns.push_back(&column);
    if (columns.size() != probe.columns.size()) return {};
    const bool isStatic = analysis.type == "static";
    const size_t numRows = isStatic && !analysis.hasPath() ? 1
                           : isStatic                      ? analysis.matrices.at("path").size()
                                                           : analysis.time.size();
    std::vector<std::vector<double>> rows(numRows, std::vector<double>(columns.size(), NAN));
    for (size_t c = 0; c < columns.size(); ++c) {
        const ColumnDifference& column = *columns[c];
        size_t row = isStatic ? numRows - 1 : 0;
        for (size_t k = 0; k < column.first.size(); ++k) {
            // Rows missing from the finer run remain NaN.
            while (!column.x.empty() && row < numRows && analysis.time[row] < column.x[k]) ++row;
            if (row >= numRows) break;
            rows[row++][c] = column.second[k] - column.first[k];
        }
    }
    return rows;
}

/** Adds the errors to the run's probes. **/
void keepErrors(const std::string& path, Results results, const ResultComparison& comparison) {
    for (Results::Analysis& analysis : results.analyses) {
        std::vector<Results::Series> errors;
        for (const Results::Series& series : analysis.probes) {
            auto rows = calcErrors(analysis, comparison, series.column);
            if (rows.empty()) continue;
            errors.push_back({series.column, std::move(rows)});
            errors.back().column.name += ErrorSuffix;
        }
        analysis.probes.insert(analysis.probes.end(), errors.begin(), errors.end());
    }
    ResultWriter writer(path, results.header, results.analyses);
    for (const std::string& warning : results.warnings) writer.addWarning("", warning);
}

/** Motion of a part's bodies along the shapes that the part lacks. **/
struct LeftOut {
    int modes = 0;
    std::vector<double> displacements;  ///< largest |c_j| max|φ_j| [m]

    /** The sum without the first `taken` shapes. **/
    double calcRest(size_t taken) const {
        double sum = 0;
        for (size_t j = taken; j < displacements.size(); ++j) sum += displacements[j];
        return sum;
    }
};

/** Adds the motion of each body of the finer model along the shapes that its part lacks. **/
void addLeftOut(const Model& finer, const Results::Analysis& analysis,
                const std::map<std::string, std::string>& partOf,
                std::map<std::string, LeftOut>& parts) {
    SimTK::State state = finer.makeInitialState();
    const std::vector<double> atRest(size_t(state.getNU()), 0);
    for (size_t row = 0; row < analysis.q.size(); ++row) {
        setNumbers(state, 0, analysis.q[row], atRest);
        for (const Model::BodyEntry& body : finer.getBodies()) {
            if (!body.flexible || !body.flexible->getPart().further) continue;
            LeftOut& leftOut = parts.at(partOf.at(body.name));
            const ReducedBody::Further& further = *body.flexible->getPart().further;
            const SimTK::Vector xi = body.flexible->getModalCoordinates(state);
            const size_t m = further.displacements.size();
            std::vector<double>& largest = leftOut.displacements;
            largest.resize(std::max(largest.size(), m), 0);
            for (size_t j = 0; j < m; ++j) {
                double c = 0;
                for (int i = 0; i < xi.size(); ++i)
                    c += further.coordinates[j + size_t(i) * m] * xi[i];
                largest[j] = std::max(largest[j], std::abs(c) * further.displacements[j]);
            }
        }
    }
}

}  // namespace

ErrorBarRun::ErrorBarRun(const ModelRun& run, const RunOptions& options) : m_options(options) {
    if (!run.canBend())
        throw std::runtime_error(
            "no body of the model can bend: there are no modes that could be left out, and no "
            "error bars");
    m_options.output = run.getResultPath();
    m_options.drawsPictures = m_options.writesCsv = m_options.resumes = false;
    m_options.animation.clear();
    m_options.listener.warn = {};  // the run itself reports them
    m_finer = std::make_unique<ModelRun>(run.getText(), ModelOptions::Bodies::Finer, m_options);
}

void ErrorBarRun::perform(ModelRun& run) {
    std::atomic<bool> isToStop{false};
    m_finer->setListener(
        {[&](const std::string&, double, const Listener::Detail&) { return !isToStop.load(); },
         {},
         {}});
    auto both = std::async(std::launch::async, [&] { m_finer->perform(); });
    try {
        run.perform();
    } catch (...) {
        isToStop = true;
        both.wait();
        throw;
    }
    while (both.wait_for(std::chrono::milliseconds(100)) != std::future_status::ready)
        if (!m_options.listener.tellProgress("error bars", -1)) isToStop = true;
    both.get();
}

ErrorBars ErrorBarRun::keep(const ModelRun& run) const {
    Results results = readResults(run.getResultPath());
    dropErrors(results);
    Results finer = readResults(m_finer->getResultPath());
    finer.analyses.erase(std::remove_if(finer.analyses.begin(), finer.analyses.end(), isLinear),
                         finer.analyses.end());
    ErrorBars bars;
    bars.comparison = compareResults(results, finer, {}, "the run", "the finer run");
    auto& missing = bars.comparison.missing;
    for (NotCompared& one : missing) {
        const Results::Analysis* analysis = seekNamed(results.analyses, one.analysis);
        if (analysis && isLinear(*analysis))
            one.text = "analysis '" + one.analysis +
                       "' is a linear model, which with further modes has other states; analyses "
                       "of type eigen and frequency_response tell the error of its poles and "
                       "responses";
    }
    missing.erase(std::remove_if(missing.begin(), missing.end(),
                                 [](const NotCompared& one) {
                                     return one.reason == NotCompared::Reason::OnlyInSecond;
                                 }),
                  missing.end());
    // Modes of the same number need not correspond.
    const ModelValue probes = run.getModel().getFile().get("probes");
    auto& columns = bars.comparison.columns;
    columns.erase(std::remove_if(columns.begin(), columns.end(),
                                 [&](const ColumnDifference& column) {
                                     return probes.has(column.probe) &&
                                            probes.get(column.probe).has("modes");
                                 }),
                  columns.end());
    bars.advice = advise(run, finer, bars.comparison);
    keepErrors(run.getResultPath(), std::move(results), bars.comparison);
    run.writeTables();
    return bars;
}

std::vector<ModeAdvice> ErrorBarRun::advise(const ModelRun& run, const Results& finer,
                                            const ResultComparison& comparison) const {
    std::vector<ModeAdvice> advice;
    for (const Results::Analysis& analysis : finer.analyses) {
        if (!run.isWanted(analysis.name) || analysis.q.empty()) continue;
        std::map<std::string, LeftOut> parts;
        std::map<std::string, std::string> partOf;  // by body
        for (const Model::BodyEntry& body : run.getModel().getBodies()) {
            if (!body.flexible) continue;
            const ReducedBody& part = body.flexible->getPart();
            LeftOut& leftOut = parts[part.name];
            leftOut.modes = part.numModes + 6;
            partOf[body.name] = part.name;
        }
        addLeftOut(m_finer->getModel(), analysis, partOf, parts);
        double largest = 0;
        for (const auto& [name, leftOut] : parts) largest = std::max(largest, leftOut.calcRest(0));
        for (const ColumnDifference& column : comparison.columns) {
            const double error = column.getRelative();
            if (column.analysis != analysis.name || !(error > TrustedError) || column.unit == "J" ||
                column.largest <= Unresolved * findUnitScale(analysis, column.unit))
                continue;
            for (const auto& [name, leftOut] : parts) {
                // A part with a negligible share in the error needs no more modes.
                const double whole = leftOut.calcRest(0);
                if (!(whole > TrustedError * largest)) continue;
                size_t taken = 0;
                while (taken < leftOut.displacements.size() &&
                       leftOut.calcRest(taken) * error > AdvisedShare * TrustedError * whole)
                    ++taken;
                if (taken == leftOut.displacements.size() && taken > 0 &&
                    leftOut.calcRest(taken - 1) * error <= TrustedError * whole)
                    --taken;
                const bool isEnough = taken < leftOut.displacements.size();
                advice.push_back(
                    {name, column.name, leftOut.modes, isEnough ? leftOut.modes + int(taken) : 0});
            }
        }
    }
    return advice;
}

}  // namespace model
}  // namespace simflex
