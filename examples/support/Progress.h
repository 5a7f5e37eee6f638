#pragma once
/** @file
Progress on standard error (a bar with the time left on a terminal, plain lines elsewhere), and
Ctrl-C as the wish to stop. **/

#include <chrono>
#include <string>

namespace simflex::examples {

/** From now on Ctrl-C and SIGTERM set a flag; a second one ends the program at once. **/
void catchInterrupts();
bool wasInterrupted();

class Progress {
public:
    explicit Progress(std::string task);
    ~Progress() { finish(); }
    Progress(const Progress&) = delete;
    Progress& operator=(const Progress&) = delete;

    /** @param fraction  done so far, 0…1 **/
    void show(double fraction);

    /** Ends the line with the time it took. **/
    void finish();

private:
    double elapsed() const;

    std::string m_task;
    std::chrono::steady_clock::time_point m_start, m_drawn;
    bool m_isTerminal, m_isFinished = false;
    int m_nextPercent = 25;
    double m_fraction = 0;
};

}  // namespace simflex::examples
