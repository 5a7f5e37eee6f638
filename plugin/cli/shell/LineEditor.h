#pragma once
/** @file
Line input from a terminal by libedit: editing, persistent history, completion. **/

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace simflex {
namespace cli {

/** Possible completions at the cursor. **/
struct Completion {
    std::string word;                     ///< as typed so far
    std::vector<std::string> candidates;  ///< complete words that begin with it
    char quote = 0;                       ///< typed before it
};

class LineEditor {
public:
    enum class Outcome { Line, Interrupted, End };
    /** Receives the text before the cursor. **/
    using Completer = std::function<Completion(const std::string& text)>;

    /** @param historyFile  persistent history, at most 1000 lines; empty: none **/
    LineEditor(const std::string& prompt, const std::string& historyFile, Completer completer);
    ~LineEditor();
    LineEditor(const LineEditor&) = delete;
    LineEditor& operator=(const LineEditor&) = delete;

    /** Reads a line. Interrupted: Ctrl-C was pressed; End: Ctrl-D on an empty line. **/
    Outcome readLine(std::string& line);

    /** Returns the lines of this session and earlier ones, oldest first. **/
    std::vector<std::string> getHistory() const;

    /** Returns $XDG_STATE_HOME/simflex/history or ~/.local/state/simflex/history, "" if neither
    variable is set. **/
    static std::string findHistoryFile();

private:
    class Implementation;
    std::unique_ptr<Implementation> m_impl;
};

}  // namespace cli
}  // namespace simflex
