#include "simflex/cli/Messages.h"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cstdarg>
#include <cstdio>
#include <memory>
#include <mutex>
#include <set>

#include "simflex/base/AsciiText.h"
#include "simflex/base/Utf8.h"
#include "simflex/cli/ProgressBar.h"

namespace simflex {
namespace cli {

namespace {

void say(const char* kind, const std::string& text) {
    ProgressBar::clearLine();
    std::fflush(stdout);
    std::fprintf(stderr, "simflex: %s: %s\n", kind, makePrintable(text).c_str());
}

/** Warnings of the program, from all threads. **/
class ToldWarnings {
public:
    void add(const std::string& text) {
        const std::lock_guard<std::mutex> lock(m_mutex);
        m_texts.insert(text);
        m_kinds.insert(withoutDigits(text));
    }
    bool has(const std::string& text) {
        const std::lock_guard<std::mutex> lock(m_mutex);
        return m_texts.count(text) > 0;
    }
    bool hasKind(const std::string& text) {
        const std::lock_guard<std::mutex> lock(m_mutex);
        return m_kinds.count(withoutDigits(text)) > 0;
    }

private:
    static std::string withoutDigits(std::string text) {
        text.erase(std::remove_if(text.begin(), text.end(),
                                  [](char c) { return isDigit(c) || c == '.' || c == '-'; }),
                   text.end());
        return text;
    }

    std::mutex m_mutex;
    std::set<std::string> m_texts, m_kinds;
};

ToldWarnings& updToldWarnings() {
    static ToldWarnings told;
    return told;
}

bool isSameFile(int a, int b) {
    struct stat first {
    }, second{};
    return fstat(a, &first) == 0 && fstat(b, &second) == 0 && first.st_dev == second.st_dev &&
           first.st_ino == second.st_ino;
}

}  // namespace

void writeOut(const char* format, ...) {
    va_list values, again;
    va_start(values, format);
    va_copy(again, values);
    std::string text(size_t(std::vsnprintf(nullptr, 0, format, values)) + 1, '\0');
    std::vsnprintf(text.data(), text.size(), format, again);
    va_end(again);
    va_end(values);
    text.pop_back();
    std::fputs(makePrintable(text).c_str(), stdout);
}

Listener makeListener(bool isQuiet) {
    const auto bar = std::make_shared<ProgressBar>(isQuiet);
    Listener listener;
    listener.progress = [bar](const std::string& phase, double fraction,
                              const Listener::Detail& detail) {
        return bar->show(phase, fraction, detail);
    };
    listener.note = [isQuiet](const std::string& text) {
        if (!isQuiet) say("note", text);
    };
    listener.warn = [](const std::string& text) {
        updToldWarnings().add(text);
        say("warning", text);
    };
    return listener;
}

Listener makeListenerOfNews(const Listener& listener) {
    Listener ofNews = listener;
    ofNews.warn = [listener](const std::string& text) {
        if (!updToldWarnings().hasKind(text)) listener.tellWarning(text);
    };
    return ofNews;
}

bool isWarningInSight(const std::string& text) {
    return updToldWarnings().has(text) && isSameFile(STDOUT_FILENO, STDERR_FILENO);
}

}  // namespace cli
}  // namespace simflex
