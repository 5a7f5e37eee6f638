#include "simflex/cli/Messages.h"

#include <cstdio>
#include <memory>

#include "simflex/base/Utf8.h"
#include "simflex/cli/ProgressBar.h"

namespace simflex {
namespace cli {

namespace {

void say(const char* kind, const std::string& text) {
    ProgressBar::clearLine();
    std::fflush(stdout);
    std::fprintf(stderr, "simflex: %s: %s\n", kind, makePrintable(text).c_str());
}

}  // namespace

Listener makeListener(bool isQuiet) {
    const auto bar = std::make_shared<ProgressBar>(isQuiet);
    Listener listener;
    listener.progress = [bar](const std::string& phase, double fraction,
                              const Listener::Detail& detail) {
        return bar->show(phase, fraction, detail);
    };
    listener.note = [isQuiet](const std::string& text) {
        if (!isQuiet) say("note", text);
    };
    listener.warn = [](const std::string& text) { say("warning", text); };
    return listener;
}

}  // namespace cli
}  // namespace simflex
