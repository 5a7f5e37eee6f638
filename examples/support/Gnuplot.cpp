#include "support/Gnuplot.h"

#include <cstdio>
#include <memory>
#include <stdexcept>

#include "simflex/base/ChildProcess.h"

namespace simflex::examples {

bool isGnuplotAvailable() {
    return !findProgram("gnuplot").empty();
}

std::string quoteForGnuplot(const std::string& text) {
    std::string result = "'";
    for (char c : text) result += c == '\'' ? std::string("''") : std::string(1, c);
    return result + "'";
}

void runGnuplot(const std::string& script, const std::string& file) {
    const std::unique_ptr<FILE, int (*)(FILE*)> input(std::tmpfile(), std::fclose);
    if (!input || std::fwrite(script.data(), 1, script.size(), input.get()) != script.size() ||
        std::fflush(input.get()) != 0)
        throw std::runtime_error("cannot write the script for " + file);
    std::rewind(input.get());
    ChildSetup setup;
    setup.arguments = {"gnuplot", "--default-settings", "-"};
    setup.input = fileno(input.get());
    setup.output = fileno(stdout);
    setup.error = fileno(stderr);
    if (!ChildProcess(setup).wait().isSuccess())
        throw std::runtime_error("gnuplot could not draw " + file);
}

}  // namespace simflex::examples
