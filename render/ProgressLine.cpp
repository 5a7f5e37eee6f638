#include "simflex/render/ProgressLine.h"

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>

namespace simflex {

namespace {

constexpr int barWidth = 32;
constexpr auto redrawInterval = std::chrono::milliseconds(100);
constexpr double linesPerRun = 4;  // without a terminal

}  // namespace

class ProgressLine::Impl {
public:
    explicit Impl(const std::string& taskName)
        : task(taskName), start(Clock::now()), isTerminal(isatty(STDERR_FILENO)) {}

    ~Impl() {
        if (isTerminal && isShown) std::fputs("\r\033[K", stderr);
    }

    void show(int numComplete, int numFrames) {
        const double done = numFrames > 0 ? double(numComplete) / numFrames : 1;
        const double elapsed = std::chrono::duration<double>(Clock::now() - start).count();
        const double left = done > 0 ? elapsed * (1 - done) / done : 0;
        if (!isTerminal) {
            if (done < nextLine && numComplete < numFrames) return;
            if (isComplete) return;
            std::fprintf(stderr, "%s: %d of %d, %.1f s, %.1f s left\n", task.c_str(), numComplete,
                         numFrames, elapsed, left);
            while (nextLine <= done) nextLine += 1 / linesPerRun;
            isComplete = numComplete >= numFrames;
            return;
        }
        const bool isLast = numComplete >= numFrames;
        if (isComplete || (!isLast && isShown && Clock::now() - drawn < redrawInterval)) return;
        isComplete = isLast;
        drawn = Clock::now();
        isShown = true;
        std::string bar(barWidth, ' ');
        std::fill_n(bar.begin(), int(std::min(1.0, done) * barWidth), '=');
        std::fprintf(stderr, "\r\033[K%s [%s] %d of %d, %.0f s left", task.c_str(), bar.c_str(),
                     numComplete, numFrames, left);
        if (isLast)
            std::fprintf(stderr, "\r\033[K%s: %d in %.1f s\n", task.c_str(), numComplete, elapsed);
        isShown = !isLast;
        std::fflush(stderr);
    }

private:
    using Clock = std::chrono::steady_clock;

    const std::string task;
    const Clock::time_point start;
    Clock::time_point drawn;
    const bool isTerminal;
    bool isShown = false, isComplete = false;
    double nextLine = 1 / linesPerRun;
};

ProgressLine::ProgressLine(const std::string& task) : impl(std::make_shared<Impl>(task)) {}

bool ProgressLine::operator()(int numComplete, int numFrames) const {
    impl->show(numComplete, numFrames);
    return true;
}

}  // namespace simflex
