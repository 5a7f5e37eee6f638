#include "simflex/base/WorkTeam.h"

#include <unistd.h>

#include <algorithm>
#include <system_error>

#include "simflex/base/FlushDenormals.h"

namespace simflex {
namespace {

using State = std::uint64_t;

constexpr State OneAtWork = 1, AtWork = 0xffff, OneWanted = 1 << 16, Wanted = 0x7fff0000,
                Open = 1u << 31, OneLoop = State(1) << 32;
/** Spins before sleeping, some tens of microseconds: longer than the gap between two loops of a
step. **/
constexpr int Patience = 1000;
/** A piece of a short loop takes longer only if its thread is kept from running. **/
constexpr std::chrono::milliseconds LongestWait{1};
constexpr int TimesAlone = 20;

thread_local bool isInLoop = false;

void pause() {
#ifdef __SSE2__
    _mm_pause();
#endif
}

}  // namespace

WorkTeam* WorkTeam::ofThisThread() {
    thread_local WorkTeam team;
    return isInLoop ? nullptr : &team;
}

WorkTeam::~WorkTeam() {
    {
        const std::lock_guard<std::mutex> lock(m_mutex);
        m_isOver = true;
        m_opened.notify_all();
    }
    for (std::thread& helper : m_helpers)
        if (m_process == long(getpid()))
            helper.join();
        else
            helper.detach();  // the thread exists only in the process that this one was forked from
}

void WorkTeam::enlarge(int helpers) {
    m_process = long(getpid());
    try {
        while (int(m_helpers.size()) < helpers) m_helpers.emplace_back([this] { help(); });
    } catch (const std::system_error&) {
        // The system grants no more threads; work with those that have started.
    }
}

bool WorkTeam::isAnnounced(State seen) const {
    const State state = m_state;
    return (state & Open) && state / OneLoop != seen;
}

void WorkTeam::help() {
    isInLoop = true;
    bool isWanted = true;
    for (State seen = 0;;) {
        for (int k = 0; k < Patience && isWanted && !isAnnounced(seen); ++k) pause();
        if (!isAnnounced(seen)) {
            ++m_numAsleep;
            std::unique_lock<std::mutex> lock(m_mutex);
            m_opened.wait(lock, [&] { return m_isOver || isAnnounced(seen); });
            --m_numAsleep;
            if (m_isOver) return;
        }
        State state = m_state;
        if (!(state & Open) || state / OneLoop == seen) continue;
        isWanted = (state & AtWork) < (state & Wanted) / OneWanted;
        if (!isWanted) {
            seen = state / OneLoop;
            continue;
        }
        if (!m_state.compare_exchange_strong(state, state + OneAtWork)) continue;
        seen = state / OneLoop;
        work(int(state & AtWork) + 1);
        if (((m_state -= OneAtWork) & AtWork) == 0 && m_callerSleeps) {
            const std::lock_guard<std::mutex> lock(m_mutex);
            m_finished.notify_one();
        }
    }
}

void WorkTeam::work(int index) {
    const ArithmeticMode callers(m_mode);
    for (int k = 0; k < m_numShares; ++k) {
        Share& share = m_shares[size_t((index + k) % m_numShares)];
        while (share.next.load(std::memory_order_relaxed) < share.end) {
            const long begin = share.next.fetch_add(m_size, std::memory_order_relaxed);
            if (begin >= share.end) break;
            m_piece(m_loop, begin, std::min(begin + m_size, share.end));
        }
    }
}

void WorkTeam::run(long count, int shares, long size, int threads, unsigned mode, Piece piece,
                   const void* loop) {
    const Clock::time_point start = Clock::now();
    m_isAlone = m_isAlone && start < m_aloneUntil;
    if (m_isAlone) {
        isInLoop = true;
        piece(loop, 0, count);
        isInLoop = false;
        return;
    }
    const int helpers = std::min(threads, Largest) - 1;
    if (int(m_helpers.size()) < helpers) enlarge(helpers);
    if (m_roomForShares < shares) {
        m_shares.reset(new Share[size_t(shares)]);
        m_roomForShares = shares;
    }
    for (int k = 0; k < shares; ++k) {
        m_shares[size_t(k)].next.store(count * k / shares, std::memory_order_relaxed);
        m_shares[size_t(k)].end = count * (k + 1) / shares;
    }
    m_numShares = shares;
    m_size = size;
    m_mode = mode;
    m_piece = piece;
    m_loop = loop;
    isInLoop = true;
    m_state = ((m_state / OneLoop + 1) % OneLoop) * OneLoop + Open + State(helpers) * OneWanted;
    const int numAsleep = m_numAsleep, numAwake = int(m_helpers.size()) - numAsleep;
    if (numAsleep > 0 && numAwake < helpers) {
        const std::lock_guard<std::mutex> lock(m_mutex);
        for (int k = numAwake; k < helpers; ++k) m_opened.notify_one();
    }
    work(0);
    m_state &= ~State(Open);
    if (m_state & AtWork) {
        const Clock::time_point done = Clock::now();
        wait();
        const Clock::time_point end = Clock::now();
        m_isAlone = end - done > std::max<Clock::duration>(LongestWait, done - start);
        m_aloneUntil = end + TimesAlone * (end - done);
    }
    isInLoop = false;
}

void WorkTeam::wait() {
    for (int k = 0; k < Patience; ++k) {
        if ((m_state & AtWork) == 0) return;
        pause();
    }
    std::unique_lock<std::mutex> lock(m_mutex);
    m_callerSleeps = true;
    m_finished.wait(lock, [&] { return (m_state & AtWork) == 0; });
    m_callerSleeps = false;
}

}  // namespace simflex
