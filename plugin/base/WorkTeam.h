#pragma once
/** @file
A team of threads that share a loop with the calling thread (private header, see ParallelFor.h). The
caller does not wait for threads that have not started: a thread that has finished its share takes
pieces from those of others, and only pieces in progress are waited for, by spinning for some
microseconds and then sleeping. If other programs kept a thread from finishing its piece, the caller
works alone for twenty times as long as that took. **/

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
    static constexpr int Largest = 1 << 12;  ///< number of threads

    /** Returns the calling thread's team, null inside a loop. **/
    static WorkTeam* ofThisThread();

    WorkTeam() = default;
    ~WorkTeam();
    WorkTeam(const WorkTeam&) = delete;
    WorkTeam& operator=(const WorkTeam&) = delete;

    /** A piece of a loop. Must not throw. **/
    using Piece = void (*)(const void* loop, long begin, long end);

    /** Runs 0 … count−1 in pieces of at most `size`.
    @param shares  ranges, each of which one thread starts with, in order; 1: pieces are taken in
    order
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
    /** Waits until no helper is working. **/
    void wait();
    void help();
    void work(int index);
    bool isAnnounced(std::uint64_t seen) const;

    std::vector<std::thread> m_helpers;
    long m_process = 0;  ///< process that owns the helpers
    std::unique_ptr<Share[]> m_shares;
    int m_roomForShares = 0;

    bool m_isAlone = false;
    Clock::time_point m_aloneUntil;

    // Current loop.
    int m_numShares = 0;
    long m_size = 1;
    unsigned m_mode = 0;
    Piece m_piece = nullptr;
    const void* m_loop = nullptr;

    /** Packed: number of the loop, open flag, helpers wanted, helpers working. **/
    alignas(64) std::atomic<std::uint64_t> m_state{0};
    alignas(64) std::atomic<int> m_numAsleep{0};
    std::atomic<bool> m_callerSleeps{false}, m_isOver{false};
    std::mutex m_mutex;
    std::condition_variable m_opened, m_finished;
};

}  // namespace simflex
