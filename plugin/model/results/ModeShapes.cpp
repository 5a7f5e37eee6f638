#include "simflex/model/results/ModeShapes.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <set>
#include <stdexcept>

#include "simflex/base/NumberText.h"
#include "simflex/model/file/NearestName.h"
#include "simflex/model/results/ProbeChoice.h"
#include "simflex/model/results/UniversalFile.h"
#include "simflex/part/TextLines.h"

namespace simflex {
namespace model {
namespace {

using ShapeValues = std::vector<std::complex<double>>;

constexpr double SameAbscissa = 1e-6;  // relative
constexpr double StandsOut = 4;        // ratio of |H|², 6 dB
constexpr double SameAssurance = 1e-6;
constexpr double OfMode = 1e-9;       // round-off relative to the largest value of the mode
constexpr double OfAllModes = 1e-12;  // and of all modes, which may differ much in magnitude

/** Splits a line at commas, except within quotation marks. **/
std::vector<std::string> splitCsvLine(std::string_view line) {
    std::vector<std::string> fields(1);
    bool isQuoted = false;
    for (const char c : line) {
        if (c == '"')
            isQuoted = !isQuoted;
        else if (c == ',' && !isQuoted)
            fields.emplace_back();
        else if (c != '\r')
            fields.back() += c;
    }
    for (std::string& field : fields) field = std::string(trimBlanks(field));
    return fields;
}

ModeShapes readShapeTable(const std::string& path) {
    constexpr const char *frequencyTitle = "frequency [Hz]", *imaginaryTitle = "imaginary ";
    TextLines lines(path, "table of modes");
    if (!lines.nextFilled()) throw std::runtime_error(path + " is empty");
    const std::vector<std::string> titles = splitCsvLine(lines.line());
    ModeShapes modes;
    size_t frequency = titles.size();
    std::vector<std::pair<size_t, bool>> places(titles.size(), {titles.size(), false});
    for (size_t k = 0; k < titles.size(); ++k) {
        if (titles[k] == frequencyTitle) frequency = k;
        if (titles[k] == frequencyTitle || titles[k] == "mode" || titles[k] == "damping ratio" ||
            titles[k].rfind(imaginaryTitle, 0) == 0)
            continue;
        if (std::find(modes.outputs.begin(), modes.outputs.end(), titles[k]) != modes.outputs.end())
            lines.refuse("there are two columns '" + titles[k] + "'");
        places[k].first = modes.outputs.size();
        modes.outputs.push_back(titles[k]);
    }
    if (frequency == titles.size())
        lines.refuse(std::string("no column is called '") + frequencyTitle + "'");
    for (size_t k = 0; k < titles.size(); ++k) {
        if (titles[k].rfind(imaginaryTitle, 0) != 0) continue;
        const std::string of = titles[k].substr(std::string(imaginaryTitle).size());
        const auto found = std::find(modes.outputs.begin(), modes.outputs.end(), of);
        if (found == modes.outputs.end()) lines.refuse("there is no column '" + of + "'");
        places[k] = {size_t(found - modes.outputs.begin()), true};
    }
    while (lines.nextFilled()) {
        const std::vector<std::string> fields = splitCsvLine(lines.line());
        if (fields.size() != titles.size())
            lines.refuse("it has " + std::to_string(fields.size()) + " fields, the titles " +
                         std::to_string(titles.size()));
        modes.frequency.push_back(lines.parseNumber(fields[frequency], "the frequency"));
        ShapeValues& shape = modes.shapes.emplace_back(modes.outputs.size(), 0.0);
        for (size_t k = 0; k < fields.size(); ++k) {
            if (places[k].first == titles.size()) continue;
            const double value = lines.parseNumber(fields[k], "the shape");
            shape.at(places[k].first) +=
                places[k].second ? std::complex<double>(0, value) : std::complex<double>(value);
        }
    }
    return modes;
}

/** "12.x", and the sign of the direction. **/
std::pair<std::string, int> nameFreedom(const UniversalFile::Freedom& freedom) {
    constexpr const char* names[] = {"", ".x", ".y", ".z", ".rx", ".ry", ".rz"};
    const int direction = std::abs(freedom.direction);
    return {std::to_string(freedom.node) + (direction <= 6 ? names[direction] : ".?"),
            freedom.direction < 0 ? -1 : 1};
}

ModeShapes takeMeasuredShapes(const UniversalFile& file) {
    ModeShapes modes;
    for (const UniversalFile::Shape& shape : file.shapes) {
        std::map<std::string, std::complex<double>> values;
        for (const auto& [freedom, value] : shape.values)
            values[nameFreedom(freedom).first] = value * double(nameFreedom(freedom).second);
        if (modes.shapes.empty())
            for (const auto& entry : values) modes.outputs.push_back(entry.first);
        modes.frequency.push_back(shape.frequency);
        ShapeValues& own = modes.shapes.emplace_back();
        for (const std::string& output : modes.outputs) {
            const auto found = values.find(output);
            if (found == values.end())
                throw std::runtime_error("the shape at " + writeGeneral(shape.frequency, 6) +
                                         " Hz lacks '" + output + "', which the first one has");
            own.push_back(found->second);
        }
    }
    return modes;
}

/** Positions of peaks that stand out from the minima between them and higher values. **/
std::vector<size_t> findPeaks(const std::vector<double>& values) {
    std::vector<size_t> peaks;
    for (size_t k = 1; k + 1 < values.size(); ++k) {
        if (!(values[k] > values[k - 1] && values[k] >= values[k + 1])) continue;
        double left = values[k], right = values[k];
        for (size_t i = k; i-- > 0 && values[i] <= values[k];) left = std::min(left, values[i]);
        for (size_t i = k + 1; i < values.size() && values[i] <= values[k]; ++i)
            right = std::min(right, values[i]);
        if (values[k] > StandsOut * std::max(left, right)) peaks.push_back(k);
    }
    return peaks;
}

/** True for a fixed sensor and a roving hammer, treated as a fixed hammer and a roving sensor. **/
bool isRovingHammer(const UniversalFile& file) {
    std::set<int> nodes;
    std::set<std::string> outputs, references;
    for (const UniversalFile::Response& response : file.responses) {
        nodes.insert(response.output.node);
        outputs.insert(nameFreedom(response.output).first);
        references.insert(nameFreedom(response.reference).first);
    }
    return nodes.size() == 1 && references.size() > outputs.size();
}

ModeShapes takePeaks(const UniversalFile& file) {
    ModeShapes modes;
    const bool isRoving = isRovingHammer(file);
    const auto takeFixed = [&](const UniversalFile::Response& response) {
        return nameFreedom(isRoving ? response.output : response.reference);
    };
    const auto takeMoved = [&](const UniversalFile::Response& response) {
        return nameFreedom(isRoving ? response.reference : response.output);
    };
    std::set<std::string> others;
    const std::string fixed = takeFixed(file.responses[0]).first;
    std::vector<const UniversalFile::Response*> chosen;
    for (const UniversalFile::Response& response : file.responses) {
        if (takeFixed(response).first != fixed) {
            others.insert(takeFixed(response).first);
            continue;
        }
        const std::string name = takeMoved(response).first;
        const std::string both =
            isRoving ? "'" + fixed + "' by '" + name + "'" : "'" + name + "' by '" + fixed + "'";
        const auto& first = file.responses[0].frequency;
        bool isSame = response.frequency.size() == first.size();
        for (size_t k = 0; isSame && k < first.size(); ++k)
            isSame = std::abs(response.frequency[k] - first[k]) <= SameAbscissa * first.back();
        if (!isSame)
            throw std::runtime_error("the response of " + both +
                                     " has other frequencies than the first");
        if (std::find(modes.outputs.begin(), modes.outputs.end(), name) != modes.outputs.end())
            throw std::runtime_error("there are two responses of " + both);
        modes.outputs.push_back(name);
        chosen.push_back(&response);
    }
    std::vector<double> sum(file.responses[0].frequency.size(), 0.0);
    for (const auto* response : chosen)
        for (size_t k = 0; k < sum.size(); ++k) sum[k] += std::norm(response->values[k]);
    for (const size_t peak : findPeaks(sum)) {
        modes.frequency.push_back(file.responses[0].frequency[peak]);
        ShapeValues& shape = modes.shapes.emplace_back();
        for (const auto* response : chosen)
            shape.push_back(response->values[peak] *
                            double(takeFixed(*response).second * takeMoved(*response).second));
    }
    modes.notes.push_back(
        "shapes are responses " +
        (isRoving
             ? "of '" + fixed + "' to forces there, by reciprocity those there to a force at '" +
                   fixed + "',"
             : "to '" + fixed + "'") +
        " at their peaks: neighbouring modes have a part in them");
    if (!others.empty())
        modes.notes.push_back(std::string("other ") + (isRoving ? "responses" : "references") +
                              " are left out: " + joinNames({others.begin(), others.end()}));
    return modes;
}

/** Values above round-off: whether any mode moves an output, and the smallest significant value of
each mode. **/
struct Movement {
    std::vector<bool> isMoving;
    std::vector<double> smallest;
};

Movement findMovement(const ModeShapes& modes) {
    Movement movement{std::vector<bool>(modes.outputs.size(), false), {}};
    double largest = 0;
    for (const ShapeValues& shape : modes.shapes)
        for (const auto& value : shape) largest = std::max(largest, std::abs(value));
    for (const ShapeValues& shape : modes.shapes) {
        double own = 0;
        for (const auto& value : shape) own = std::max(own, std::abs(value));
        movement.smallest.push_back(std::max(OfMode * own, OfAllModes * largest));
        for (size_t k = 0; k < shape.size(); ++k)
            if (std::abs(shape[k]) > movement.smallest.back()) movement.isMoving[k] = true;
    }
    return movement;
}

/** The shape at those places; all zero if none of them moves. **/
ShapeValues takeMoving(const ShapeValues& shape, const std::vector<size_t>& places,
                       double smallest) {
    ShapeValues taken;
    bool isMoving = false;
    for (const size_t place : places) {
        taken.push_back(shape.at(place));
        isMoving = isMoving || std::abs(taken.back()) > smallest;
    }
    return isMoving ? taken : ShapeValues(places.size(), 0.0);
}

}  // namespace

ModeShapes getModeShapes(const Results::Analysis& analysis) {
    const auto re = analysis.matrices.find("shape_real"),
               im = analysis.matrices.find("shape_imaginary");
    if (analysis.type != "eigen" || re == analysis.matrices.end() || im == analysis.matrices.end())
        throw std::runtime_error("analysis '" + analysis.name +
                                 "' has no shapes of modes: run one of type eigen with 'outputs: "
                                 "[PROBE …]'");
    ModeShapes modes;
    modes.outputs = analysis.outputs;
    modes.units = analysis.outputUnits;
    modes.frequency = analysis.frequency.at(0);
    for (size_t i = 0; i < modes.frequency.size(); ++i) {
        ShapeValues& shape = modes.shapes.emplace_back();
        for (size_t k = 0; k < modes.outputs.size(); ++k)
            shape.emplace_back(re->second.at(i).at(k), im->second.at(i).at(k));
    }
    return modes;
}

ModeShapes readModeShapes(const std::string& path, const std::string& analysis) {
    const std::string extension = std::filesystem::path(path).extension().string();
    ModeShapes modes;
    if (extension == ".h5" || extension == ".hdf5") {
        const Results results = readResults(path, ReadStates::No);
        std::string chosen = analysis;
        for (const Results::Analysis& other : results.analyses)
            if (chosen.empty() && other.type == "eigen" && !other.outputs.empty())
                chosen = other.name;
        modes = getModeShapes(chooseAnalysis(results, path, chosen));
    } else if (extension == ".csv") {
        modes = readShapeTable(path);
    } else {
        const UniversalFile file = readUniversalFile(path);
        try {
            if (file.shapes.empty() && file.responses.empty())
                throw std::runtime_error(
                    "it has neither shapes of modes (dataset 55) nor "
                    "frequency response functions (dataset 58)");
            modes = file.shapes.empty() ? takePeaks(file) : takeMeasuredShapes(file);
        } catch (const std::runtime_error& error) {
            throw std::runtime_error(path + ": " + error.what());
        }
    }
    if (modes.frequency.empty()) throw std::runtime_error(path + ": it has no modes");
    return modes;
}

bool ModeShapes::nameNode(const std::string& node, const std::string& name) {
    bool isAny = false;
    for (std::string& output : outputs) {
        if (output.rfind(node + '.', 0) != 0) continue;
        const std::string renamed = name + output.substr(node.size());
        if (std::find(outputs.begin(), outputs.end(), renamed) != outputs.end())
            throw std::runtime_error("'" + node + "' is to be '" + name + "', and there is a '" +
                                     renamed + "' already");
        output = renamed;
        isAny = true;
    }
    return isAny;
}

double calcModalAssurance(const std::vector<std::complex<double>>& a,
                          const std::vector<std::complex<double>>& b) {
    std::complex<double> product = 0;
    double sizes[2] = {0, 0};
    for (size_t k = 0; k < std::min(a.size(), b.size()); ++k) {
        product += std::conj(a[k]) * b[k];
        sizes[0] += std::norm(a[k]);
        sizes[1] += std::norm(b[k]);
    }
    const double own = sizes[0] * sizes[1];
    return own > 0 ? std::norm(product) / own : 0;
}

ModalAssurance calcModalAssurance(const ModeShapes& a, const ModeShapes& b) {
    ModalAssurance alike;
    const Movement moves[2] = {findMovement(a), findMovement(b)};
    std::vector<size_t> inA, inB;
    std::vector<std::string> still;
    std::set<std::string> units;
    for (size_t k = 0; k < a.outputs.size(); ++k) {
        const auto found = std::find(b.outputs.begin(), b.outputs.end(), a.outputs[k]);
        if (found == b.outputs.end()) continue;
        const size_t l = size_t(found - b.outputs.begin());
        // In a single mode, a zero may be a node of its shape.
        const bool movesInA = moves[0].isMoving[k], movesInB = moves[1].isMoving[l];
        const bool isCounted = (movesInA && movesInB) || (movesInA && b.shapes.size() == 1) ||
                               (movesInB && a.shapes.size() == 1);
        if (!isCounted) {
            still.push_back(a.outputs[k]);
            continue;
        }
        alike.outputs.push_back(a.outputs[k]);
        inA.push_back(k);
        inB.push_back(l);
        for (const auto& [of, place] : {std::pair(&a, k), std::pair(&b, l)})
            if (!of->units.empty()) units.insert(of->units.at(place));
    }
    const std::string notMoving =
        joinNames(still) + (still.size() == 1 ? " is" : " are") + " zero in all modes of one side";
    if (alike.outputs.size() < 2) {
        std::string why = "the first has shapes at " + joinNames(a.outputs) + ", the second at " +
                          joinNames(b.outputs) + ": ";
        if (!still.empty()) why += notMoving + ", and ";
        if (alike.outputs.empty())
            why += still.empty() ? "none of these is the same" : "no other is the same";
        else
            why += "'" + alike.outputs[0] + "' alone is alike in all modes";
        for (const auto& [of, which] : {std::pair(&a, "first"), std::pair(&b, "second")})
            if (of->outputs.size() == 1)
                throw std::runtime_error(why + "; the " + which +
                                         " needs shapes at two outputs or more");
        throw std::runtime_error(why + "; name nodes of a test by --point NODE=PROBE");
    }
    if (!still.empty()) alike.notes.push_back(notMoving + ": left out");
    const size_t most = std::max(a.frequency.size(), b.frequency.size());
    if (alike.outputs.size() < most)
        alike.notes.push_back(std::to_string(alike.outputs.size()) +
                              " outputs tell no more modes apart, and there are " +
                              std::to_string(most));
    if (units.size() > 1)
        alike.notes.push_back("outputs have different units (" +
                              joinNames({units.begin(), units.end()}) +
                              "): which of them count depends on these");
    for (size_t i = 0; i < a.shapes.size(); ++i) {
        const ShapeValues first = takeMoving(a.shapes[i], inA, moves[0].smallest[i]);
        auto& row = alike.values.emplace_back();
        for (size_t k = 0; k < b.shapes.size(); ++k)
            row.push_back(
                calcModalAssurance(first, takeMoving(b.shapes[k], inB, moves[1].smallest[k])));
    }
    return alike;
}

std::optional<size_t> ModalAssurance::findPartner(size_t mode, const std::vector<double>& own,
                                                  const std::vector<double>& others) const {
    const std::vector<double>& row = values.at(mode);
    std::optional<size_t> partner;
    const double best = row.empty() ? 0 : *std::max_element(row.begin(), row.end());
    if (best < LeastAlike) return partner;
    for (size_t k = 0; k < row.size(); ++k) {
        if (row[k] < best - SameAssurance) continue;
        const double away = std::abs(others.at(k) - own.at(mode));
        if (!partner || away < std::abs(others.at(*partner) - own.at(mode))) partner = k;
    }
    return partner;
}

}  // namespace model
}  // namespace simflex
