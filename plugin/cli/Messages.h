#pragma once
/** @file
What the program says. Names of files, and of what is in them, may be anybody's: a terminal obeys
nothing that comes from them. On standard error besides errors:

    note     where the work is, what was found or done without; -q hides it
    warning  what may change the meaning of a result; nothing hides it, and it is kept with the
             results

    const Listener listener = makeListener(isQuiet);
    listener.tellNote("resumed from crank.h5.resume");       // nothing, if it is quiet
    listener.tellWarning("joint 'pin' is not closed");       // simflex: warning: joint 'pin' … **/

#include <string>

#include "simflex/model/Listener.h"

namespace simflex {
namespace cli {

/** std::printf(), of which control characters are left out, see makePrintable(). **/
[[gnu::format(printf, 1, 2)]] void writeOut(const char* format, ...);

/** Messages, and a progress bar if there are notes; Ctrl-C stops the work. **/
Listener makeListener(bool isQuiet);
/** The same without warnings that differ in numbers alone from one that was told: for a run of the
same model once more. **/
Listener makeListenerOfNews(const Listener& listener);

/** Whether a reader has this warning before his eyes: it was told, and where it would be printed
again is the same terminal or file. **/
bool isWarningInSight(const std::string& text);

}  // namespace cli
}  // namespace simflex
