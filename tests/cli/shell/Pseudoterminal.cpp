#include "Pseudoterminal.h"

#include <poll.h>
#include <pty.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <stdexcept>

namespace simflex {
namespace testing {

namespace {

using Clock = std::chrono::steady_clock;
constexpr auto kPatience = std::chrono::minutes(2);

}  // namespace

Pseudoterminal::Pseudoterminal(const std::vector<std::string>& command, const std::string& folder,
                               const std::map<std::string, std::string>& variables, int columns,
                               int rows) {
    struct winsize size {};
    size.ws_col = static_cast<unsigned short>(columns);
    size.ws_row = static_cast<unsigned short>(rows);
    _process = forkpty(&_terminal, nullptr, nullptr, &size);
    if (_process < 0) throw std::runtime_error("there is no pseudoterminal");
    if (_process > 0) return;
    if (chdir(folder.c_str()) != 0) _exit(126);
    for (const auto& [name, value] : variables) setenv(name.c_str(), value.c_str(), 1);
    std::vector<char*> arguments;
    for (const std::string& word : command) arguments.push_back(const_cast<char*>(word.c_str()));
    arguments.push_back(nullptr);
    execv(arguments[0], arguments.data());
    _exit(127);
}

Pseudoterminal::~Pseudoterminal() {
    if (_process > 0) {
        kill(_process, SIGKILL);
        waitpid(_process, nullptr, 0);
    }
    close(_terminal);
}

void Pseudoterminal::type(const std::string& text) {
    for (size_t done = 0; done < text.size();) {
        const ssize_t count = write(_terminal, text.data() + done, text.size() - done);
        if (count <= 0) throw std::runtime_error("nobody reads what is typed");
        done += size_t(count);
    }
}

bool Pseudoterminal::read() {
    struct pollfd ready {
        _terminal, POLLIN, 0
    };
    if (poll(&ready, 1, 200) <= 0) return true;
    char bytes[4096];
    const ssize_t count = ::read(_terminal, bytes, sizeof bytes);
    if (count <= 0) return false;
    _output.append(bytes, size_t(count));
    return true;
}

bool Pseudoterminal::waitFor(const std::string& text) {
    for (const auto end = Clock::now() + kPatience; Clock::now() < end;) {
        const size_t found = _output.find(text, _seen);
        if (found != std::string::npos) {
            _seen = found + text.size();
            return true;
        }
        if (!read()) return false;
    }
    return false;
}

int Pseudoterminal::waitForEnd() {
    for (const auto end = Clock::now() + kPatience; Clock::now() < end;) {
        const bool isOpen = read();
        int status = 0;
        if (waitpid(_process, &status, isOpen ? WNOHANG : 0) != _process) continue;
        _process = -1;
        return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
    }
    return -1000;
}

}  // namespace testing
}  // namespace simflex
