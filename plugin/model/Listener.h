#pragma once
/** @file
Callbacks for progress and messages of work on a model.

    Listener listener;
    listener.warn = [](const std::string& text) { log << text << '\n'; };
    listener.progress = [&](const std::string&, double, const Listener::Detail&) {
        return !isCancelled;
    };  **/

#include <functional>
#include <string>

namespace simflex {

/** Empty functions are not called. **/
struct Listener {
    using Detail = std::function<std::string()>;

    /** Called every now and then with the current phase and the fraction of it that is done, 0…1,
    or a negative number if that is not known. `detail`, if not empty, returns further text about
    it. Returning false stops the work. **/
    std::function<bool(const std::string& phase, double fraction, const Detail& detail)> progress;
    /** Information for the user: "part 'rod' is taken from the cache". **/
    std::function<void(const std::string& text)> note;
    /** Warnings that may change the meaning of results: "joint 'pin' is not closed as placed". **/
    std::function<void(const std::string& text)> warn;

    /** @name Calls that do nothing if the function is empty **/
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
