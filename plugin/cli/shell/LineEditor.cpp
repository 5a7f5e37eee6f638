#include "simflex/cli/shell/LineEditor.h"

#include <fcntl.h>
#include <histedit.h>
#include <poll.h>
#include <signal.h>
#include <sys/stat.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <clocale>
#include <cstdio>
#include <cstdlib>
#include <cwchar>
#include <filesystem>
#include <stdexcept>

#include "simflex/base/Interruption.h"
#include "simflex/base/UnfinishedFile.h"
#include "simflex/base/Utf8.h"
#include "simflex/cli/shell/CommandText.h"
#include "simflex/cli/shell/Terminal.h"

namespace simflex {
namespace cli {

namespace fs = std::filesystem;

namespace {

constexpr int HistorySize = 1000;

std::string findCommonBeginning(const std::vector<std::string>& words) {
    std::string common = words.front();
    for (const std::string& word : words) {
        const auto end = std::mismatch(common.begin(), common.end(), word.begin(), word.end());
        common.erase(end.first, common.end());
    }
    return common;
}

/** Prints words in as many columns as fit; long lists end with the number of words left out. **/
void printColumns(const std::vector<std::string>& words) {
    constexpr size_t mostRows = 20;
    size_t width = 0;
    for (const std::string& word : words) width = std::max(width, word.size() + 2);
    const size_t columns = std::max<size_t>(1, size_t(Terminal::detect().columns) / width);
    const size_t shown = std::min(words.size(), mostRows * columns);
    std::fputs("\n", stdout);
    for (size_t i = 0; i < shown; ++i) {
        const bool isLast = (i + 1) % columns == 0 || i + 1 == shown;
        std::printf("%-*s%s", isLast ? 0 : int(width), words[i].c_str(), isLast ? "\n" : "");
    }
    if (shown < words.size()) std::printf("and %zu more\r\n", words.size() - shown);
    std::fflush(stdout);
}

volatile sig_atomic_t resized = 0, resumed = 0;
int wakeUp[2] = {-1, -1};  // self-pipe: signals may reach any thread, and just before poll()
void (*noteInterrupt)(int) = nullptr;

void hearSignal(int signal) {
    const int error = errno;
    if (signal == SIGWINCH)
        resized = 1;
    else if (signal == SIGCONT)
        resumed = 1;
    else
        noteInterrupt(signal);
    const ssize_t written = write(wakeUp[1], "", 1);  // a full pipe also wakes the reader
    static_cast<void>(written);
    errno = error;
}

void drain(int pipe) {
    char bytes[64];
    while (read(pipe, bytes, sizeof bytes) > 0) {
    }
}

/** Handles Ctrl-C, changes of the window size and job control while a line is edited. **/
class TerminalSignals {
public:
    TerminalSignals() {
        if (wakeUp[0] < 0 && pipe2(wakeUp, O_CLOEXEC | O_NONBLOCK) != 0)
            throw std::runtime_error("cannot make a pipe");
        drain(wakeUp[0]);
        struct sigaction action {};
        sigaction(SIGINT, nullptr, &action);
        noteInterrupt = action.sa_handler;  // as set by forgetInterrupts()
        action = {};
        action.sa_handler = hearSignal;
        for (size_t i = 0; i < HeardSignals.size(); ++i)
            sigaction(HeardSignals[i], &action, &m_before[i]);
    }
    ~TerminalSignals() {
        for (size_t i = 0; i < HeardSignals.size(); ++i)
            sigaction(HeardSignals[i], &m_before[i], nullptr);
    }
    TerminalSignals(const TerminalSignals&) = delete;
    TerminalSignals& operator=(const TerminalSignals&) = delete;

private:
    static constexpr std::array<int, 4> HeardSignals{SIGINT, SIGTERM, SIGWINCH, SIGCONT};
    std::array<struct sigaction, 4> m_before{};
};

/** Returns false, with errno EINTR, after a signal, including one just before the call. **/
bool waitForInput() {
    struct pollfd sources[] = {{STDIN_FILENO, POLLIN, 0}, {wakeUp[0], POLLIN, 0}};
    errno = EINTR;
    if (wasInterrupted() || poll(sources, 2, -1) < 0) return false;
    if (!sources[1].revents) return true;
    drain(wakeUp[0]);
    errno = EINTR;
    return false;
}

/** Replaces libedit's own reader, which forwards signals to the whole process group. **/
int readCharacter(EditLine* editor, wchar_t* character) {
    std::mbstate_t state{};
    for (;;) {
        char byte = 0;
        const ssize_t count = waitForInput() ? read(STDIN_FILENO, &byte, 1) : -1;
        if (count == 0) return 0;
        if (count < 0) {
            if (errno != EINTR || wasInterrupted()) return -1;
            if (resumed) el_set(editor, EL_PREP_TERM, 1);
            if (resized) el_resize(editor);
            if (resumed) el_set(editor, EL_REFRESH);
            resumed = resized = 0;
            continue;
        }
        const size_t length = std::mbrtowc(character, &byte, 1, &state);
        if (length == size_t(-2)) continue;
        if (length == size_t(-1)) {
            state = {};
            continue;
        }
        return 1;
    }
}

}  // namespace

class LineEditor::Implementation {
public:
    Implementation(const std::string& givenPrompt, const std::string& givenHistoryFile,
                   Completer givenCompleter)
        : prompt(givenPrompt), historyFile(givenHistoryFile), completer(std::move(givenCompleter)) {
        std::setlocale(LC_CTYPE, "");
        past = history_init();
        editor = el_init("simflex", stdin, stdout, stderr);
        if (!past || !editor) throw std::runtime_error("libedit cannot edit lines here");
        HistEvent event;
        history(past, &event, H_SETSIZE, HistorySize);
        history(past, &event, H_SETUNIQUE, 1);
        if (!historyFile.empty()) history(past, &event, H_LOAD, historyFile.c_str());
        el_set(editor, EL_CLIENTDATA, this);
        el_set(editor, EL_PROMPT, getPrompt);
        el_set(editor, EL_EDITOR, "emacs");
        el_set(editor, EL_HIST, history, past);
        el_set(editor, EL_ADDFN, "simflex-complete", "Complete the word", complete);
        el_set(editor, EL_BIND, "^I", "simflex-complete", nullptr);
        el_set(editor, EL_BIND, "^R", "em-inc-search-prev", nullptr);
        el_set(editor, EL_SIGNAL, 0);
        for (const char* mode : {"-d", "-x"})  // otherwise Ctrl-C discards subsequent output
            el_set(editor, EL_SETTY, mode, "+noflsh", nullptr);
        el_set(editor, EL_GETCFN, readCharacter);
        el_source(editor, nullptr);  // ~/.editrc
    }
    ~Implementation() {
        el_end(editor);
        history_end(past);
    }

    void save() const {
        if (historyFile.empty()) return;
        std::error_code ignored;  // the prompt also works without a history
        fs::create_directories(fs::path(historyFile).parent_path(), ignored);
        const mode_t mask = umask(0077);
        try {
            UnfinishedFile file(historyFile);
            HistEvent event;
            if (history(past, &event, H_SAVE, file.getPath().c_str()) >= 0)
                file.finish(Durability::ProcessEnd);
        } catch (const std::runtime_error&) {
        }
        umask(mask);
    }

    static char* getPrompt(EditLine* editor) { return get(editor).prompt.data(); }

    static unsigned char complete(EditLine* editor, int) {
        const LineInfo* line = el_line(editor);
        const std::string text(line->buffer, line->cursor);
        const Completion found = get(editor).completer(text);
        if (found.candidates.empty()) return CC_REFRESH_BEEP;
        const std::string common = findCommonBeginning(found.candidates);
        const bool isOnly = found.candidates.size() == 1;
        const bool goesOn = common.back() == '/' || common.back() == '.';
        if (common.size() > found.word.size() || (isOnly && !goesOn)) {
            std::string insertion = common.substr(found.word.size());
            char quote = found.quote;
            if (!quote && quoteWord(common) != common) {
                quote = quoteWord(common)[0];
                el_deletestr(editor, int(countCharacters(found.word)));
                insertion = quote + common;
            }
            if (isOnly && !goesOn && quote) insertion += quote;
            if (isOnly && !goesOn) insertion += ' ';
            if (el_insertstr(editor, insertion.c_str()) < 0) return CC_REFRESH_BEEP;
            return CC_REFRESH;
        }
        printColumns(found.candidates);
        return CC_REDISPLAY;
    }

    static Implementation& get(EditLine* editor) {
        Implementation* self = nullptr;
        el_get(editor, EL_CLIENTDATA, &self);
        return *self;
    }

    std::string prompt, historyFile;
    Completer completer;
    History* past = nullptr;
    EditLine* editor = nullptr;
};

LineEditor::LineEditor(const std::string& prompt, const std::string& historyFile,
                       Completer completer)
    : m_impl(new Implementation(prompt, historyFile, std::move(completer))) {}

LineEditor::~LineEditor() = default;

LineEditor::Outcome LineEditor::readLine(std::string& line) {
    forgetInterrupts();
    const TerminalSignals signals;
    el_resize(m_impl->editor);
    el_set(m_impl->editor, EL_PREP_TERM, 1);  // before the prompt is printed
    int length = 0;
    const char* text = el_gets(m_impl->editor, &length);
    if (wasInterrupted()) {
        el_reset(m_impl->editor);
        tcflush(STDIN_FILENO, TCIFLUSH);  // input typed before libedit was ready
        std::puts("^C");
        return Outcome::Interrupted;
    }
    if (!text || length <= 0) return Outcome::End;
    line.assign(text, size_t(length));
    while (!line.empty() && (line.back() == '\n' || line.back() == '\r')) line.pop_back();
    if (line.find_first_not_of(" \t") != std::string::npos) {
        HistEvent event;
        history(m_impl->past, &event, H_ENTER, line.c_str());
        m_impl->save();
    }
    return Outcome::Line;
}

std::vector<std::string> LineEditor::getHistory() const {
    std::vector<std::string> lines;
    HistEvent event;
    for (int found = history(m_impl->past, &event, H_LAST); found >= 0;
         found = history(m_impl->past, &event, H_PREV)) {
        lines.emplace_back(event.str);
        while (!lines.back().empty() && lines.back().back() == '\n') lines.back().pop_back();
    }
    return lines;
}

std::string LineEditor::findHistoryFile() {
    if (const char* state = std::getenv("XDG_STATE_HOME"); state && state[0] == '/')
        return std::string(state) + "/simflex/history";
    if (const char* home = std::getenv("HOME"); home && home[0] == '/')
        return std::string(home) + "/.local/state/simflex/history";
    return "";
}

}  // namespace cli
}  // namespace simflex
