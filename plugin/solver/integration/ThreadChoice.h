#pragma once
/** @file
Whether one thread or many, by the time that both have taken lately (private header). Where other
programs have the processors, a team waits at each barrier for a thread that is not running, and one
thread alone is many times faster. Results are the same bits for any number.

    ThreadChoice choice(8);
    for (;;) { const int threads = choice.get(); …; choice.add(seconds); }

Now and then the slower way is tried again, for pieces enough to be sure, in a fiftieth of the time
at most. **/

namespace simflex {

class ThreadChoice {
public:
    explicit ThreadChoice(int most = 1) : m_most(most) {}

    /** Threads for the next piece of work; pieces are alike. **/
    int get() const { return m_isAlone || m_most <= 1 ? 1 : m_most; }
    int getMost() const { return m_most; }
    /** Tells how long it took. **/
    void add(double seconds);

private:
    static constexpr int Window = 8;             ///< pieces that are compared
    static constexpr double LargestPart = 0.02;  ///< of the time, for tries

    bool m_isAlone = false, m_isTry = true;
    int m_most;
    int m_pieces = 0;           ///< in this window; the first one also wakes threads up
    double m_sum = 0;           ///< of the others
    double m_mean[2] = {0, 0};  ///< many, alone; 0: unknown
    double m_untilTry = 0;      ///< time left before the other way is tried
};

}  // namespace simflex
