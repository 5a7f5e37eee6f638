#include "simflex/base/Interruption.h"

#include <signal.h>

namespace simflex {
namespace {

volatile sig_atomic_t interrupted = 0;

}  // namespace

void catchInterrupts() {
    struct sigaction action {};
    action.sa_handler = [](int) { interrupted = 1; };
    action.sa_flags = int(SA_RESETHAND);
    sigaction(SIGINT, &action, nullptr);
    sigaction(SIGTERM, &action, nullptr);
    struct sigaction before {};
    // The terminal was closed. Left ignored under `nohup`.
    if (sigaction(SIGHUP, nullptr, &before) == 0 && before.sa_handler != SIG_IGN)
        sigaction(SIGHUP, &action, nullptr);
    signal(SIGXFSZ, SIG_IGN);  // writing then fails, as on a full disk
}

bool wasInterrupted() {
    return interrupted != 0;
}

void forgetInterrupts() {
    interrupted = 0;
    catchInterrupts();
}

}  // namespace simflex
