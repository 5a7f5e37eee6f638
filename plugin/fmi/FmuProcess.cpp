#include "simflex/fmi/FmuProcess.h"

#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <stdexcept>

#include "simflex/base/NumberText.h"
#include "simflex/base/Progress.h"
#include "simflex/base/SecondsSince.h"
#include "simflex/fmi/CompanionFile.h"

namespace simflex {

namespace {

constexpr int LookInterval = 100;      // [ms]
constexpr double PatienceSeconds = 1;  // before a slow reply is reported
constexpr double FarewellSeconds = 2;  // for a process to end after the channel is closed
constexpr std::uint64_t LargestFrame = std::uint64_t(1) << 32;

}  // namespace

/** Duration of one exchange. **/
class FmuProcess::Watch {
public:
    Watch(const FmuProcess& process, std::string what) : m_process(process), m_what(what) {}

    const std::string& getWhat() const { return m_what; }

    /** Waits until the channel is ready. @throws std::runtime_error, Cancelled. **/
    void wait(short events) const {
        pollfd channel{m_process.m_channel, events, 0};
        while (poll(&channel, 1, LookInterval) <= 0) {
            const double seconds = secondsSince(m_start);
            if (seconds > PatienceSeconds && m_process.m_goesOn && !m_process.m_goesOn())
                throw Cancelled("an FMU did not answer: " + m_what);
            if (seconds > m_process.m_timeout)
                throw std::runtime_error(m_what + " has taken longer than " +
                                         writeGeneral(m_process.m_timeout, 3) +
                                         " s; --fmu-timeout gives an FMU more time");
        }
    }

private:
    const FmuProcess& m_process;
    std::string m_what;
    std::chrono::steady_clock::time_point m_start = std::chrono::steady_clock::now();
};

FmuProcess::FmuProcess(const FmuInstanceSetup& setup, double timeout, std::function<bool()> goesOn)
    : m_timeout(timeout), m_goesOn(std::move(goesOn)) {
    const std::string program = findCompanion("simflex_fmu_host").string();
    int ends[2];
    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0)
        throw std::runtime_error(std::string("there is no way to its process: ") +
                                 std::strerror(errno));
    m_channel = ends[0];
    try {
        ChildSetup child;
        child.arguments = {program};
        child.input = ends[1];
        child.output = child.error = STDERR_FILENO;  // its output is not a result
        child.isOwnGroup = true;                     // Ctrl-C is handled by this process
        m_child = ChildProcess(child);
        close(ends[1]);
        ends[1] = -1;
        Archive sent;
        FmuInstanceSetup wanted = setup;
        wanted.visit(sent);
        const FmuReply reply = exchange(sent, "making an instance");
        if (!reply.error.empty()) throw std::runtime_error(reply.error);
    } catch (...) {
        if (ends[1] >= 0) close(ends[1]);
        close(m_channel);
        throw;
    }
}

FmuProcess::~FmuProcess() {
    close(m_channel);
    // The process now frees its instance, unless that takes too long.
    const auto start = std::chrono::steady_clock::now();
    while (!m_child.hasEnded() && secondsSince(start) < FarewellSeconds) usleep(500);
}

FmuReply FmuProcess::ask(const std::vector<FmuCall>& calls) {
    Archive sent;
    std::vector<FmuCall> copied = calls;
    visitItems(sent, copied);
    // Name the step, which takes the time and may fail.
    const auto step = std::find_if(calls.begin(), calls.end(), [](const FmuCall& call) {
        return call.kind == FmuCall::DoStep;
    });
    return exchange(sent, step != calls.end() ? step->what : calls.at(0).what);
}

FmuReply FmuProcess::exchange(const Archive& sent, const std::string& what) {
    Watch watch(*this, what);
    std::string frame(sizeof(std::uint64_t), '\0');
    std::uint64_t size = sent.getBytes().size();
    std::memcpy(frame.data(), &size, sizeof size);
    frame += sent.getBytes();
    move(frame.data(), frame.size(), true, watch);
    move(reinterpret_cast<char*>(&size), sizeof size, false, watch);
    if (size > LargestFrame) throw std::runtime_error("its process answers nonsense");
    std::string bytes(size, '\0');
    move(bytes.data(), bytes.size(), false, watch);
    Archive received(std::move(bytes));
    FmuReply reply;
    reply.visit(received);
    return reply;
}

void FmuProcess::move(char* bytes, std::size_t size, bool isSending, Watch& watch) {
    while (size > 0) {
        const ssize_t moved = isSending ? send(m_channel, bytes, size, MSG_NOSIGNAL | MSG_DONTWAIT)
                                        : recv(m_channel, bytes, size, MSG_DONTWAIT);
        if (moved < 0 && (errno == EINTR || errno == EAGAIN)) {
            watch.wait(isSending ? POLLOUT : POLLIN);
            continue;
        }
        if (moved <= 0) failAsItEnded(watch.getWhat());
        bytes += moved;
        size -= std::size_t(moved);
    }
}

void FmuProcess::failAsItEnded(const std::string& what) {
    const auto start = std::chrono::steady_clock::now();
    while (!m_child.hasEnded() && secondsSince(start) < FarewellSeconds) usleep(500);
    throw std::runtime_error((m_child.hasEnded()
                                  ? "its process " + m_child.getEnd().describe()
                                  : std::string("its process has closed the way to it")) +
                             "; it had been asked for " + what);
}

}  // namespace simflex
