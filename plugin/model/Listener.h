#pragma once
/** @file
What work on a model tells whoever has it done.

    Listener listener;
    listener.warn = [](const std::string& text) { log << text << '\n'; };
    listener.progress = [&](const std::string&, double, const Listener::Detail&) {
        return !isCancelled;
    };  **/

#include <functional>
#include <string>

namespace simflex {

/** Functions that are empty are not called. **/
struct Listener {
    using Detail = std::function<std::string()>;

    /** Where the work is: what is being done, and the part of it that is done, 0…1; negative where
    that is not known. `detail`, if it is not empty, makes more text about it. Asked every now and
    then; false stops the work. **/
    std::function<bool(const std::string& phase, double fraction, const Detail& detail)> progress;
    /** What the user may want to know: "part 'rod' is taken from the cache". **/
    std::function<void(const std::string& text)> note;
    /** What may change the meaning of results: "joint 'pin' is not closed as placed". **/
    std::function<void(const std::string& text)> warn;

    /** @name The same where there may be nobody to tell **/
    /**@{**/
    bool tellProgress(const std::string& phase, double fraction, const Detail& detail = {}) const {
        return !progress || progress(phase, fraction, detail);
    }
    void tellNote(const std::string& text) const {
        if (note) note(text);
    }
    void tellWarning(const std::string& text) const {
        if (warn) warn(text);
    }
    /**@}**/
};

}  // namespace simflex
