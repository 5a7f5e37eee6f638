#include "support/Progress.h"

#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>

namespace simflex::examples {
namespace {

volatile sig_atomic_t interrupted = 0;
constexpr int barWidth = 32;
constexpr auto redrawInterval = std::chrono::milliseconds(100);

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

Progress::Progress(std::string task)
    : m_task(std::move(task)),
      m_start(std::chrono::steady_clock::now()),
      m_isTerminal(isatty(STDERR_FILENO)) {
    if (!m_isTerminal) std::fprintf(stderr, "%s\n", m_task.c_str());
}

double Progress::elapsed() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - m_start).count();
}

void Progress::show(double fraction) {
    m_fraction = std::clamp(fraction, 0.0, 1.0);
    const double left = m_fraction > 0 ? elapsed() * (1 - m_fraction) / m_fraction : 0;
    if (!m_isTerminal) {
        if (100 * m_fraction < m_nextPercent) return;
        std::fprintf(stderr, "  %3.0f %%, %.1f s, %.1f s left\n", 100 * m_fraction, elapsed(),
                     left);
        while (m_nextPercent <= 100 * m_fraction) m_nextPercent += 25;
        return;
    }
    const auto now = std::chrono::steady_clock::now();
    if (now - m_drawn < redrawInterval) return;
    m_drawn = now;
    std::string bar(barWidth, ' ');
    std::fill_n(bar.begin(), int(m_fraction * barWidth), '=');
    std::fprintf(stderr, "\r\033[K%s [%s] %3.0f %%, %.0f s left", m_task.c_str(), bar.c_str(),
                 100 * m_fraction, left);
    std::fflush(stderr);
}

void Progress::finish() {
    if (m_isFinished) return;
    m_isFinished = true;
    if (m_isTerminal)
        std::fprintf(stderr, "\r\033[K%s: %.0f %% in %.1f s\n", m_task.c_str(), 100 * m_fraction,
                     elapsed());
}

}  // namespace simflex::examples
