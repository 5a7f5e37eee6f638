#include "simflex/cli/ProgressBar.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "simflex/base/Interruption.h"
#include "simflex/base/SecondsSince.h"
#include "simflex/base/Utf8.h"

namespace simflex {
namespace cli {
namespace {

bool isOnLine = false;  // a bar is on the terminal's last line
constexpr auto RedrawInterval = std::chrono::milliseconds(100);
constexpr auto NextLineInterval = std::chrono::seconds(10);  // without a terminal
constexpr double FirstGuess = 0.03;  // fraction of the remaining work needed for an estimate
constexpr int BarWidth = 28;

}  // namespace

ProgressBar::ProgressBar(bool quiet, std::vector<std::pair<std::string, double>> phases)
    : m_quiet(quiet),
      m_terminal(isatty(STDERR_FILENO)),
      m_phases(std::move(phases)),
      m_started(Clock::now()) {}

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
    if (m_quiet) return true;
    const bool isNew = phase != m_phase;
    if (m_doneBefore < 0 || (isNew && m_phases.empty())) {
        m_phase = phase;
        m_begun = Clock::now();
        m_doneBefore = calcDone(fraction);
    }
    if (isNew) {
        m_phase = phase;
        if (!m_terminal) {
            std::fprintf(stderr, "%7.1f s  %s\n", secondsSince(m_started),
                         makePrintable(phase).c_str());
            m_drawn = Clock::now();
        }
    }
    if (m_terminal && (isNew || Clock::now() - m_drawn > RedrawInterval))
        draw(fraction, describe ? describe() : "");
    if (!m_terminal && describe && Clock::now() - m_drawn > NextLineInterval) {
        std::fprintf(stderr, "%7.1f s  %s: %.0f %%, %s\n", secondsSince(m_started),
                     makePrintable(phase).c_str(), 100 * fraction, describe().c_str());
        m_drawn = Clock::now();
    }
    return true;
}

double ProgressBar::calcTimeLeft(double elapsed, double doneBefore, double done) {
    const double gained = done - doneBefore;
    if (!(gained > FirstGuess * (1 - doneBefore))) return NAN;
    return elapsed * (1 - done) / gained;
}

double ProgressBar::calcDone(double fraction) const {
    if (m_phases.empty()) return std::clamp(fraction, 0.0, 1.0);
    double before = 0, whole = 0;
    bool reached = false;
    for (const auto& [phase, share] : m_phases) {
        if (phase == m_phase) {
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
    m_drawn = Clock::now();
    const double elapsed = secondsSince(m_begun), done = calcDone(fraction);
    const int filled = int(done * BarWidth);
    std::string line = "[" + std::string(size_t(filled), '=') +
                       std::string(size_t(BarWidth - filled), ' ') + "] " + m_phase;
    char text[40];
    std::snprintf(text, sizeof text, ", %.1f s", elapsed);
    line += text;
    const double left = calcTimeLeft(elapsed, m_doneBefore, done);
    if (!std::isnan(left)) {
        std::snprintf(text, sizeof text, ", %.0f s left", left);
        line += text;
    }
    if (!status.empty()) line += ", " + status;
    // A wrapped line cannot be erased.
    winsize size{};
    if (ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 1 &&
        line.size() > size_t(size.ws_col - 1))
        line.resize(size_t(size.ws_col - 1));
    std::fprintf(stderr, "\r\033[K%s", makePrintable(line).c_str());
    std::fflush(stderr);
    isOnLine = true;
}

}  // namespace cli
}  // namespace simflex
