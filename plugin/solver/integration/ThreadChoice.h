#pragma once
/** @file
Chooses between one thread and many by their recent timings (private header). Where other programs
occupy the processors, a team waits at each barrier for a thread that is not running, and one thread
is many times faster. Results do not depend on the choice.

    ThreadChoice choice(8);
    for (;;) { const int threads = choice.get(); …; choice.add(seconds); }

The slower option is retried now and then, long enough for a reliable comparison, using at most a
fiftieth of the time. **/

namespace simflex {

class ThreadChoice {
public:
    explicit ThreadChoice(int most = 1) : m_most(most) {}

    /** Number of threads for the next piece of work; pieces are alike. **/
    int get() const { return m_isAlone || m_most <= 1 ? 1 : m_most; }
    int getMost() const { return m_most; }
    /** Records its duration. **/
    void add(double seconds);

private:
    static constexpr int Window = 8;             ///< pieces per comparison
    static constexpr double LargestPart = 0.02;  ///< of the time, for retries

    bool m_isAlone = false, m_isTry = true;
    int m_most;
    int m_pieces = 0;           ///< in this window; the first one also wakes threads
    double m_sum = 0;           ///< time of the others
    double m_mean[2] = {0, 0};  ///< many threads, one thread; 0: unknown
    double m_untilTry = 0;      ///< time left until the next retry
};

}  // namespace simflex
