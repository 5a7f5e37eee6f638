#include "simflex/cli/ProgressBar.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "simflex/base/Interruption.h"
#include "simflex/base/SecondsSince.h"

namespace simflex {
namespace cli {
namespace {

bool isOnLine = false;  // a bar, on the terminal's last line
constexpr auto kRedraw = std::chrono::milliseconds(100);
constexpr auto kNextLine = std::chrono::seconds(10);  // where there is no terminal
constexpr double kFirstGuess = 0.03;  // of what is to do: done before the time left means anything
constexpr int kBarWidth = 28;

}  // namespace

ProgressBar::ProgressBar(bool quiet, std::vector<std::pair<std::string, double>> phases)
    : _quiet(quiet),
      _terminal(isatty(STDERR_FILENO)),
      _phases(std::move(phases)),
      _started(Clock::now()) {}

ProgressBar::~ProgressBar() {
    clear();
}

void ProgressBar::clearLine() {
    if (!isOnLine) return;
    std::fputs("\r\033[K", stderr);
    std::fflush(stderr);
    isOnLine = false;
}

bool ProgressBar::show(const std::string& phase, double fraction,
                       const std::function<std::string()>& describe) {
    if (wasInterrupted()) return false;
    if (_quiet) return true;
    const bool isNew = phase != _phase;
    if (_doneBefore < 0 || (isNew && _phases.empty())) {
        _phase = phase;
        _begun = Clock::now();
        _doneBefore = calcDone(fraction);
    }
    if (isNew) {
        _phase = phase;
        if (!_terminal) {
            std::fprintf(stderr, "%7.1f s  %s\n", secondsSince(_started), phase.c_str());
            _drawn = Clock::now();
        }
    }
    if (_terminal && (isNew || Clock::now() - _drawn > kRedraw))
        draw(fraction, describe ? describe() : "");
    if (!_terminal && describe && Clock::now() - _drawn > kNextLine) {
        std::fprintf(stderr, "%7.1f s  %s: %.0f %%, %s\n", secondsSince(_started), phase.c_str(),
                     100 * fraction, describe().c_str());
        _drawn = Clock::now();
    }
    return true;
}

double ProgressBar::calcTimeLeft(double elapsed, double doneBefore, double done) {
    const double gained = done - doneBefore;
    if (!(gained > kFirstGuess * (1 - doneBefore))) return NAN;
    return elapsed * (1 - done) / gained;
}

double ProgressBar::calcDone(double fraction) const {
    if (_phases.empty()) return std::clamp(fraction, 0.0, 1.0);
    double before = 0, whole = 0;
    bool reached = false;
    for (const auto& [phase, share] : _phases) {
        if (phase == _phase) {
            reached = true;
            before += share * std::clamp(fraction, 0.0, 1.0);
        } else if (!reached) {
            before += share;
        }
        whole += share;
    }
    return reached ? before / whole : 0;
}

void ProgressBar::draw(double fraction, const std::string& status) {
    _drawn = Clock::now();
    const double elapsed = secondsSince(_begun), done = calcDone(fraction);
    const int filled = int(done * kBarWidth);
    std::string line = "[" + std::string(size_t(filled), '=') +
                       std::string(size_t(kBarWidth - filled), ' ') + "] " + _phase;
    char text[40];
    std::snprintf(text, sizeof text, ", %.1f s", elapsed);
    line += text;
    const double left = calcTimeLeft(elapsed, _doneBefore, done);
    if (!std::isnan(left)) {
        std::snprintf(text, sizeof text, ", %.0f s left", left);
        line += text;
    }
    if (!status.empty()) line += ", " + status;
    // A line that wraps could not be taken back.
    winsize size{};
    if (ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 1 &&
        line.size() > size_t(size.ws_col - 1))
        line.resize(size_t(size.ws_col - 1));
    std::fprintf(stderr, "\r\033[K%s", line.c_str());
    std::fflush(stderr);
    isOnLine = true;
}

}  // namespace cli
}  // namespace simflex
