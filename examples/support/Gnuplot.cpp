#include "support/Gnuplot.h"

#include <cstdio>
#include <cstdlib>
#include <stdexcept>

namespace simflex::examples {

bool isGnuplotAvailable() {
    return std::system("command -v gnuplot >/dev/null 2>&1") == 0;
}

std::string quoteForGnuplot(const std::string& text) {
    std::string result = "'";
    for (char c : text) result += c == '\'' ? std::string("''") : std::string(1, c);
    return result + "'";
}

void runGnuplot(const std::string& script, const std::string& file) {
    FILE* gnuplot = popen("gnuplot", "w");
    if (!gnuplot) throw std::runtime_error("cannot start gnuplot");
    const bool isWritten = std::fwrite(script.data(), 1, script.size(), gnuplot) == script.size();
    if (pclose(gnuplot) != 0 || !isWritten)
        throw std::runtime_error("gnuplot could not draw " + file);
}

}  // namespace simflex::examples
