// Stands in for `simflex run` where sweeps are tested: turns at the speed that --set gives. Tells
// its runs in ../runs.txt. A negative speed fails; at 7 rad/s it waits half way for Ctrl-C, and is
// done when it goes on.

#include <signal.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>

#include "simflex/model/results/ResultWriter.h"

using namespace simflex;
using namespace simflex::model;

int main(int argc, char** argv) {
    double speed = 0;
    bool resumes = false;
    std::string output;
    const std::string setting = "parameters.speed=";
    for (int k = 1; k < argc; ++k) {
        const std::string argument = argv[k];
        if (argument.compare(0, setting.size(), setting) == 0)
            speed = std::atof(argument.c_str() + setting.size());
        if (argument == "--resume") resumes = true;
        if (argument == "-o" && k + 1 < argc) output = argv[k + 1];
    }
    sigset_t interrupts;
    sigemptyset(&interrupts);
    sigaddset(&interrupts, SIGINT);
    sigprocmask(SIG_BLOCK, &interrupts, nullptr);
    std::ofstream("../runs.txt", std::ios::app)
        << std::to_string(int(speed)) + (resumes ? " on\n" : "\n") << std::flush;
    if (speed < 0) {
        std::fprintf(stderr, "simflex: working\nsimflex: the speed is negative\n");
        return 1;
    }
    ResultWriter writer(output, ResultHeader());
    writer.beginTransient("run", {{"turn", "rad", {""}}});
    for (int k = 0; k <= 10; ++k) writer.addRow(0.1 * k, {speed * 0.1 * k});
    if (speed == 7 && !resumes) {
        int received = 0;
        sigwait(&interrupts, &received);
        return 130;
    }
    writer.setComplete("run");
    return 0;
}
