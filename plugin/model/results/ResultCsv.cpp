#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <stdexcept>

#include "simflex/base/NumberText.h"
#include "simflex/model/Results.h"

namespace simflex {
namespace model {
namespace {

/** A field, in quotation marks where it needs them. **/
std::string quote(const std::string& field) {
    if (field.find_first_of(",\"\r\n") == std::string::npos) return field;
    std::string quoted = "\"";
    for (const char c : field) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
    return quoted + "\"";
}

void append(std::string& line, const std::string& field) {
    line += (line.empty() ? "" : ",") + field;
}

void append(std::string& line, double value) {
    append(line, writeGeneral(value));
}

std::string makeTitles(const Results::Analysis& analysis) {
    std::string titles;
    if (analysis.type == "eigen") return "mode,frequency [Hz],damping ratio";
    if (analysis.type == "campbell") {
        append(titles, "speed");
        const size_t numModes = analysis.frequency.empty() ? 0 : analysis.frequency[0].size();
        for (size_t k = 1; k <= numModes; ++k)
            append(titles, "frequency " + std::to_string(k) + " [Hz]");
        for (size_t k = 1; k <= numModes; ++k) append(titles, "damping ratio " + std::to_string(k));
        return titles;
    }
    if (analysis.type == "transient") append(titles, "time [s]");
    for (const auto& series : analysis.probes)
        for (const std::string& column : series.column.columns)
            append(titles,
                   quote(series.column.name + (column.empty() ? "" : "." + column) +
                         (series.column.unit.empty() ? "" : " [" + series.column.unit + "]")));
    return titles;
}

std::vector<std::string> makeLines(const Results::Analysis& analysis) {
    std::vector<std::string> lines;
    if (analysis.type == "eigen") {
        for (size_t k = 0; k < analysis.frequency.at(0).size(); ++k) {
            std::string line = std::to_string(k + 1);
            append(line, analysis.frequency[0][k]);
            append(line, analysis.dampingRatio.at(0).at(k));
            lines.push_back(line);
        }
    } else if (analysis.type == "campbell") {
        for (size_t k = 0; k < analysis.speeds.size(); ++k) {
            std::string line;
            append(line, analysis.speeds[k]);
            for (const double value : analysis.frequency.at(k)) append(line, value);
            for (const double value : analysis.dampingRatio.at(k)) append(line, value);
            lines.push_back(line);
        }
    } else {
        const size_t numRows = analysis.type == "static" ? 1 : analysis.time.size();
        for (size_t k = 0; k < numRows; ++k) {
            std::string line;
            if (analysis.type == "transient") append(line, analysis.time[k]);
            for (const auto& series : analysis.probes)
                for (const double value : series.rows.at(k)) append(line, value);
            lines.push_back(line);
        }
    }
    return lines;
}

}  // namespace

}  // namespace model

using namespace model;

void writeResultCsv(const std::string& path, const Results::Analysis& analysis) {
    const std::unique_ptr<FILE, int (*)(FILE*)> file(std::fopen(path.c_str(), "w"), std::fclose);
    if (!file) throw std::runtime_error("cannot write '" + path + "': " + std::strerror(errno));
    std::fprintf(file.get(), "%s\n", makeTitles(analysis).c_str());
    for (const std::string& line : makeLines(analysis))
        std::fprintf(file.get(), "%s\n", line.c_str());
    if (std::fflush(file.get()) != 0 || std::ferror(file.get()))
        throw std::runtime_error("cannot write all of '" + path + "'; is the disk full?");
}

}  // namespace simflex
