#pragma once
/** @file
Two runs in one picture, with the same camera and colours: flexible against rigid.

@code
    simflex::OffscreenVisualizer rigid(rigidSystem, 960, 720), flexible(flexibleSystem, 960, 720);
    simflex::RunComparison both(rigid, flexible, {"rigid parts", "flexible parts"});
    both.fitToMotion(rigidStates, flexibleStates);
    both.addVideo("both.mp4");
    both.reportAll(rigidStates, flexibleStates);
    both.finish();
@endcode

The two visualizers determine the content of the pictures; output and plots are set here. **/

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "simflex/render/OffscreenVisualizer.h"
#include "simflex/render/SideBySide.h"

namespace simflex {

class RunComparison {
public:
    /** Captions are placed above the pictures. **/
    RunComparison(const OffscreenVisualizer& first, const OffscreenVisualizer& second,
                  const std::array<std::string, 2>& captions = {});
    ~RunComparison();

    /** Sets arrangement, gap and colours; default: side by side, in the theme of the first. **/
    RunComparison& setStyle(const SideBySideStyle& style);

    /** Fits both to both motions: camera, ground, colour range and, if automatic in both, the
    deformation factor.
    @throws std::invalid_argument unless both have States. **/
    RunComparison& fitToMotion(const std::vector<SimTK::State>& first,
                               const std::vector<SimTK::State>& second);

    /** @name As in OffscreenVisualizer **/
    /**@{**/
    void report(const SimTK::State& first, const SimTK::State& second) const;
    /** @throws std::invalid_argument unless both have the same number of States. **/
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
