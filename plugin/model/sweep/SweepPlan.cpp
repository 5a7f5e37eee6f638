#include "simflex/model/sweep/SweepPlan.h"

#include <fnmatch.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <set>
#include <stdexcept>

#include "simflex/base/AsciiText.h"
#include "simflex/base/Hash.h"
#include "simflex/base/NumberText.h"
#include "simflex/model/analyses/Provenance.h"
#include "simflex/model/file/NearestName.h"
#include "simflex/model/parts/PartKey.h"
#include "simflex/model/schema/Schema.h"
#include "simflex/part/TextLines.h"

namespace simflex {
namespace model {
namespace {

namespace fs = std::filesystem;
constexpr size_t MostCases = 100000;
constexpr size_t LongestFolder = 120;

std::string trim(const std::string& text) {
    return std::string(trimBlanks(text));
}

/** The shortest text that equals the number up to round-off: 0.15 where steps of 0.025 add up to
0.15000000000000002. **/
std::string writeValue(double value) {
    for (int digits = 6; digits <= 14; ++digits) {
        const std::string text = writeGeneral(value, digits);
        double written = 0;
        if (readNumber(text, written) && std::abs(written - value) <= 1e-14 * std::abs(value))
            return text;
    }
    return writeGeneral(value);
}

std::vector<std::string> makeRange(double from, double to, int count) {
    std::vector<std::string> values;
    for (int k = 0; k < count; ++k)
        values.push_back(writeValue(k == 0           ? from
                                    : k == count - 1 ? to
                                                     : from + (to - from) * k / (count - 1)));
    return values;
}

/** True for "1:2" or "1:2:0.5": numbers and colons. **/
bool looksLikeRange(const std::string& text) {
    return text.find(':') != std::string::npos &&
           text.find_first_not_of("0123456789.+-eE: ") == std::string::npos;
}

/** "speed = 50, length = 0.1" **/
std::string listValues(const std::vector<SweptKey>& keys, const std::vector<std::string>& values) {
    std::string list;
    for (size_t k = 0; k < keys.size(); ++k)
        list += (k ? ", " : "") + keys[k].name + " = " + values[k];
    return list;
}

std::string makeFolderName(const std::vector<SweptKey>& keys,
                           const std::vector<std::string>& values) {
    std::string name, exact;
    for (size_t k = 0; k < keys.size(); ++k) {
        exact += keys[k].name + "=" + values[k] + "\n";
        name += (k ? "_" : "") + keys[k].name + "=" + values[k];
    }
    bool isExact = name.size() <= LongestFolder;
    for (char& c : name)
        if (!isLetter(c) && !isDigit(c) && !std::strchr("._=+-", c)) {
            c = '-';
            isExact = false;
        }
    if (isExact) return name;
    Hash hash;
    hash.add(exact);
    const std::string digits = hash.getText();
    return name.substr(0, LongestFolder - 2 - digits.size()) + "-" + digits;
}

}  // namespace

std::vector<std::string> SweepPlan::getSettings(const SweepCase& one) const {
    std::vector<std::string> settings = model.settings;
    for (size_t k = 0; k < keys.size(); ++k) settings.push_back(keys[k].path + "=" + one.values[k]);
    return settings;
}

InputChecksums SweepPlan::calcInputs(const SweepCase& one) const {
    const auto calcSum = [](const std::vector<std::string>& texts) {
        Hash hash;
        for (const std::string& text : texts) hash.add(text);
        return hash.getText();
    };
    InputChecksums all = inputs;
    all["the list of settings"] = calcSum(getSettings(one));
    all["the choice of analyses"] = calcSum(only);
    // Cases with pictures also count as done where none are requested.
    if (hasPictures) all["the wish for pictures"] = calcSum({});
    return all;
}

SweptKey parseSweptKey(const std::string& text) {
    const size_t equals = text.find('=');
    SweptKey key;
    key.name = trim(text.substr(0, equals));
    if (equals == std::string::npos || key.name.empty())
        throw std::runtime_error("'" + text + "' is not NAME=VALUE,VALUE… or NAME=FROM:TO:COUNT");
    const std::string values = trim(text.substr(equals + 1));
    double from = 0, to = 0;
    int count = 0;
    const std::vector<std::string> range = splitAt(values, ':');
    if (range.size() == 3 && readNumber(trimBlanks(range[0]), from) &&
        readNumber(trimBlanks(range[1]), to) && readInteger(trimBlanks(range[2]), count)) {
        if (count < 1 || size_t(count) > MostCases)
            throw std::runtime_error("'" + text + "': the count is " + std::to_string(count) +
                                     ", not 1 to " + std::to_string(MostCases));
        key.values = makeRange(from, to, count);
    } else if (looksLikeRange(values)) {
        throw std::runtime_error("'" + text + "' is not " + key.name +
                                 "=FROM:TO:COUNT; COUNT is the number of values from FROM to TO, "
                                 "as in " +
                                 key.name + "=0:1:5");
    } else {
        key.values = splitAtCommas(values);
    }
    for (const std::string& value : key.values)
        if (value.empty()) throw std::runtime_error("'" + text + "' has an empty value");
    // A leading zero suggests the second half of 0,05.
    for (const std::string& value : key.values)
        if (double number = 0; value.size() > 1 && value[0] == '0' && value[1] >= '0' &&
                               value[1] <= '9' && readNumber(value, number))
            throw std::runtime_error("'" + text + "': no number is written as '" + value +
                                     "'; commas separate values, decimals have a point");
    return key;
}

std::vector<SweptKey> readSweptKeys(const std::string& path) {
    TextLines lines(path, "list of cases");
    std::vector<SweptKey> keys;
    while (lines.nextFilled()) {
        if (trimBlanks(lines.line())[0] == '#') continue;
        const std::vector<std::string> fields = splitAtCommas(lines.line());
        if (keys.empty()) {
            for (const std::string& name : fields) {
                if (name.empty()) lines.refuse("a column has no name");
                keys.push_back({name, {}, {}});
            }
            continue;
        }
        if (fields.size() != keys.size())
            lines.refuse(std::to_string(fields.size()) + " values for " +
                         std::to_string(keys.size()) + " columns");
        for (size_t k = 0; k < keys.size(); ++k) {
            if (fields[k].empty()) lines.refuse("'" + keys[k].name + "' has no value");
            keys[k].values.push_back(fields[k]);
        }
    }
    if (keys.empty() || keys[0].values.empty())
        throw std::runtime_error("'" + path +
                                 "' has no cases: names of parameters in its first line, " +
                                 "values below, divided by commas");
    return keys;
}

void checkSweepSettings(const ModelText& model) {
    try {
        readModel(model);
    } catch (const ModelError& error) {
        for (const std::string& setting : model.settings) {
            const size_t equals = setting.find('=');
            if (equals == std::string::npos) continue;
            const std::string values = setting.substr(equals + 1);
            const auto& mistakes = error.getMistakes();
            const bool isWrong = std::any_of(
                mistakes.begin(), mistakes.end(), [&](const ModelError::Mistake& mistake) {
                    return mistake.place.file == "setting '" + setting + "'";
                });
            if (!isWrong || (splitAtCommas(values).size() < 2 && !looksLikeRange(values))) continue;
            throw ModelError(std::string(error.what()) +
                             "\n--set gives all cases one value; several are varied by --vary " +
                             setting);
        }
        throw;
    }
}

const std::vector<std::string>& getSweepStatistics() {
    static const std::vector<std::string> statistics = {"maximum", "minimum", "mean",
                                                        "rms",     "final",   "range"};
    return statistics;
}

namespace {

/** Checks a word that must be a statistic, since it is longer than probe columns (x, yz, 12). **/
void checkStatistic(const std::string& text) {
    const size_t dot = text.rfind('.');
    const std::string last = dot == std::string::npos ? "" : text.substr(dot + 1);
    const auto& known = getSweepStatistics();
    if (last.size() < 3 || !std::all_of(last.begin(), last.end(), isLetter) ||
        std::find(known.begin(), known.end(), last) != known.end())
        return;
    std::string meant;
    for (const std::string& statistic : known)
        if (statistic.compare(0, last.size(), last) == 0) meant = statistic;
    if (meant.empty() && last.size() > 4) meant = findNearestName(last, known);
    throw std::runtime_error("--of " + text + ": '" + last + "' is not a statistic; " +
                             (meant.empty()
                                  ? "there are " + joinNames(known)
                                  : "did you mean '" + text.substr(0, dot + 1) + meant + "'?"));
}

}  // namespace

void checkSweepColumns(const SweepPlan& plan) {
    const std::vector<std::string> probes = readModel(plan.model).get("probes").getKeys();
    if (probes.empty()) return;  // default probes of the joints, known only to the built model
    for (const std::string& text : plan.of) {
        bool isKnown = false;
        // PROBE, PROBE.COLUMN, PROBE.STATISTIC, PROBE.COLUMN.STATISTIC; patterns may span dots
        for (std::string pattern = text; !isKnown;) {
            for (const std::string& probe : probes)
                isKnown |= fnmatch(pattern.c_str(), probe.c_str(), 0) == 0;
            const size_t dot = pattern.rfind('.');
            if (dot == std::string::npos) break;
            pattern.resize(dot);
        }
        if (isKnown) {
            checkStatistic(text);
            continue;
        }
        throw std::runtime_error("--of " + text + ": " +
                                 describeUnknown("probe", text.substr(0, text.find('.')), probes));
    }
}

void findSweptPaths(SweepPlan& plan) {
    const ModelValue file = readModel(plan.model), parameters = file.get("parameters");
    const std::string chapter = "parameters.";
    for (SweptKey& key : plan.keys) {
        const bool hasChapter = key.name.compare(0, chapter.size(), chapter) == 0;
        const std::string name = hasChapter ? key.name.substr(chapter.size()) : key.name;
        key.path = chapter + name;
        if (parameters.has(name)) continue;
        key.path = key.name;
        if (!hasChapter && name.find('.') != std::string::npos)
            continue;  // the reader checks
                       // these
        if (!hasChapter && findSchemaKey(getModelSchema(), name)) continue;
        parameters.failUnknown("parameter", name, parameters.getKeys());
    }
}

void makeSweepCases(SweepPlan& plan, SweepOrder order) {
    if (plan.keys.empty()) throw std::runtime_error("there is nothing to vary");
    size_t count = order == SweepOrder::Grid ? 1 : plan.keys[0].values.size();
    for (size_t k = 0; k < plan.keys.size(); ++k) {
        const SweptKey& key = plan.keys[k];
        for (size_t other = 0; other < k; ++other)
            if (plan.keys[other].name == key.name)
                throw std::runtime_error("'" + key.name + "' is varied twice");
        if (order == SweepOrder::Grid) {
            count *= std::min(key.values.size(), MostCases + 1);
        } else if (key.values.size() != count) {
            throw std::runtime_error("'" + key.name + "' has " + std::to_string(key.values.size()) +
                                     " values, '" + plan.keys[0].name + "' has " +
                                     std::to_string(count) + ": a list needs as many of each");
        }
        if (count > MostCases)
            throw std::runtime_error("the sweep has more than " + std::to_string(MostCases) +
                                     " cases");
    }
    plan.cases.clear();
    std::map<std::string, std::vector<std::string>> folders;
    for (size_t index = 0; index < count; ++index) {
        SweepCase one;
        size_t rest = index;
        for (auto key = plan.keys.rbegin(); key != plan.keys.rend(); ++key) {
            const size_t size = key->values.size();
            one.values.insert(one.values.begin(),
                              key->values[order == SweepOrder::Grid ? rest % size : index]);
            rest /= size;
        }
        one.folder = makeFolderName(plan.keys, one.values);
        const auto [known, isNew] = folders.emplace(one.folder, one.values);
        if (isNew)
            plan.cases.push_back(one);
        else if (known->second != one.values)  // equal cases are run once
            throw std::runtime_error("the cases " + listValues(plan.keys, known->second) + " and " +
                                     listValues(plan.keys, one.values) +
                                     " would have the same folder, '" + one.folder +
                                     "': write their values otherwise");
    }
}

void takeModelSweep(SweepPlan& plan, const std::string& name) {
    const ModelValue file = readModel(plan.model);
    const ModelValue analyses = file.get("analyses");
    std::vector<std::string> sweeps;
    for (const std::string& key : analyses.getKeys())
        if (analyses.get(key).get("type").getText() == "sweep") sweeps.push_back(key);
    const bool isKnown = std::find(sweeps.begin(), sweeps.end(), name) != sweeps.end();
    if (!name.empty() && !isKnown) analyses.failUnknown("analysis of type sweep", name, sweeps);
    if (sweeps.empty())
        throw std::runtime_error(
            "'" + plan.model.path +
            "' has no analysis of type sweep, and nothing is varied here: add --vary NAME=VALUES");
    if (name.empty() && sweeps.size() > 1) {
        std::string list;
        for (const std::string& sweep : sweeps) list += (list.empty() ? "" : ", ") + sweep;
        throw std::runtime_error("'" + plan.model.path +
                                 "' has several sweeps: choose by --analysis " + list);
    }
    const ModelValue sweep = analyses.get(name.empty() ? sweeps[0] : name);
    if (sweeps.size() > 1) plan.name = name;
    const ModelValue parameters = sweep.get("parameters");
    for (const std::string& key : parameters.getKeys()) {
        SweptKey swept{key, {}, {}};
        for (const double value : parameters.get(key).getNumbers())
            swept.values.push_back(writeValue(value));
        plan.keys.push_back(swept);
    }
    const std::string analysis = sweep.get("analysis").getText();
    if (!analyses.has(analysis))
        sweep.get("analysis").failUnknown("analysis", analysis, analyses.getKeys());
    // Add the analyses that an analysis starts from.
    std::vector<std::string> wanted{analysis};
    for (size_t k = 0; k < wanted.size(); ++k)
        for (const char* key : {"from", "about"}) {
            const ModelValue one = analyses.get(wanted[k]);
            if (!one.has(key)) continue;
            const std::string before = one.get(key).getText();
            if (analyses.has(before) &&
                std::find(wanted.begin(), wanted.end(), before) == wanted.end())
                wanted.push_back(before);
        }
    std::reverse(wanted.begin(), wanted.end());
    plan.only = wanted;
    if (plan.of.empty() && sweep.has("of")) plan.of = sweep.get("of").getTexts();
    makeSweepCases(plan,
                   sweep.get("combine").getText() == "list" ? SweepOrder::List : SweepOrder::Grid);
}

void checkSweepCases(SweepPlan& plan) {
    findSweptPaths(plan);
    std::set<std::string> files;
    for (SweepCase& one : plan.cases) {
        ModelText text = plan.model;
        text.settings = plan.getSettings(one);
        try {
            collectFiles(readModel(text), files);
        } catch (const std::runtime_error& error) {
            one.error = error.what();
            std::replace(one.error.begin(), one.error.end(), '\n', ' ');
        }
    }
    if (std::all_of(plan.cases.begin(), plan.cases.end(),
                    [](const SweepCase& one) { return !one.error.empty(); }))
        throw std::runtime_error("case " + plan.cases.at(0).folder + ": " + plan.cases[0].error);
    const auto calcSum = [](const auto& add) {
        PartKey key;  // follows includes of files
        add(key);
        return key.getText();
    };
    const auto quote = [](std::string path) {
        std::replace(path.begin(), path.end(), '\n', ' ');
        return "'" + path + "'";
    };
    plan.inputs.clear();
    plan.inputs["simflex"] = calcSum([](PartKey&) {});
    plan.inputs["the model file " + quote(plan.model.path)] =
        calcSum([&](PartKey& key) { key.add(plan.model.text); });
    for (const std::string& file : files)
        plan.inputs["the file " + quote(file) + " or one that it includes"] =
            calcSum([&](PartKey& key) { key.addFile(file); });
}

}  // namespace model
}  // namespace simflex
