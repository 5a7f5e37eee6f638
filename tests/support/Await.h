#pragma once
/** @file
Bounded waiting for other processes and threads. **/

#include <functional>
#include <string>

namespace simflex {
namespace testing {

/** Waits until `isSo` returns true, for at most two minutes (enough for a busy machine).
@returns false if it never does; the test then fails with a message that names `what`. **/
bool await(const std::string& what, const std::function<bool()>& isSo);

/** Runs `work` in a child process whose exit status is the return value of `work`, or 99 if it
throws. An exception must not reach GoogleTest, which would run the remaining tests a second time.
@returns the process id. **/
int startChild(const std::function<int()>& work);

/** Whether a child process has ended. Its status can still be waited for. **/
bool hasEnded(int child);

}  // namespace testing
}  // namespace simflex
