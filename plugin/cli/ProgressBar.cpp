#include "simflex/cli/ProgressBar.h"

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
constexpr double kFirstGuess = 0.03;  // part done before the time left means anything
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

void forgetInterrupts() {
    interrupted = 0;
    catchInterrupts();
}

ProgressBar::ProgressBar(bool quiet, std::vector<std::pair<std::string, double>> phases)
    : _quiet(quiet),
      _terminal(isatty(STDERR_FILENO)),
      _phases(std::move(phases)),
      _started(Clock::now()) {}

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
        if (!_terminal)
            std::fprintf(stderr, "%7.1f s  %s\n", secondsSince(_started), phase.c_str());
    }
    if (_terminal && (isNew || Clock::now() - _drawn > kRedraw)) draw(fraction);
    return true;
}

double ProgressBar::calcDone(double fraction) const {
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

void ProgressBar::draw(double fraction) {
    _drawn = Clock::now();
    const double elapsed = secondsSince(_started), done = calcDone(fraction);
    const int filled = int(done * kBarWidth);
    const std::string bar =
        std::string(size_t(filled), '=') + std::string(size_t(kBarWidth - filled), ' ');
    char left[40] = "";
    if (done > kFirstGuess)
        std::snprintf(left, sizeof left, ", %.0f s left", elapsed * (1 - done) / done);
    std::fprintf(stderr, "\r\033[K[%s] %s, %.1f s%s", bar.c_str(), _phase.c_str(), elapsed, left);
    std::fflush(stderr);
    _onLine = true;
}

}  // namespace cli
}  // namespace simflex
