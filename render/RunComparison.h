#pragma once
/** @file
Two runs in one picture, seen by the same camera in the same colours: flexible against rigid.

@code
    simflex::OffscreenVisualizer rigid(rigidSystem, 960, 720), flexible(flexibleSystem, 960, 720);
    simflex::RunComparison both(rigid, flexible, {"rigid parts", "flexible parts"});
    both.fitToMotion(rigidStates, flexibleStates);
    both.addVideo("both.mp4");
    both.reportAll(rigidStates, flexibleStates);
    both.finish();
@endcode
What the pictures show is set in the two visualizers; where frames go, and plots beside them, here.
**/

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "simflex/render/OffscreenVisualizer.h"
#include "simflex/render/SideBySide.h"

namespace simflex {

class RunComparison {
public:
    /** Captions stand above the pictures. **/
    RunComparison(const OffscreenVisualizer& first, const OffscreenVisualizer& second,
                  const std::array<std::string, 2>& captions = {});
    ~RunComparison();

    /** Arrangement, gap and colours; default: beside each other, in the theme of the first. **/
    RunComparison& setStyle(const SideBySideStyle& style);

    /** Gives both the camera, the ground, the range of colours and, where it is automatic in both,
    the deformation factor that suit both motions together.
    @throws std::invalid_argument unless both have States. **/
    RunComparison& fitToMotion(const std::vector<SimTK::State>& first,
                               const std::vector<SimTK::State>& second);

    /** @name As in OffscreenVisualizer **/
    /**@{**/
    void report(const SimTK::State& first, const SimTK::State& second) const;
    /** @throws std::invalid_argument unless there are as many States of both. **/
    int reportAll(const std::vector<SimTK::State>& first, const std::vector<SimTK::State>& second,
                  const FrameProgress& progress = {}) const;
    Image drawFrame(const SimTK::State& first, const SimTK::State& second) const;
    void finish() const;
    RunComparison& setOutputFolder(const std::string& folder);
    RunComparison& setOldFrames(OldFrames old);
    RunComparison& setFrameSink(const FrameSink& sink);
    RunComparison& addVideo(const std::string& file, const VideoOptions& options = {});
    RunComparison& setNumThreads(int numThreads);
    int addPlot(const ProbePlot& plot, PlotSide side = PlotSide::Below, int size = 0);
    ProbePlot& updPlot(int plot);
    int getNumFrames() const;
    /**@}**/

private:
    class Impl;
    std::shared_ptr<Impl> impl;
};

}  // namespace simflex
