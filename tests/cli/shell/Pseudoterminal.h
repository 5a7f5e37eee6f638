#pragma once
/** @file
A program at a terminal of its own, typed at by a test. **/

#include <sys/types.h>

#include <map>
#include <string>
#include <vector>

namespace simflex {
namespace testing {

class Pseudoterminal {
public:
    /** @param variables  added to the environment **/
    Pseudoterminal(const std::vector<std::string>& command, const std::string& folder,
                   const std::map<std::string, std::string>& variables, int columns = 80,
                   int rows = 24);
    /** Ends the program if it still runs. **/
    ~Pseudoterminal();
    Pseudoterminal(const Pseudoterminal&) = delete;
    Pseudoterminal& operator=(const Pseudoterminal&) = delete;

    void type(const std::string& text);
    /** Reads until `text` appears after what was waited for before. @returns false if it has not
    within half a minute, or the program has ended. **/
    bool waitFor(const std::string& text);
    /** Waits until the program has ended. @returns its exit status, −signal, or −1000 if it does
    not end. **/
    int waitForEnd();

    /** All that was printed so far. **/
    const std::string& getOutput() const { return _output; }

private:
    bool read();

    int _terminal = -1;
    pid_t _process = -1;
    std::string _output;
    size_t _seen = 0;
};

}  // namespace testing
}  // namespace simflex
