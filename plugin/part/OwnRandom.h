#pragma once
/** @file
Isolates METIS from the process's rand(), which it seeds and uses: orderings computed concurrently
would depend on each other, and the user's random sequence would restart. Private header.

    {
        const OwnRandom random;
        METIS_NodeND(…);
    }

During an object's lifetime rand() has a private state, and other uses of METIS wait. Afterwards the
user's sequence continues. User threads that call rand() at the same time are not protected. **/

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
    /** One mutex for the process, whatever the libraries' visibility: both of ours use METIS. **/
    __attribute__((visibility("default"))) static std::mutex& getMutex() {
        static std::mutex mutex;
        return mutex;
    }

    std::lock_guard<std::mutex> m_lock;
    char m_state[128];
    char* m_users;
};

}  // namespace simflex
