#include "simflex/model/analyses/PostRun.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>

#include "simflex/base/NumberText.h"
#include "simflex/base/Progress.h"
#include "simflex/base/UnfinishedFile.h"
#include "simflex/body/VtkReporter.h"
#include "simflex/model/analyses/Provenance.h"
#include "simflex/model/analyses/RunCheckpoint.h"
#include "simflex/model/analyses/StateRows.h"
#include "simflex/model/file/ModelTexts.h"
#include "simflex/model/file/NearestName.h"
#include "simflex/model/file/YamlTree.h"
#include "simflex/model/pictures/Pictures.h"
#include "simflex/model/probes/Probe.h"
#include "simflex/model/results/ProbeChoice.h"
#include "simflex/model/results/ResultWriter.h"

namespace simflex {
namespace model {

namespace fs = std::filesystem;

namespace {

/** Sections that may differ from those of the run. **/
const char* const BesideTheMotion[] = {"title", "description", "pictures", "output", "probes"};

/** Largest difference of two evaluations of the same State, relative to the largest value of a
probe. **/
constexpr double MostRoundOff = 1e-9;

YamlTree parseModel(const ModelText& text) {
    YamlTree tree = parseYaml(text.text, text.path);
    for (const std::string& setting : text.settings) applySetting(tree, setting);
    return tree;
}

bool isSameTree(const YamlTree& a, const YamlTree& b) {
    if (a.kind != b.kind || a.scalar != b.scalar || a.items.size() != b.items.size() ||
        a.entries.size() != b.entries.size())
        return false;
    for (size_t k = 0; k < a.items.size(); ++k)
        if (!isSameTree(a.items[k], b.items[k])) return false;
    for (size_t k = 0; k < a.entries.size(); ++k)
        if (a.entries[k].key != b.entries[k].key ||
            !isSameTree(a.entries[k].value, b.entries[k].value))
            return false;
    return true;
}

bool isSameTree(const YamlTree* a, const YamlTree* b) {
    return (!a && !b) || (a && b && isSameTree(*a, *b));
}

bool mentions(const YamlTree& tree, const std::string& word) {
    const auto isLetter = [](char c) {
        return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
               c == '_';
    };
    for (size_t at = tree.scalar.find(word); at != std::string::npos;
         at = tree.scalar.find(word, at + 1)) {
        const size_t end = at + word.size();
        if ((at == 0 || !isLetter(tree.scalar[at - 1])) &&
            (end == tree.scalar.size() || !isLetter(tree.scalar[end])))
            return true;
    }
    return std::any_of(tree.items.begin(), tree.items.end(),
                       [&](const YamlTree& item) { return mentions(item, word); }) ||
           std::any_of(tree.entries.begin(), tree.entries.end(),
                       [&](const YamlTree::Entry& entry) { return mentions(entry.value, word); });
}

bool isBeside(const std::string& section) {
    return std::find(std::begin(BesideTheMotion), std::end(BesideTheMotion), section) !=
           std::end(BesideTheMotion);
}

/** Probes that have changed, or depend on one that has, each with the probe that caused it: a
changed probe is its own cause. **/
std::map<std::string, std::string> findChangedProbes(const YamlTree& before, const YamlTree& now) {
    std::map<std::string, std::string> causes;
    std::vector<std::string> open;
    const auto add = [&](const std::string& probe, const std::string& cause) {
        if (causes.emplace(probe, cause).second) open.push_back(probe);
    };
    for (const YamlTree* tree : {&before, &now})
        for (const YamlTree::Entry& probe : tree->entries)
            if (!isSameTree(before.find(probe.key), now.find(probe.key))) add(probe.key, probe.key);
    while (!open.empty()) {
        const std::string changed = open.back();
        open.pop_back();
        for (const YamlTree* tree : {&before, &now})
            for (const YamlTree::Entry& probe : tree->entries)
                if (const YamlTree* formula = probe.value.find("expression"))
                    if (mentions(*formula, changed)) add(probe.key, causes.at(changed));
    }
    return causes;
}

const YamlTree& getProbes(const YamlTree& model) {
    static const YamlTree none;
    return model.find("probes") ? *model.find("probes") : none;
}

/** @throws std::runtime_error naming the section that has changed, or the changed probe used by a
law of motion. **/
void requireSameMotion(const YamlTree& before, const YamlTree& now,
                       const std::map<std::string, std::string>& changedProbes,
                       const std::string& results) {
    for (const YamlTree* tree : {&before, &now})
        for (const YamlTree::Entry& entry : tree->entries)
            if (!isBeside(entry.key) && !isSameTree(before.find(entry.key), now.find(entry.key)))
                throw std::runtime_error(
                    "'" + entry.key + "' differs from the run of '" + results +
                    "': only probes, pictures, output and title may differ; run the model anew");
    for (const YamlTree::Entry& probe : getProbes(before).entries) {
        const auto changed = changedProbes.find(probe.key);
        if (changed == changedProbes.end()) continue;
        const std::string& cause = changed->second;
        for (const YamlTree::Entry& section : before.entries)
            if (!isBeside(section.key) && mentions(section.value, probe.key))
                throw std::runtime_error(
                    "probe '" + cause + "', which '" + section.key + "' uses" +
                    (cause == probe.key ? "" : " by way of '" + probe.key + "'") +
                    ", differs from the run of '" + results +
                    "'; leave it as it was, and give the new one another name");
    }
}

class PostRun {
public:
    PostRun(const std::string& path, const ModelText* given,
            const std::vector<std::string>& changes, const PostOptions& options)
        : m_path(path), m_options(options), m_results(readResults(path)) {
        ModelText before;
        before.path = m_results.header.modelPath;
        before.text = m_results.header.modelText;
        before.settings = m_results.header.settings;
        m_text = given ? *given : before;
        if (given) m_text.settings = before.settings;
        m_text.settings.insert(m_text.settings.end(), changes.begin(), changes.end());
        m_before = parseModel(before);
        m_now = parseModel(m_text);
        m_changed = findChangedProbes(getProbes(m_before), getProbes(m_now));
        requireSameMotion(m_before, m_now, m_changed, path);

        ModelOptions modelOptions;
        modelOptions.bodies =
            m_results.header.isRigid ? ModelOptions::Bodies::Rigid : ModelOptions::Bodies::AsGiven;
        modelOptions.code = options.code;
        modelOptions.code.fmus = AllowedCode::Fmus::Described;  // the results have their outputs
        modelOptions.listener = options.listener;
        m_model = std::make_shared<const Model>(readModel(m_text), modelOptions);
        const InputChecksums inputs = calcInputChecksums(*m_model);
        const std::string change = findChangedInput(m_results.header.inputs, inputs);
        if (!change.empty())
            throw std::runtime_error("'" + path + "' is not of this model: " + change);
        m_probes = Probes::make(m_model);
        // Pictures that have not changed stay as they are.
        m_draws = options.drawsPictures && m_model->getFile().get("pictures").isGiven() &&
                  !isSameTree(m_before.find("pictures"), m_now.find("pictures"));
        if (m_draws) checkPictures(*m_model);  // fail early
        m_states.emplace(*m_model);
        requireAnalyses(m_results, path, options.only);
    }

    std::string perform() {
        const std::string output =
            m_options.output.empty() ? makePathBeside(m_path, ".post.h5") : m_options.output;
        std::error_code none;
        if (fs::equivalent(output, m_path, none))
            throw std::runtime_error("'" + output +
                                     "' is the file that is read: choose another name with -o");
        checkWritable(output);
        if (!m_options.vtk.empty() && fs::path(m_options.vtk).extension() != ".pvd")
            throw std::runtime_error("'" + m_options.vtk +
                                     "' is not a list for ParaView: name it .pvd");
        if (!m_options.vtk.empty()) requireAny(&hasShapes, "--vtk", "transient or static");
        if (!m_options.animation.empty()) {
            checkAnimationName(m_options.animation);
            requireAny(&moves, "--animation", "transient");
        }
        ResultHeader header = m_results.header;
        header.title = getModelTitle(m_model->getFile());
        header.modelPath = m_text.path;
        header.modelText = m_text.text;
        header.settings = m_text.settings;
        std::vector<Results::Analysis> done;
        for (const Results::Analysis& analysis : m_results.analyses)
            if (isWanted(analysis.name)) done.push_back(recalculate(analysis));
        {
            ResultWriter writer(output, header);
            for (const std::string& warning : m_results.warnings) writer.addWarning("", warning);
            for (const Results::Analysis& analysis : done) writer.add(analysis);
        }
        if (m_draws)
            for (const Results::Analysis& analysis : done) draw(analysis);
        if (!m_options.vtk.empty())
            for (const Results::Analysis& analysis : done)
                if (hasShapes(analysis)) writeVtk(analysis);
        if (!m_options.animation.empty())
            for (const Results::Analysis& analysis : done)
                if (moves(analysis))
                    m_options.listener.tellNote(
                        writeAnimation(*m_model, analysis, m_options.animation));
        if (m_options.writesCsv || m_model->getFile().get("output").get("csv").getBool())
            for (const Results::Analysis& analysis : done)
                writeResultCsv(makePathBeside(output, "." + analysis.name + ".csv"), analysis);
        return output;
    }

private:
    bool isWanted(const std::string& analysis) const {
        return m_options.only.empty() || std::find(m_options.only.begin(), m_options.only.end(),
                                                   analysis) != m_options.only.end();
    }

    bool isAsBefore(const std::string& probe) const {
        const YamlTree &before = getProbes(m_before), &now = getProbes(m_now);
        if (before.entries.empty() && now.entries.empty()) return true;  // the default ones
        return before.find(probe) && m_changed.count(probe) == 0;
    }

    /** True for the States of a motion or an equilibrium. **/
    static bool hasShapes(const Results::Analysis& analysis) {
        return (analysis.type == "transient" || analysis.type == "static") && !analysis.q.empty();
    }
    static bool moves(const Results::Analysis& analysis) {
        return analysis.type == "transient" && !analysis.q.empty();
    }
    /** @throws std::runtime_error if there is nothing to write. **/
    void requireAny(bool (*canShow)(const Results::Analysis&), const char* option,
                    const char* types) const {
        std::vector<std::string> wanted;
        for (const Results::Analysis& analysis : m_results.analyses) {
            if (!isWanted(analysis.name)) continue;
            if (canShow(analysis)) return;
            wanted.push_back("'" + analysis.name + "' (" + analysis.type + ")");
        }
        throw std::runtime_error(std::string(option) + " needs a " + types +
                                 " analysis with States, which none of " + joinNames(wanted, ", ") +
                                 " of '" + m_path + "' is");
    }

    static std::size_t countRows(const Results::Analysis& analysis) {
        return analysis.type == "static" ? std::max<std::size_t>(1, analysis.q.size())
                                         : analysis.time.size();
    }

    Results::Analysis recalculate(const Results::Analysis& analysis) {
        if (analysis.type != "transient" && analysis.type != "static") return analysis;
        if (analysis.q.empty()) {
            if (countRows(analysis) > 0)
                throw std::runtime_error("analysis '" + analysis.name + "' of '" + m_path +
                                         "' has kept no States (output.states: none): run the "
                                         "model anew");
            return analysis;
        }
        const size_t numProbes = m_probes.getProbes().size();
        Results::Analysis result = analysis;
        result.probes.clear();
        for (const Probe& probe : m_probes.getProbes())
            result.probes.push_back({{probe.name, probe.unit, probe.columns}, {}});
        for (size_t row = 0; row < countRows(analysis); ++row) {
            if (!m_options.listener.tellProgress(analysis.name,
                                                 double(row) / double(countRows(analysis))))
                throw Cancelled("nothing has been written");
            const KeptMoment kept = m_states->unpack(analysis, row);
            const Moment moment = kept.get();
            for (size_t k = 0; k < numProbes; ++k) {
                const Probe& probe = m_probes.getProbes()[k];
                probe.calc(moment, result.probes[k].rows.emplace_back(probe.columns.size()).data());
            }
        }
        for (Results::Series& series : result.probes) keepWhatIsKnown(analysis, series);
        keepErrorBars(analysis, result);
        return result;
    }

    /** Keeps the error bars of unchanged probes. **/
    void keepErrorBars(const Results::Analysis& before, Results::Analysis& now) const {
        std::vector<Results::Series> errors;
        bool hasBars = false;
        std::vector<std::string> without;
        for (const Results::Series& series : now.probes) {
            const std::string& name = series.column.name;
            const auto* error = seekSeries(before, name + ErrorSuffix);
            const auto* old = seekSeries(before, name);
            if (error && isAsBefore(name) && error->column.columns == series.column.columns)
                errors.push_back(*error);
            else if (!old || !isAsBefore(name))
                without.push_back(name);
        }
        for (const Results::Series& series : before.probes)
            hasBars |= seekSeries(before, series.column.name + ErrorSuffix) != nullptr;
        now.probes.insert(now.probes.end(), errors.begin(), errors.end());
        if (hasBars && !without.empty())
            m_options.listener.tellNote("analysis '" + now.name + "': " + joinNames(without) +
                                        (without.size() > 1 ? " have" : " has") +
                                        " no error bars: these take a run");
    }
    static const Results::Series* seekSeries(const Results::Analysis& analysis,
                                             const std::string& name) {
        const auto found =
            std::find_if(analysis.probes.begin(), analysis.probes.end(),
                         [&](const Results::Series& other) { return other.column.name == name; });
        return found == analysis.probes.end() ? nullptr : &*found;
    }

    /** Uses the values of the run where it has them. **/
    void keepWhatIsKnown(const Results::Analysis& analysis, Results::Series& series) const {
        const std::string& name = series.column.name;
        const auto* const old = seekSeries(analysis, name);
        const bool isKnown = old && isAsBefore(name) && old->column.unit == series.column.unit &&
                             old->column.columns == series.column.columns;
        if (!isKnown) return;
        double largest = 0, difference = 0;
        for (size_t row = 0; row < series.rows.size(); ++row)
            for (size_t k = 0; k < series.rows[row].size(); ++k) {
                const double was = old->rows[row][k], is = series.rows[row][k];
                if (std::isnan(was) && std::isnan(is)) continue;
                largest = std::max(largest, std::abs(was));
                const double apart = std::abs(is - was);
                difference = apart <= difference ? difference : apart;
            }
        if (!(difference <= MostRoundOff * largest))
            throw std::runtime_error("probe '" + name + "' is " + writeGeneral(difference, 3) +
                                     " " + series.column.unit + " off what '" + m_path +
                                     "' has: parts or tables of the model have changed since; run "
                                     "it anew");
        series.rows = old->rows;
    }

    void writeVtk(const Results::Analysis& rows) const {
        fs::path file(m_options.vtk);
        if (std::count_if(m_results.analyses.begin(), m_results.analyses.end(), hasShapes) > 1)
            file.replace_filename(file.stem().string() + "_" + rows.name + ".pvd");
        VtkReporter reporter(m_model->getFlexibleBodies(), 1, file.string());
        const size_t numRows = countRows(rows);
        for (size_t row = 0; row < numRows; ++row) {
            if (!m_options.listener.tellProgress(file.string(), double(row) / double(numRows)))
                throw Cancelled("'" + file.string() + "' has the rows up to the " +
                                std::to_string(row) + ". one");
            reporter.handleEvent(m_states->unpackState(rows, row));
        }
        m_options.listener.tellNote(file.string() + ": " + std::to_string(numRows) +
                                    (numRows == 1 ? " time" : " times") + " for ParaView");
    }

    void draw(const Results::Analysis& analysis) const {
        if (analysis.q.empty()) return;
        const std::string usual = fs::path(m_text.path).stem().string() + ".frames";
        if (analysis.type == "transient")
            drawMotion(analysis, usual);
        else if (analysis.type == "static")
            m_options.listener.tellNote(
                drawState(*m_model, m_states->unpackState(analysis, countRows(analysis) - 1),
                          analysis.name, usual));
        else if (analysis.type == "eigen")
            drawKeptModes(analysis, usual);
    }

    void drawKeptModes(const Results::Analysis& analysis, const std::string& usual) const {
        std::vector<Eigenmode> modes;
        const auto &re = analysis.matrices.at("mode_real"),
                   &im = analysis.matrices.at("mode_imaginary");
        for (size_t k = 0; k < re.size(); ++k) {
            modes.emplace_back();
            modes.back().frequency = analysis.frequency.at(0).at(k);
            SimTK::Vector_<SimTK::Complex>& shape = modes.back().shape;
            shape.resize(int(re[k].size()));
            for (int i = 0; i < shape.size(); ++i)
                shape[i] = {re[k][size_t(i)], im[k].at(size_t(i))};
        }
        m_options.listener.tellNote(drawModes(*m_model, m_states->unpackState(analysis, 0), modes,
                                              analysis.name, usual, m_options.listener));
    }

    void drawMotion(const Results::Analysis& rows, const std::string& usual) const {
        const ModelValue pictures = m_model->getFile().get("pictures");
        const double wanted =
            1 / (pictures.get("rate").getNumber() * pictures.get("slow_motion").getNumber());
        const double interval = rows.time.size() > 1 ? rows.time[1] - rows.time[0] : wanted;
        const size_t stride = size_t(std::max(1.0, std::round(wanted / interval)));
        if (std::abs(double(stride) * interval - wanted) > 1e-6 * wanted)
            m_options.listener.tellNote("pictures of analysis '" + rows.name + "' are " +
                                        writeGeneral(double(stride) * interval, 4) +
                                        " s apart instead of " + writeGeneral(wanted, 4) +
                                        " s: there are States only every " +
                                        writeGeneral(interval, 4) + " s");
        std::vector<RunCheckpoint::Frame> frames;
        for (size_t row = 0; row < rows.time.size();
             row = row + 1 == rows.time.size() ? row + 1
                                               : std::min(row + stride, rows.time.size() - 1))
            frames.push_back({rows.time[row], rows.q[row], rows.u[row],
                              rows.z.empty() ? std::vector<double>() : rows.z[row],
                              rows.holding.at(row)});
        m_options.listener.tellNote(
            drawFrames(*m_model, frames, rows, usual, m_options.listener, m_options.resumeCommand));
    }

    std::string m_path;
    PostOptions m_options;
    Results m_results;
    ModelText m_text;
    YamlTree m_before, m_now;
    std::map<std::string, std::string> m_changed;  ///< see findChangedProbes()
    std::shared_ptr<const Model> m_model;
    Probes m_probes;
    bool m_draws = false;
    std::optional<StateRows> m_states;
};

}  // namespace

std::string postProcess(const std::string& results, const ModelText* text,
                        const std::vector<std::string>& changes, const PostOptions& options) {
    return PostRun(results, text, changes, options).perform();
}

}  // namespace model
}  // namespace simflex
