#include "support/Await.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <exception>
#include <thread>

namespace simflex {
namespace testing {

bool await(const std::string& what, const std::function<bool()>& isSo) {
    using Clock = std::chrono::steady_clock;
    std::chrono::duration<double, std::milli> pause(0.05);
    for (const auto end = Clock::now() + std::chrono::minutes(2); Clock::now() < end;) {
        if (isSo()) return true;
        std::this_thread::sleep_for(pause);
        if (pause.count() < 5) pause *= 1.2;
    }
    ADD_FAILURE() << "waited two minutes for " << what;
    return false;
}

int startChild(const std::function<int()>& work) {
    const pid_t child = fork();
    if (child != 0) return child;
    int status = 99;
    try {
        status = work();
    } catch (const std::exception& error) {
        std::fprintf(stderr, "%s\n", error.what());
    }
    _exit(status);
}

bool hasEnded(int child) {
    siginfo_t info{};
    return waitid(P_PID, id_t(child), &info, WEXITED | WNOHANG | WNOWAIT) != 0 ||
           info.si_pid == child;
}

}  // namespace testing
}  // namespace simflex
