#include "simflex/render/RunComparison.h"

#include <algorithm>
#include <optional>
#include <stdexcept>

#include "OffscreenVisualizerImpl.h"
#include "simflex/render/overlay/FramePlots.h"

namespace simflex {

using SimTK::State;
using Visualizer = OffscreenVisualizer::Impl;

class RunComparison::Impl {
public:
    Impl(const OffscreenVisualizer& first, const OffscreenVisualizer& second,
         const std::array<std::string, 2>& pictureCaptions)
        : copies{first, second},
          visualizers{first.impl.get(), second.impl.get()},
          captions(pictureCaptions) {}

    void fitToMotion(const std::array<const std::vector<State>*, 2>& states) {
        for (int i : {0, 1})
            if (states[i]->empty())
                throw std::invalid_argument(
                    std::string("RunComparison::fitToMotion: no States of the ") +
                    (i == 0 ? "first" : "second") + " run");
        const auto look = [&](bool onlyFirst) {
            Visualizer::MotionBounds bounds;
            for (int i : {0, 1}) {
                Visualizer::Motion motion = Visualizer::toMotion(*states[i]);
                if (onlyFirst) motion.numStates = 1;
                visualizers[i]->appendBounds(motion, bounds);
            }
            for (Visualizer* visualizer : visualizers) visualizer->fitViews(bounds);
            return bounds.values;
        };
        if (visualizers[0]->isFactorAutomatic && visualizers[1]->isFactorAutomatic) {
            LargestDisplacement largest;
            for (int i : {0, 1}) {
                visualizers[i]->automaticFactor = 1;
                largest.include(
                    visualizers[i]->calcLargestDisplacement(Visualizer::toMotion(*states[i])));
            }
            if (largest.length > 0) {
                look(true);
                const double factor = visualizers[0]->calcRoundFactor(largest);
                for (Visualizer* visualizer : visualizers) visualizer->automaticFactor = factor;
            }
        }
        output.setValuesOfRun(look(false));
        for (Visualizer* visualizer : visualizers) visualizer->keepViews();
    }

    FrameJob capture(const State& first, const State& second) {
        const int number = output.getNextNumber();
        FrameJob job = visualizers[0]->captureFrame(first, number);
        job.pictures.push_back(
            std::move(visualizers[1]->captureFrame(second, number).pictures.front()));
        const SideBySideStyle chosen = getStyle();
        job.compose = [words = captions, chosen](const std::vector<Image>& images) {
            return makeSideBySide(images[0], images[1], words, chosen);
        };
        job.composition = captions[0] + '\n' + captions[1] + '\n' +
                          std::to_string(int(chosen.arrangement)) + ' ' +
                          std::to_string(chosen.gap);
        for (const Image::Pixel& color : {chosen.background, chosen.text})
            for (const int c : color) job.composition += ' ' + std::to_string(c);
        const std::array<int, 2> size =
            calcSideBySideSize({visualizers[0]->width, visualizers[0]->height},
                               {visualizers[1]->width, visualizers[1]->height}, captions, chosen);
        job.plots = plots.place(size[0], size[1], visualizers[0]->getPlotTheme(),
                                visualizers[0]->height / 720.0);
        return job;
    }

    SideBySideStyle getStyle() const {
        if (style) return *style;
        const PlotTheme& theme = visualizers[0]->getPlotTheme();
        SideBySideStyle result;
        result.background = theme.background;
        result.text = theme.text;
        return result;
    }

    const std::array<OffscreenVisualizer, 2> copies;  // own the visualizers below
    const std::array<Visualizer*, 2> visualizers;
    const std::array<std::string, 2> captions;
    std::optional<SideBySideStyle> style;
    FramePlots plots;
    FrameOutput output;
};

RunComparison::RunComparison(const OffscreenVisualizer& first, const OffscreenVisualizer& second,
                             const std::array<std::string, 2>& captions)
    : impl(std::make_shared<Impl>(first, second, captions)) {}

RunComparison::~RunComparison() = default;

RunComparison& RunComparison::setStyle(const SideBySideStyle& style) {
    impl->style = style;
    return *this;
}

RunComparison& RunComparison::fitToMotion(const std::vector<State>& first,
                                          const std::vector<State>& second) {
    impl->fitToMotion({&first, &second});
    return *this;
}

void RunComparison::report(const State& first, const State& second) const {
    impl->output.add(impl->capture(first, second));
}

int RunComparison::reportAll(const std::vector<State>& first, const std::vector<State>& second,
                             const FrameProgress& progress) const {
    if (first.size() != second.size())
        throw std::invalid_argument("RunComparison::reportAll: " + std::to_string(first.size()) +
                                    " States of the first run, but " +
                                    std::to_string(second.size()) + " of the second");
    return impl->output.addAll(
        int(first.size()),
        [&](int i) { return impl->capture(first[std::size_t(i)], second[std::size_t(i)]); },
        progress);
}

Image RunComparison::drawFrame(const State& first, const State& second) const {
    return impl->output.draw(impl->capture(first, second));
}

void RunComparison::finish() const {
    impl->output.finish();
}

RunComparison& RunComparison::setOutputFolder(const std::string& folder) {
    impl->output.setFolder(folder);
    return *this;
}

RunComparison& RunComparison::setOldFrames(OldFrames old) {
    impl->output.setOldFrames(old);
    return *this;
}

RunComparison& RunComparison::setFrameSink(const FrameSink& sink) {
    impl->output.setSink(sink);
    return *this;
}

RunComparison& RunComparison::addVideo(const std::string& file, const VideoOptions& options) {
    impl->output.addVideo(file, options);
    return *this;
}

RunComparison& RunComparison::setNumThreads(int numThreads) {
    impl->output.setNumThreads(numThreads);
    return *this;
}

int RunComparison::addPlot(const ProbePlot& plot, PlotSide side, int size) {
    return impl->plots.add(plot, side, size);
}

ProbePlot& RunComparison::updPlot(int plot) {
    return impl->plots.upd(plot);
}

int RunComparison::getNumFrames() const {
    impl->output.wait();
    return impl->output.getNumDelivered();
}

}  // namespace simflex
