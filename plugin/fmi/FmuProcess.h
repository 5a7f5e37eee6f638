#pragma once
/** @file
An instance of an FMU in its own process: if it crashes, exits or hangs, this process survives. The
process runs the program simflex_fmu_host; frames of an Archive are exchanged through a socket,
which is its standard input. Internal. **/

#include <functional>

#include "simflex/base/ChildProcess.h"
#include "simflex/fmi/FmuCalls.h"

namespace simflex {

class FmuProcess : public FmuInstanceCalls {
public:
    /** @param timeout   for one reply [s]
    @param goesOn  called from time to time while waiting for a reply; false cancels the work
    @throws std::runtime_error with the end of the process or the reason given by the library. **/
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
