#pragma once
/** @file
Waiting for other processes and threads, with an end. **/

#include <functional>
#include <string>

namespace simflex {
namespace testing {

/** Waits until `isSo`, for two minutes at most: long enough for a machine with much to do.
@returns false, and the test has failed with `what` was waited for, if it never is so. **/
bool await(const std::string& what, const std::function<bool()>& isSo);

/** Starts `work` in a process of its own, whose exit status is what it returns, or 99 if it throws:
what is thrown must not go on into GoogleTest, which would run the other tests a second time.
@returns the process. **/
int startChild(const std::function<int()>& work);

/** Whether a child process has ended; its status can still be waited for. **/
bool hasEnded(int child);

}  // namespace testing
}  // namespace simflex
