#pragma once
/** @file
Progress of frames on standard error: a bar with the remaining time on a terminal, otherwise a few
plain lines.

@code
    viz.reportAll(states, simflex::ProgressLine("frames"));
@endcode **/

#include <memory>
#include <string>

namespace simflex {

class ProgressLine {
public:
    /** @param task  name of the work: "frames" **/
    explicit ProgressLine(const std::string& task);

    /** Shows the progress. Always returns true: continue. **/
    bool operator()(int numComplete, int numFrames) const;

private:
    class Impl;
    std::shared_ptr<Impl> impl;  // copies share the line
};

}  // namespace simflex
