#pragma once
/** @file
METIS seeds and draws on the process's rand(): orders of systems analysed at the same time would
depend on each other, and the user's random numbers would start again. Private header.

    {
        const OwnRandom random;
        METIS_NodeND(…);
    }

While one lives, rand() has a state of ours and nobody else draws on it by way of METIS; then the
user's numbers go on as if nothing had been. Not for what it cannot know: a thread of the user's own
that calls rand() at the very same time. **/

#include <cstdlib>
#include <mutex>

namespace simflex {

class OwnRandom {
public:
    OwnRandom() : m_lock(getMutex()), m_users(initstate(1, m_state, sizeof m_state)) {}
    ~OwnRandom() { setstate(m_users); }
    OwnRandom(const OwnRandom&) = delete;
    OwnRandom& operator=(const OwnRandom&) = delete;

private:
    /** One for the whole process, whatever libraries hide: both of ours order by METIS. **/
    __attribute__((visibility("default"))) static std::mutex& getMutex() {
        static std::mutex mutex;
        return mutex;
    }

    std::lock_guard<std::mutex> m_lock;
    char m_state[128];
    char* m_users;
};

}  // namespace simflex
