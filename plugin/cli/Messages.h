#pragma once
/** @file
What the program says on standard error besides errors:

    note     where the work is, what was found or done without; -q hides it
    warning  what may change the meaning of a result; nothing hides it, and it is kept with the
             results

    const Messages messages(Messages::Notes::Hidden);
    messages.note("resumed from crank.h5.resume");       // nothing
    messages.warn("joint 'pin' is not closed");          // simflex: warning: joint 'pin' …  **/

#include <functional>
#include <string>

#include "simflex/model/Listener.h"

namespace simflex {
namespace cli {

class Messages {
public:
    enum class Notes { Shown, Hidden };
    explicit Messages(Notes notes) : _notes(notes) {}
    /** As -q wants it. **/
    static Messages makeQuietIf(bool isQuiet) {
        return Messages(isQuiet ? Notes::Hidden : Notes::Shown);
    }

    void note(const std::string& text) const;
    void warn(const std::string& text) const;

    /** @name The same for libraries, which take functions **/
    /**@{**/
    std::function<void(const std::string&)> getNote() const;
    std::function<void(const std::string&)> getWarn() const;
    /** Messages, and a progress bar if there are notes; Ctrl-C stops the work. **/
    Listener makeListener() const { return makeListener(_notes == Notes::Shown); }
    Listener makeListener(bool showsProgress) const;
    /**@}**/

private:
    Notes _notes;
};

}  // namespace cli
}  // namespace simflex
