#pragma once
/** @file
Progress on standard error: a bar with the time left on a terminal, plain lines elsewhere; and
Ctrl-C as the wish to stop. **/

#include <chrono>
#include <string>

namespace simflex {
namespace cli {

class ProgressBar {
public:
    explicit ProgressBar(bool quiet);
    ~ProgressBar();

    /** Shows where the work is. @returns false once Ctrl-C was pressed. **/
    bool show(const std::string& phase, double fraction);

    /** Takes the bar off the line, so that other text can be written. **/
    void clear();

private:
    using Clock = std::chrono::steady_clock;

    void draw(double fraction);

    bool _quiet, _terminal;
    std::string _phase;
    Clock::time_point _started, _phaseStarted, _drawn;
    bool _onLine = false;
};

/** Makes Ctrl-C (and a polite kill) set a flag instead of ending the program at once. A second
Ctrl-C ends it. **/
void catchInterrupts();

bool wasInterrupted();

}  // namespace cli
}  // namespace simflex
