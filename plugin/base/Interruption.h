#pragma once
/** @file
Ctrl-C sets a flag that long computations poll. Internal. **/

namespace simflex {

/** Makes SIGINT, SIGTERM and SIGHUP set a flag instead of ending the program. A second signal of
the same kind ends it. **/
void catchInterrupts();

bool wasInterrupted();

/** Clears the flag and catches the next Ctrl-C. **/
void forgetInterrupts();

}  // namespace simflex
