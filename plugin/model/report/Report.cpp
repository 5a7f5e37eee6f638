#include "simflex/model/report/Report.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>

#include "PageParts.h"
#include "simflex/base/Base64.h"
#include "simflex/base/DisplayUnit.h"
#include "simflex/base/Json.h"
#include "simflex/base/NumberText.h"
#include "simflex/base/Progress.h"
#include "simflex/base/UnfinishedFile.h"
#include "simflex/model/Model.h"
#include "simflex/model/analyses/Provenance.h"
#include "simflex/model/file/NearestName.h"
#include "simflex/model/pictures/Pictures.h"
#include "simflex/model/results/Extremes.h"
#include "simflex/model/results/ProbeChoice.h"

namespace simflex {
namespace model {

namespace fs = std::filesystem;

namespace {

constexpr size_t MostRowsOfCurve = 4000;  // longer curves are reduced
constexpr size_t NumBuckets = 1500;       // of a reduced curve
constexpr int ReportDigits = 6;

std::string escapeHtml(const std::string& text) {
    std::string escaped;
    for (const char c : text)
        escaped += c == '<'    ? "&lt;"
                   : c == '>'  ? "&gt;"
                   : c == '&'  ? "&amp;"
                   : c == '"'  ? "&quot;"
                   : c == '\'' ? "&#39;"
                               : std::string(1, c);
    return escaped;
}

/** Content security policy of the page: only its own script may run, and nothing may be loaded. It
is the second line of defence against texts of a model file, after escapeHtml(). **/
std::string makePolicy() {
    std::string hash;
    for (const char* digits = PageScriptSha256; *digits; digits += 2)
        hash += char(std::stoi(std::string(digits, 2), nullptr, 16));
    return "default-src 'none'; style-src 'unsafe-inline'; img-src data:; script-src 'sha256-" +
           encodeBase64(hash.data(), hash.size()) + "'";
}

/** A row of a table.
@param tag  "th" or "td" **/
std::string writeTableRow(const std::vector<std::string>& cells, const char* tag = "td") {
    std::string row = "<tr>";
    for (const std::string& cell : cells)
        row += std::string("<") + tag + ">" + escapeHtml(cell) + "</" + tag + ">";
    return row + "</tr>\n";
}

std::string writeHtmlTable(const std::string& rows) {
    return "<div class=\"scroll\"><table>\n" + rows + "</table></div>\n";
}

std::string writeWarnings(const std::vector<std::string>& warnings) {
    std::string text;
    for (const std::string& warning : warnings)
        text += "<p class=\"warning\">" + escapeHtml(warning) + "</p>\n";
    return text;
}

/** Keeps the minimum and maximum of each bucket, in order. **/
void thinCurve(const std::vector<double>& x, const std::vector<double>& y,
               std::vector<double>& keptX, std::vector<double>& keptY) {
    for (size_t bucket = 0; bucket < NumBuckets; ++bucket) {
        const size_t first = bucket * x.size() / NumBuckets,
                     end = (bucket + 1) * x.size() / NumBuckets;
        const auto [least, largest] =
            findExtremes(y.begin() + std::ptrdiff_t(first), y.begin() + std::ptrdiff_t(end));
        std::vector<size_t> kept{size_t(least - y.begin()), size_t(largest - y.begin())};
        // Keep the first and last points.
        if (bucket == 0) kept.push_back(0);
        if (bucket + 1 == NumBuckets) kept.push_back(x.size() - 1);
        std::sort(kept.begin(), kept.end());
        kept.erase(std::unique(kept.begin(), kept.end()), kept.end());
        for (const size_t i : kept) {
            keptX.push_back(x[i]);
            keptY.push_back(y[i]);
        }
    }
}

std::string encodeNumbers(const std::vector<double>& values) {
    return encodeBase64(values.data(), values.size() * sizeof(double));
}

std::string encodeShort(const std::vector<double>& values) {
    const std::vector<float> numbers(values.begin(), values.end());
    return encodeBase64(numbers.data(), numbers.size() * sizeof(float));
}

struct PagePlot {
    std::string caption;
    Json curves = Json::list();
    std::string sharedX;
    bool isOfTime = true, isDots = false, isLogarithmic = false;

    void add(const std::string& name, const std::vector<double>& x, const std::vector<double>& y) {
        Json curve = Json::object();
        curve.add("name", name);
        if (x.size() > MostRowsOfCurve) {
            std::vector<double> keptX, keptY;
            thinCurve(x, y, keptX, keptY);
            curve.add("x", encodeNumbers(keptX)).add("y", encodeShort(keptY));
        } else {
            if (sharedX.empty()) sharedX = encodeNumbers(x);
            curve.add("y", encodeShort(y));
        }
        curves.add(std::move(curve));
    }
    Json describe() const {
        Json plot = Json::object();
        plot.add("curves", curves)
            .add("isOfTime", isOfTime)
            .add("dots", isDots)
            .add("log", isLogarithmic);
        if (!sharedX.empty()) plot.add("x", sharedX);
        return plot;
    }
    std::string write() const {
        return "<figure><figcaption><b>" + escapeHtml(caption) +
               "</b><span data-is=\"legend\"></span></figcaption><canvas role=\"img\" "
               "aria-label=\"" +
               escapeHtml(caption) + "\"></canvas></figure>\n";
    }
};

std::vector<PagePlot> makePlots(const Results::Analysis& analysis) {
    std::vector<PagePlot> plots;
    if (analysis.type == "transient") {
        const std::vector<ChosenColumn> columns = chooseColumns(analysis, {});
        for (size_t first = 0, end; first < columns.size(); first = end) {
            for (end = first; end < columns.size() && columns[end].probe == columns[first].probe;)
                ++end;
            double largest = 0;
            for (size_t k = first; k < end; ++k)
                for (const double value : columns[k].values)
                    if (std::isfinite(value)) largest = std::max(largest, std::abs(value));
            const DisplayUnit scale = chooseDisplayUnit(columns[first].unit, largest);
            PagePlot plot;
            plot.caption = makeAxisLabel(columns[first].probe, scale.name);
            for (size_t k = first; k < end; ++k) {
                std::vector<double> values = columns[k].values;
                for (double& value : values) value /= scale.size;
                plot.add(columns[k].column, analysis.time, values);
            }
            plots.push_back(std::move(plot));
        }
    } else if (analysis.type == "frequency_response" && !analysis.frequency.empty()) {
        for (const ChosenResponse& response : chooseResponses(analysis, {})) {
            PagePlot plot;
            plot.caption = makeAxisLabel(response.name, response.unit) + " over Hz";
            plot.isOfTime = false;
            plot.isLogarithmic = true;
            plot.add("", analysis.frequency[0], response.magnitude);
            plots.push_back(std::move(plot));
        }
    } else if (!analysis.speeds.empty() && !analysis.frequency.empty()) {
        PagePlot plot;
        plot.caption = "natural frequencies [Hz] over speed [rad/s]";
        plot.isOfTime = false;
        plot.isDots = analysis.speeds.size() == 1;
        for (size_t mode = 0; mode < analysis.frequency[0].size(); ++mode) {
            std::vector<double> values;
            for (const std::vector<double>& row : analysis.frequency)
                values.push_back(row.at(mode));
            plot.add(std::to_string(mode + 1), analysis.speeds, values);
        }
        plots.push_back(std::move(plot));
    }
    return plots;
}

std::string writeProbeTable(const Results::Analysis& analysis) {
    const bool isTransient = analysis.type == "transient";
    std::string rows =
        isTransient
            ? writeTableRow({"probe", "least", "at [s]", "largest", "at [s]", "at the end"}, "th")
            : writeTableRow({"probe", "value"}, "th");
    for (const ChosenColumn& column : chooseColumns(analysis, {})) {
        const std::string name = makeAxisLabel(column.name, column.unit);
        const std::vector<double>& values = column.values;
        if (values.empty()) continue;
        if (!isTransient) {
            // The last point of a path is the result.
            rows += writeTableRow({name, writeGeneral(values.back(), ReportDigits)});
            continue;
        }
        const auto [least, largest] = findExtremes(values.begin(), values.end());
        const auto getTime = [&](auto place) {
            return writeGeneral(analysis.time[size_t(place - values.begin())], ReportDigits);
        };
        rows += writeTableRow({name, writeGeneral(*least, ReportDigits), getTime(least),
                               writeGeneral(*largest, ReportDigits), getTime(largest),
                               writeGeneral(values.back(), ReportDigits)});
    }
    return writeHtmlTable(rows);
}

std::string writeModeTable(const Results::Analysis& analysis) {
    std::string rows = writeTableRow({"mode", "frequency [Hz]", "damping ratio"}, "th");
    for (size_t k = 0; k < analysis.frequency[0].size(); ++k)
        rows += writeTableRow({std::to_string(k + 1),
                               writeGeneral(analysis.frequency[0][k], ReportDigits),
                               writeGeneral(analysis.dampingRatio[0].at(k), 4)});
    return writeHtmlTable(rows);
}

const char* const StageHtml = R"html(<div class="stage">
<canvas data-is="scene" tabindex="0" aria-label="The motion. Drag turns it, shift and drag shift it, the wheel or + and − zoom, a double click puts it back; w, a, s, d turn it; space plays, arrows step."></canvas>
<div class="caption" data-is="clock"></div>
<div class="bar" data-is="bar"><span data-is="quantity"></span><div class="colors" data-is="colors"></div></div>
</div>
)html";
const char* const ControlsHtml = R"html(<div class="controls">
<button class="play" data-is="play" type="button">▶ Play</button>
<input type="range" data-is="time" min="0" max="10000" step="any" value="0" aria-label="Time">
<label>speed <select data-is="speed"></select></label>
)html";
const char* const StageControlsHtml =
    R"html(<label>exaggeration <select data-is="factor"></select></label>
<label>contour <select data-is="contour"></select></label>
<label>camera <select data-is="camera"></select></label>
)html";

class PageWriter {
public:
    PageWriter(const std::string& path, const RunOptions& options)
        : m_path(path), m_options(options), m_results(readResults(path)) {
        requireAnalyses(m_results, path, options.only);
        buildModel();
    }

    std::string write(const std::string& page) {
        const ResultHeader& header = m_results.header;
        Json analyses = Json::list();
        std::string body;
        int number = 0;
        for (const Results::Analysis& analysis : m_results.analyses) {
            if (!isWanted(analysis.name)) continue;
            body += writeAnalysis(analysis, "analysis-" + std::to_string(++number), analyses);
        }
        Json data = Json::object();
        data.add("analyses", std::move(analyses));
        // Escape '<', so that no text can end the enclosing element.
        std::string json = data.write(0);
        for (size_t at = json.find('<'); at != std::string::npos; at = json.find('<', at + 6))
            json.replace(at, 1, "\\u003c");

        std::string text =
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n";
        text += "<meta http-equiv=\"Content-Security-Policy\" content=\"" + makePolicy() + "\">\n";
        text +=
            "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>" +
            escapeHtml(header.title) + "</title>\n<style>\n" + PageStyle +
            "</style>\n</head>\n<body>\n<main>\n<h1>" + escapeHtml(header.title) + "</h1>\n";
        text += "<p class=\"faint\">" + escapeHtml(header.modelPath) +
                (header.isRigid ? ", all bodies rigid" : "") + "; results " +
                escapeHtml(fs::path(m_path).filename().string()) + "; simflex " + SIMFLEX_VERSION +
                "</p>\n";
        text += writeWarnings(m_results.warnings);
        if (!m_whyNoMotion.empty())
            text += writeWarnings({"The motion is not shown: " + m_whyNoMotion});
        text += body + "<h2>Model</h2>\n";
        if (!header.settings.empty())
            text += "<p>Settings: " + escapeHtml(joinNames(header.settings, " ")) + "</p>\n";
        text += "<pre>" + escapeHtml(header.modelText) + "</pre>\n</main>\n";
        text += "<script type=\"application/json\" id=\"data\">" + json + "</script>\n<script>\n" +
                PageScript + "</script>\n</body>\n</html>\n";
        replaceFile(page, text);
        return std::to_string(number) + (number == 1 ? " analysis, " : " analyses, ") +
               writeFileSize(double(text.size()));
    }

private:
    bool isWanted(const std::string& analysis) const {
        return m_options.only.empty() || std::find(m_options.only.begin(), m_options.only.end(),
                                                   analysis) != m_options.only.end();
    }

    void buildModel() {
        const bool hasMotion =
            std::any_of(m_results.analyses.begin(), m_results.analyses.end(),
                        [&](const Results::Analysis& analysis) {
                            return isWanted(analysis.name) && analysis.type == "transient";
                        });
        if (!hasMotion) return;
        ModelText text;
        text.path = m_results.header.modelPath;
        text.text = m_results.header.modelText;
        text.settings = m_results.header.settings;
        ModelOptions options;
        options.bodies =
            m_results.header.isRigid ? ModelOptions::Bodies::Rigid : ModelOptions::Bodies::AsGiven;
        options.code = m_options.code;
        options.code.fmus = AllowedCode::Fmus::Described;  // the results have their outputs
        options.listener = m_options.listener;
        try {
            auto model = std::make_unique<Model>(text, options);
            const std::string change =
                findChangedInput(m_results.header.inputs, calcInputChecksums(*model));
            if (!change.empty()) throw std::runtime_error(change);
            m_model = std::move(model);
        } catch (const Cancelled&) {
            throw;
        } catch (const std::exception& error) {
            m_whyNoMotion = error.what();
            m_options.listener.tellWarning("the page shows no motion: " + m_whyNoMotion);
        }
    }

    std::string writeAnalysis(const Results::Analysis& analysis, const std::string& id,
                              Json& analyses) {
        Json described = Json::object();
        described.add("id", id);
        std::string notes = writeWarnings(analysis.warnings);
        bool hasScene = false;
        const bool isTransient = analysis.type == "transient" && !analysis.time.empty();
        if (isTransient) {
            described.add("first", analysis.time.front()).add("last", analysis.time.back());
            if (m_model && analysis.q.empty())
                notes += writeWarnings(
                    {"The motion is not shown: the run has kept no states (output.states: none)."});
            if (m_model && !analysis.q.empty()) try {
                    described.add("scene", Json::written(describeScene(*m_model, analysis,
                                                                       m_options.listener)));
                    hasScene = true;
                } catch (const Cancelled&) {
                    throw;
                } catch (const std::exception& error) {
                    notes +=
                        writeWarnings({std::string("The motion is not shown: ") + error.what()});
                    m_options.listener.tellWarning(analysis.name +
                                                   ": the page shows no motion: " + error.what());
                }
        }
        std::string text = "<section id=\"" + id + "\">\n<h2>" + escapeHtml(analysis.name) +
                           " <span "
                           "class=\"faint\">" +
                           escapeHtml(analysis.type) +
                           (analysis.isComplete ? "" : ", not complete") + "</span></h2>\n" + notes;
        if (hasScene) text += StageHtml;
        if (isTransient) {
            text += ControlsHtml;
            if (hasScene) text += StageControlsHtml;
            if (!hasScene) text += "<span data-is=\"clock\"></span>\n";
            text += "</div>\n";
        }
        Json plots = Json::list();
        std::string figures;
        for (const PagePlot& plot : makePlots(analysis)) {
            plots.add(plot.describe());
            figures += plot.write();
        }
        described.add("plots", std::move(plots));
        analyses.add(std::move(described));
        if (!figures.empty()) text += "<div class=\"plots\">\n" + figures + "</div>\n";
        if (!analysis.probes.empty()) text += "<h2>Probes</h2>\n" + writeProbeTable(analysis);
        if (analysis.type == "eigen" && !analysis.frequency.empty())
            text += writeModeTable(analysis);
        if (!analysis.events.empty()) {
            std::string rows = writeTableRow({"event", "at [s]"}, "th");
            for (const Results::Analysis::Event& event : analysis.events)
                rows += writeTableRow({event.name, writeGeneral(event.time, 9)});
            text += "<h2>Events</h2>\n" + writeHtmlTable(rows);
        }
        if (!analysis.statistics.empty()) {
            std::string rows = writeTableRow({"statistics", ""}, "th");
            for (const auto& [name, value] : analysis.statistics)
                rows += writeTableRow({name, writeGeneral(value, ReportDigits)});
            text += "<h2>Run</h2>\n" + writeHtmlTable(rows);
        }
        return text + "</section>\n";
    }

    std::string m_path;
    RunOptions m_options;
    Results m_results;
    std::unique_ptr<Model> m_model;
    std::string m_whyNoMotion;
};

}  // namespace

std::string writeReport(const std::string& results, const std::string& page,
                        const RunOptions& options) {
    const std::string ending = fs::path(page).extension().string();
    if (ending != ".html" && ending != ".htm")
        throw std::runtime_error("'" + page + "' is not a page that can be written: name it .html");
    checkWritable(page);
    return PageWriter(results, options).write(page);
}

}  // namespace model
}  // namespace simflex
