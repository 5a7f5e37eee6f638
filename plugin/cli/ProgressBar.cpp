#include "ProgressBar.h"

#include <signal.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>

namespace simflex {
namespace cli {
namespace {

volatile sig_atomic_t interrupted = 0;
constexpr auto kRedraw = std::chrono::milliseconds(100);
constexpr double kFirstGuess = 1.0;  // seconds of a phase before its time left means anything
constexpr int kBarWidth = 28;

double secondsSince(std::chrono::steady_clock::time_point start) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace

void catchInterrupts() {
    struct sigaction action {};
    action.sa_handler = [](int) { interrupted = 1; };
    action.sa_flags = int(SA_RESETHAND);
    sigaction(SIGINT, &action, nullptr);
    sigaction(SIGTERM, &action, nullptr);
}

bool wasInterrupted() {
    return interrupted != 0;
}

ProgressBar::ProgressBar(bool quiet)
    : _quiet(quiet),
      _terminal(isatty(STDERR_FILENO)),
      _started(Clock::now()),
      _phaseStarted(_started) {}

ProgressBar::~ProgressBar() {
    clear();
}

void ProgressBar::clear() {
    if (!_onLine) return;
    std::fputs("\r\033[K", stderr);
    std::fflush(stderr);
    _onLine = false;
}

bool ProgressBar::show(const std::string& phase, double fraction) {
    if (wasInterrupted()) return false;
    if (_quiet) return true;
    const bool isNew = phase != _phase;
    if (isNew) {
        _phase = phase;
        _phaseStarted = Clock::now();
        if (!_terminal)
            std::fprintf(stderr, "%7.1f s  %s\n", secondsSince(_started), phase.c_str());
    }
    if (_terminal && (isNew || Clock::now() - _drawn > kRedraw)) draw(fraction);
    return true;
}

void ProgressBar::draw(double fraction) {
    _drawn = Clock::now();
    const double elapsed = secondsSince(_phaseStarted);
    std::string bar(kBarWidth, ' ');
    char left[40] = "";
    if (fraction >= 0) {
        std::fill_n(bar.begin(), int(std::min(fraction, 1.0) * kBarWidth), '=');
        if (elapsed > kFirstGuess && fraction > 0)
            std::snprintf(left, sizeof left, ", %.0f s left", elapsed * (1 - fraction) / fraction);
    } else {
        // How long is not known: a block that moves.
        bar[size_t(elapsed * 10) % kBarWidth] = '=';
    }
    std::fprintf(stderr, "\r\033[K[%s] %s, %.1f s%s", bar.c_str(), _phase.c_str(),
                 secondsSince(_started), left);
    std::fflush(stderr);
    _onLine = true;
}

}  // namespace cli
}  // namespace simflex
