#pragma once
/** @file
What the program says on standard error besides errors:

    note     where the work is, what was found or done without; -q hides it
    warning  what may change the meaning of a result; nothing hides it, and it is kept with the
             results

    const Listener listener = makeListener(isQuiet);
    listener.tellNote("resumed from crank.h5.resume");       // nothing, if it is quiet
    listener.tellWarning("joint 'pin' is not closed");       // simflex: warning: joint 'pin' … **/

#include "simflex/model/Listener.h"

namespace simflex {
namespace cli {

/** Messages, and a progress bar if there are notes; Ctrl-C stops the work. **/
Listener makeListener(bool isQuiet);

}  // namespace cli
}  // namespace simflex
