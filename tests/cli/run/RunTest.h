#pragma once
/** @file
Models run by the built program, and the resulting files. **/

#include <gmock/gmock.h>

#include <cmath>
#include <cstdint>
#include <cstring>

#include "cli/CliTest.h"
#include "simflex/model/Results.h"

namespace simflex {

class RunTest : public CliTest {
protected:
    void writeModel(const std::string& text) { testing::writeText(folder / "model.yaml", text); }

    /** Runs model.yaml without progress. @returns exit status. **/
    int runModel(const std::string& arguments = "") {
        return runProgram("SIMFLEX_CACHE=cache '" SIMFLEX_PROGRAM "'",
                          "run model.yaml --quiet " + arguments);
    }

    Results::Analysis read(const std::string& analysis,
                           const std::string& file = "model.results.h5") {
        for (const Results::Analysis& found : readResults(folder / file).analyses)
            if (found.name == analysis) return found;
        ADD_FAILURE() << "there is no analysis " << analysis << " in " << file;
        return {};
    }

    /** Returns the bytes of a result file without wall times. **/
    std::string readWithoutSeconds(const std::string& file) {
        std::string bytes = testing::readText(folder / file);
        for (const Results::Analysis& analysis : readResults(folder / file).analyses)
            for (const char* name :
                 {"integration_seconds", "output_seconds", "fmu_seconds", "fmu_library_seconds"}) {
                const auto found = analysis.statistics.find(name);
                if (found == analysis.statistics.end()) continue;
                EXPECT_GT(found->second, 0);
                std::string pattern(sizeof(double), '\0');
                std::memcpy(pattern.data(), &found->second, sizeof(double));
                const size_t at = bytes.find(pattern);
                EXPECT_NE(at, std::string::npos) << name;
                if (at != std::string::npos)
                    bytes.replace(at, sizeof(double), sizeof(double), '\0');
            }
        // Also without the final checksum of all bytes.
        return bytes.substr(0, bytes.size() - sizeof(std::uint64_t));
    }

    static const Results::Series& find(const Results::Analysis& analysis,
                                       const std::string& probe) {
        static const Results::Series none;
        for (const Results::Series& series : analysis.probes)
            if (series.column.name == probe) return series;
        ADD_FAILURE() << "there is no probe " << probe;
        return none;
    }

    /** Returns the fourth-order derivative of a column at row i. **/
    static double differentiate(const Results::Series& series, size_t i, size_t column,
                                double interval) {
        const auto at = [&](int shift) { return series.rows[size_t(int(i) + shift)][column]; };
        return (8 * (at(1) - at(-1)) - (at(2) - at(-2))) / (12 * interval);
    }
};

/** A rod of 1 m and 2 kg that hangs on a pin at Ground's origin, its centre of mass in the middle.
 **/
inline std::string makePendulum(const std::string& angle, const std::string& more) {
    return "simflex: 1\n"
           "gravity: [0, -9.81, 0]\n"
           "parameters: {angle: " +
           angle +
           "}\n"
           "bodies:\n"
           "  rod:\n"
           "    mass: 2\n"
           "    inertia: [1/6, 0.001, 1/6]\n"
           "    place: {position: [0.5*sin(angle), -0.5*cos(angle), 0], rotation: [0, 0, angle]}\n"
           "joints:\n"
           "  pivot: {type: pin, between: [ground, {on: rod, position: [0, 0.5, 0]}], axis: z}\n" +
           more;
}

}  // namespace simflex
