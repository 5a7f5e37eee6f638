#pragma once
/** @file
Progress of frames on standard error: a bar with the time left on a terminal, a few plain lines
elsewhere.

@code
    viz.reportAll(states, simflex::ProgressLine("frames"));
@endcode **/

#include <memory>
#include <string>

namespace simflex {

class ProgressLine {
public:
    /** Says what is done: "frames". **/
    explicit ProgressLine(const std::string& task);

    /** Shows how many of how many are done. Always goes on: true. **/
    bool operator()(int numComplete, int numFrames) const;

private:
    class Impl;
    std::shared_ptr<Impl> impl;  // copies share the line
};

}  // namespace simflex
