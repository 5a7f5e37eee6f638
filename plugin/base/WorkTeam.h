#pragma once
/** @file
Threads that share a loop with the one that calls (private header, see ParallelFor.h). Nobody waits
for a thread that has not come: whoever has done his share takes from those of others, and only
pieces that have been begun are waited for, with patience for some microseconds, then asleep. Where
a thread was kept from ending its piece, by other programs that had its processor, the caller is
alone for twenty times as long as that took. **/

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

namespace simflex {

class WorkTeam {
public:
    static constexpr int Largest = 1 << 12;  ///< threads

    /** That of the calling thread; null inside of a loop. **/
    static WorkTeam* ofThisThread();

    WorkTeam() = default;
    ~WorkTeam();
    WorkTeam(const WorkTeam&) = delete;
    WorkTeam& operator=(const WorkTeam&) = delete;

    /** A piece of a loop; throws nothing. **/
    using Piece = void (*)(const void* loop, long begin, long end);

    /** Runs all of 0 … count−1 in pieces of at most `size`.
    @param shares  each begins with one thread, in order; 1: pieces are taken in order
    @param mode  see ArithmeticMode **/
    void run(long count, int shares, long size, int threads, unsigned mode, Piece piece,
             const void* loop);

private:
    struct alignas(64) Share {
        std::atomic<long> next{0};
        long end = 0;
    };

    using Clock = std::chrono::steady_clock;

    void enlarge(int helpers);
    /** Until nobody is at work. **/
    void wait();
    void help();
    void work(int index);
    bool isAnnounced(std::uint64_t seen) const;

    std::vector<std::thread> m_helpers;
    long m_process = 0;  ///< that the helpers live in
    std::unique_ptr<Share[]> m_shares;
    int m_roomForShares = 0;

    bool m_isAlone = false;
    Clock::time_point m_aloneUntil;

    // The loop.
    int m_numShares = 0;
    long m_size = 1;
    unsigned m_mode = 0;
    Piece m_piece = nullptr;
    const void* m_loop = nullptr;

    /** Number of the loop, whether it is open, helpers wanted, helpers at work. **/
    alignas(64) std::atomic<std::uint64_t> m_state{0};
    alignas(64) std::atomic<int> m_numAsleep{0};
    std::atomic<bool> m_callerSleeps{false}, m_isOver{false};
    std::mutex m_mutex;
    std::condition_variable m_opened, m_finished;
};

}  // namespace simflex
