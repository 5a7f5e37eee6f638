#pragma once
/** @file
An instance of an FMU in a process of its own: one that crashes, exits or never answers does not
take this process along. The process is the program simflex_fmu_host; frames of an Archive go to and
fro through a socket, which is its standard input. Internal. **/

#include <functional>

#include "simflex/base/ChildProcess.h"
#include "simflex/fmi/FmuCalls.h"

namespace simflex {

class FmuProcess : public FmuInstanceCalls {
public:
    /** @param timeout   [s] for one answer
    @param goesOn  asked every now and then while an answer takes long; false stops the work
    @throws std::runtime_error that says how the process ended or what the library lacks. **/
    FmuProcess(const FmuInstanceSetup& setup, double timeout, std::function<bool()> goesOn);
    ~FmuProcess() override;
    FmuProcess(const FmuProcess&) = delete;
    FmuProcess& operator=(const FmuProcess&) = delete;

    FmuReply ask(const std::vector<FmuCall>& calls) override;

private:
    class Watch;

    FmuReply exchange(const Archive& sent, const std::string& what);
    void move(char* bytes, std::size_t size, bool isSending, Watch& watch);
    [[noreturn]] void failAsItEnded(const std::string& what);

    double m_timeout;
    std::function<bool()> m_goesOn;
    ChildProcess m_child;
    int m_channel = -1;
};

}  // namespace simflex
