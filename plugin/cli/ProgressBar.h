#pragma once
/** @file
Progress on standard error: a bar with the remaining time on a terminal, plain lines elsewhere. **/

#include <chrono>
#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace simflex {
namespace cli {

class ProgressBar {
public:
    /** @param phases  the phases in order, with their usual shares of the total time (any scale),
    from which the remaining time is estimated; if empty, each phase is estimated separately **/
    explicit ProgressBar(bool quiet, std::vector<std::pair<std::string, double>> phases = {});
    ~ProgressBar();

    /** Shows the progress. @returns false once Ctrl-C was pressed.
    @param describe  makes additional text for the line; called only when it is drawn **/
    bool show(const std::string& phase, double fraction,
              const std::function<std::string()>& describe = {});

    /** Estimates the remaining time [s] from the progress since `doneBefore`; NaN if it is too
    early.
    @param elapsed  time since then [s]
    @param doneBefore, done  fractions of the total, 0…1 **/
    static double calcTimeLeft(double elapsed, double doneBefore, double done);

    /** Removes the bar from the line, so that other text can be written. **/
    void clear() { clearLine(); }
    /** Removes any bar on the line. **/
    static void clearLine();

private:
    using Clock = std::chrono::steady_clock;

    /** Returns the completed fraction of the total, 0…1. **/
    double calcDone(double fraction) const;
    void draw(double fraction, const std::string& status);

    bool m_quiet, m_terminal;
    std::vector<std::pair<std::string, double>> m_phases;
    std::string m_phase;
    Clock::time_point m_started, m_begun, m_drawn;  ///< m_begun: start of the total
    double m_doneBefore = -1;  ///< fraction at the first show(); negative: not shown yet
};

}  // namespace cli
}  // namespace simflex
