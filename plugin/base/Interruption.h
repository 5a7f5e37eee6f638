#pragma once
/** @file
Ctrl-C as the wish to stop: a flag that long work looks at. Internal. **/

namespace simflex {

/** Makes Ctrl-C (and a polite kill) set a flag instead of ending the program at once. A second
Ctrl-C ends it. **/
void catchInterrupts();

bool wasInterrupted();

/** Forgets a Ctrl-C and catches the next one. **/
void forgetInterrupts();

}  // namespace simflex
