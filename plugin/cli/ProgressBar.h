#pragma once
/** @file
Progress on standard error: a bar with the time left on a terminal, plain lines elsewhere. **/

#include <chrono>
#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace simflex {
namespace cli {

class ProgressBar {
public:
    /** @param phases  the phases in their order, with their usual shares of the whole time (any
            scale): the time left is reckoned from them; without them each phase is a whole **/
    explicit ProgressBar(bool quiet, std::vector<std::pair<std::string, double>> phases = {});
    ~ProgressBar();

    /** Shows where the work is. @returns false once Ctrl-C was pressed.
    @param describe  makes more text for the line; called only when it is drawn **/
    bool show(const std::string& phase, double fraction,
              const std::function<std::string()>& describe = {});

    /** Time left [s] when the work goes on as it did since `doneBefore`, or NaN while that means
    nothing yet.
    @param elapsed  since then [s]
    @param doneBefore, done  parts of the whole, 0…1 **/
    static double calcTimeLeft(double elapsed, double doneBefore, double done);

    /** Takes the bar off the line, so that other text can be written. **/
    void clear() { clearLine(); }
    /** The same for whichever bar is on it. **/
    static void clearLine();

private:
    using Clock = std::chrono::steady_clock;

    /** Part of the whole that is done, 0…1. **/
    double calcDone(double fraction) const;
    void draw(double fraction, const std::string& status);

    bool m_quiet, m_terminal;
    std::vector<std::pair<std::string, double>> m_phases;
    std::string m_phase;
    Clock::time_point m_started, m_begun, m_drawn;  ///< m_begun: of the whole
    double m_doneBefore = -1;  ///< part of the whole at the first show(); negative: not shown yet
};

}  // namespace cli
}  // namespace simflex
