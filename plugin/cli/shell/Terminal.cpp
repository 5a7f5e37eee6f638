#include "simflex/cli/shell/Terminal.h"

#include <strings.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <cstdlib>
#include <string>

namespace simflex {
namespace cli {
namespace {

std::string getVariable(const char* name) {
    const char* value = std::getenv(name);
    return value ? value : "";
}

/** As in setlocale(), the first of these variables that is set decides. **/
bool isLocaleUnicode() {
    for (const char* name : {"LC_ALL", "LC_CTYPE", "LANG"}) {
        const std::string value = getVariable(name);
        if (!value.empty())
            return strcasestr(value.c_str(), "utf-8") || strcasestr(value.c_str(), "utf8");
    }
    return false;
}

int readSize(const char* name, int otherwise) {
    const int value = std::atoi(getVariable(name).c_str());
    return value > 0 && value < 10000 ? value : otherwise;
}

}  // namespace

Terminal Terminal::detect() {
    Terminal terminal;
    const std::string term = getVariable("TERM");
    terminal.isTerminal = isatty(STDOUT_FILENO);
    terminal.hasColor =
        terminal.isTerminal && !term.empty() && term != "dumb" && getVariable("NO_COLOR").empty();
    terminal.hasUnicode = isLocaleUnicode();
    struct winsize size {};
    if (terminal.isTerminal && ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 &&
        size.ws_row > 0) {
        terminal.columns = size.ws_col;
        terminal.rows = size.ws_row;
    } else {
        terminal.columns = readSize("COLUMNS", terminal.columns);
        terminal.rows = readSize("LINES", terminal.rows);
    }
    return terminal;
}

}  // namespace cli
}  // namespace simflex
