#include "simflex/cli/Messages.h"

#include <cstdio>
#include <memory>

#include "simflex/cli/ProgressBar.h"

namespace simflex {
namespace cli {

namespace {

void say(const char* kind, const std::string& text) {
    ProgressBar::clearLine();
    std::fflush(stdout);
    std::fprintf(stderr, "simflex: %s: %s\n", kind, text.c_str());
}

}  // namespace

void Messages::note(const std::string& text) const {
    if (_notes == Notes::Shown) say("note", text);
}

void Messages::warn(const std::string& text) const {
    say("warning", text);
}

std::function<void(const std::string&)> Messages::getNote() const {
    return [*this](const std::string& text) { note(text); };
}

std::function<void(const std::string&)> Messages::getWarn() const {
    return [*this](const std::string& text) { warn(text); };
}

Listener Messages::makeListener(bool showsProgress) const {
    const auto bar = std::make_shared<ProgressBar>(!showsProgress);
    return {[bar](const std::string& phase, double fraction, const Listener::Detail& detail) {
                return bar->show(phase, fraction, detail);
            },
            getNote(), getWarn()};
}

}  // namespace cli
}  // namespace simflex
