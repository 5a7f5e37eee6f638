#pragma once
/** @file
Models at the prompt of the built program. **/

#include <gmock/gmock.h>

#include <cmath>
#include <sstream>

#include "cli/CliTest.h"
#include "simflex/base/NumberText.h"

namespace simflex {

class ShellTest : public CliTest {
protected:
    void writeModel(const std::string& text) { testing::writeText(folder / "model.yaml", text); }

    /** A rod of 1 m and 2 kg that hangs on a pin at Ground's origin. **/
    void writePendulum(const std::string& more = "") {
        writeModel(R"(simflex: 1
title: Pendulum
gravity: [0, -9.81, 0]
parameters: {L: 1, mass: 2}
bodies:
  rod: {mass: mass, inertia: [mass*L^2/12, 0.001, mass*L^2/12], shape: {box: [0.02, L/2, 0.02]}, place: {position: [0, -L/2, 0]}}
joints:
  pivot: {type: pin, between: [ground, {on: rod, position: [0, L/2, 0]}], axis: z}
solver: {accuracy: 1e-8}
)" + more);
    }

    /** Commands, one a line, from standard input. @returns exit status. **/
    int shell(const std::string& commands, const std::string& arguments = "model.yaml -q") {
        testing::writeText(folder / "commands", commands);
        return runProgram("LC_ALL=C.UTF-8 SIMFLEX_CACHE=cache '" SIMFLEX_PROGRAM "'",
                          "shell " + arguments + " <commands");
    }

    /** Numbers after "NAME = " of the last such line of the output. **/
    std::vector<double> read(const std::string& name) const {
        const size_t at = ("\n" + out).rfind("\n" + name + " = ");
        if (at == std::string::npos) {
            ADD_FAILURE() << "no '" << name << " = ' in " << out << err;
            return {0, 0, 0};
        }
        std::string text = out.substr(at + name.size() + 3);
        text = text.substr(0, text.find('\n'));
        for (char& c : text)
            if (c == '[' || c == ']' || c == ',') c = ' ';
        std::istringstream stream(text);
        std::vector<double> numbers;
        for (double number; stream >> number;) numbers.push_back(number);
        if (numbers.empty()) numbers.push_back(std::nan(""));
        return numbers;
    }
    double readNumber(const std::string& name) const { return read(name)[0]; }

    /** All numbers of a file, with all their digits. **/
    std::vector<double> readNumbers(const std::string& file) const {
        std::istringstream words(testing::readText(folder / file));
        std::vector<double> numbers;
        double number = 0;
        for (std::string word; words >> word;)
            if (simflex::readNumber(word, number)) numbers.push_back(number);
        return numbers;
    }

    /** Cells of the line of a table that begins with this word. **/
    std::vector<std::string> readRow(const std::string& word) const {
        std::istringstream lines(out);
        for (std::string line; std::getline(lines, line);) {
            std::istringstream stream(line);
            std::vector<std::string> cells;
            for (std::string cell; stream >> cell;) cells.push_back(cell);
            if (!cells.empty() && cells[0] == word) return cells;
        }
        ADD_FAILURE() << "no line of '" << word << "' in " << out << err;
        return std::vector<std::string>(10, "0");
    }
};

}  // namespace simflex
