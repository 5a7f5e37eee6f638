#pragma once
/** @file
Lines typed at a terminal, by libedit: editing, history over sessions, completion. **/

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace simflex {
namespace cli {

/** What may stand where the cursor is. **/
struct Completion {
    std::string word;                     ///< as far as it was typed
    std::vector<std::string> candidates;  ///< whole words that begin like it
    char quote = 0;                       ///< that was typed before it
};

class LineEditor {
public:
    enum class Outcome { Line, Interrupted, End };
    /** Given the text before the cursor. **/
    using Completer = std::function<Completion(const std::string& text)>;

    /** @param historyFile  kept over sessions, 1000 lines at most; empty: none **/
    LineEditor(const std::string& prompt, const std::string& historyFile, Completer completer);
    ~LineEditor();
    LineEditor(const LineEditor&) = delete;
    LineEditor& operator=(const LineEditor&) = delete;

    /** Interrupted: Ctrl-C was pressed; End: Ctrl-D on an empty line. **/
    Outcome readLine(std::string& line);

    /** Of this session and those before, oldest first. **/
    std::vector<std::string> getHistory() const;

    /** $XDG_STATE_HOME/simflex/history or ~/.local/state/simflex/history; empty if there is neither
    variable. **/
    static std::string findHistoryFile();

private:
    class Implementation;
    std::unique_ptr<Implementation> m_impl;
};

}  // namespace cli
}  // namespace simflex
