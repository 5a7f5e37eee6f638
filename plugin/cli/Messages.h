#pragma once
/** @file
Messages of the program. Names of files and their content are untrusted: terminal control characters
in them are removed. Standard error carries, besides errors,

    note     where the work is, what was found or done without; -q hides it
    warning  what may change the meaning of a result; nothing hides it, and it is kept with the
             results

    const Listener listener = makeListener(isQuiet);
    listener.tellNote("resumed from crank.h5.resume");       // nothing, if it is quiet
    listener.tellWarning("joint 'pin' is not closed");       // simflex: warning: joint 'pin' …  **/

#include <string>

#include "simflex/model/Listener.h"

namespace simflex {
namespace cli {

/** As std::printf(), without control characters, see makePrintable(). **/
[[gnu::format(printf, 1, 2)]] void writeOut(const char* format, ...);

/** Prints messages and, unless quiet, a progress bar; Ctrl-C cancels the work. **/
Listener makeListener(bool isQuiet);
/** As makeListener(), without warnings that differ only in numbers from one already printed: for a
second run of the same model. **/
Listener makeListenerOfNews(const Listener& listener);

/** Returns whether repeating a warning is redundant: it was printed, and standard output is the
same terminal or file as standard error. **/
bool isWarningInSight(const std::string& text);

}  // namespace cli
}  // namespace simflex
