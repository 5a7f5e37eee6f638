// Chain of flexible links: cost from 1 to 10 000 links, and a chain of 40 links falling.
//
// Releases a straight chain of an increasing number of links, and writes a table of cost per Newton
// iteration, set-up and memory (CSV, logarithmic plot); then lets one chain fall from the
// horizontal and draws frames, a video and a contact sheet.
// The model itself: support/ChainModel.

#include <CLI/CLI.hpp>
#include <filesystem>

#include "simflex/part/ReducedBodyFile.h"
#include "simflex/render/ContactSheet.h"
#include "simflex/render/OffscreenVisualizer.h"
#include "simflex/render/Video.h"
#include "simflex/solver/BdfIntegrator.h"
#include "support/ChainCost.h"
#include "support/Csv.h"
#include "support/Plot.h"
#include "support/Progress.h"
#include "support/Table.h"

using namespace SimTK;
using namespace simflex;
using namespace simflex::examples;

namespace {

namespace fs = std::filesystem;

constexpr double framesPerSecond = 30;

struct Arguments {
    ChainOptions model;
    double accuracy = 1e-5, time = 1.6;
    std::string parts = "build/release/parts", out = "build/output/chain";
    bool noFrames = false, noStudy = false;
    int largest = 10000, frames = 48, threads = 1;
};

/** One falling chain, frame by frame. **/
struct Fall {
    std::vector<State> frames;
    std::vector<double> time, tipSpeed, energyError;
    double largestTipSpeed = 0, timeOfLargest = 0;
};

std::shared_ptr<const ReducedBody> readLink(const Arguments& arguments) {
    const std::string path = arguments.parts + "/link.h5";
    if (!fs::exists(path))
        throw std::runtime_error("there is no part " + path +
                                 ": name the folder with --parts; examples/run makes it");
    auto part = std::make_shared<const ReducedBody>(readReducedBody(path));
    std::printf("link         %6d nodes -> %d modes, %.4g g, first frequencies",
                part->mesh.numNodes(), part->numModes, 1e3 * part->mass);
    for (int i = 0; i < 4; ++i)
        std::printf("%s %.0f", i ? "," : "", std::sqrt(part->omegaSquared[size_t(i)]) / (2 * Pi));
    std::printf(" Hz\n\n");
    return part;
}

//------------------------------------------------------------------------------------------------
// scaling study

std::vector<int> chooseSizes(int largest) {
    std::vector<int> sizes;
    for (int decade = 1; decade <= largest; decade *= 10)
        for (int factor : {1, 3})
            if (factor * decade <= largest) sizes.push_back(factor * decade);
    if (sizes.back() != largest) sizes.push_back(largest);
    return sizes;
}

std::vector<ChainCost> runStudy(const Arguments& arguments,
                                const std::shared_ptr<const ReducedBody>& part) {
    Csv csv(arguments.out + "/scaling.csv",
            {"links", "speeds", "newton_iteration_s", "model_s", "topology_s", "initialize_s",
             "state_s", "bytes", "steps", "newton_iterations", "factorizations"});
    std::printf("%8s %9s %16s %14s %10s %12s %14s\n", "links", "speeds", "ms/iteration",
                "us/it./link", "set-up s", "memory MB", "kB per link");
    std::vector<ChainCost> costs;
    ChainOptions options = arguments.model;
    // A first chain, not recorded, pays the one-time costs of caches, threads and pages.
    options.numLinks = 10;
    measureChain(options, part, arguments.threads);
    for (int numLinks : chooseSizes(arguments.largest)) {
        if (wasInterrupted()) break;
        options.numLinks = numLinks;
        const ChainCost cost = measureChain(options, part, arguments.threads);
        const double speeds = double(numLinks) * (6 + part->numModes);
        std::printf("%8d %9.0f %16.4g %14.4g %10.3g %12.4g %14.4g\n", numLinks, speeds,
                    1e3 * cost.iterationSeconds, 1e6 * cost.iterationSeconds / numLinks,
                    cost.setUpSeconds(), 1e-6 * cost.bytes, 1e-3 * cost.bytes / numLinks);
        csv.write({double(numLinks), speeds, cost.iterationSeconds, cost.modelSeconds,
                   cost.topologySeconds, cost.initializeSeconds, cost.stateSeconds, cost.bytes,
                   double(cost.statistics.stepsTaken), double(cost.statistics.newtonIterations),
                   double(cost.statistics.factorizations)});
        costs.push_back(cost);
    }
    std::printf("\nwrote %s/scaling.csv\n", arguments.out.c_str());
    return costs;
}

void plotStudy(const Arguments& arguments, const std::vector<ChainCost>& costs) {
    if (costs.size() < 2) return;
    std::vector<double> links, iteration, setUp, memory, linearIteration, linearMemory;
    for (const ChainCost& cost : costs) {
        links.push_back(cost.numLinks);
        iteration.push_back(1e3 * cost.iterationSeconds);
        setUp.push_back(1e3 * cost.setUpSeconds());
        memory.push_back(1e-6 * cost.bytes);
    }
    for (double N : links) {
        linearIteration.push_back(iteration.back() * N / links.back());
        linearMemory.push_back(memory.back() * N / links.back());
    }
    Plot figure{"Chain of flexible links, 54 modes each: cost over number of links", "links", {}};
    figure.hasLogarithmicX = true;
    Plot::Panel time{"Wall time", "time [ms]", {}, true};
    time.series = {{"proportional to links", links, linearIteration, Plot::Gray},
                   {"set-up", links, setUp, Plot::Orange, false, true},
                   {"Newton iteration", links, iteration, Plot::Blue, false, true}};
    Plot::Panel space{"Memory: model, States, integrator", "memory [MB]", {}, true};
    space.series = {{"proportional to links", links, linearMemory, Plot::Gray},
                    {"in use", links, memory, Plot::Green, false, true}};
    figure.panels = {time, space};
    writePlot(figure, arguments.out + "/scaling.png");
    std::printf("wrote %s/scaling.png\n", arguments.out.c_str());
}

//------------------------------------------------------------------------------------------------
// falling chain

Fall runFall(const Arguments& arguments, ChainModel& model, BdfIntegrator& integrator,
             std::string& failure) {
    Fall fall;
    Csv csv(arguments.out + "/fall.csv",
            {"time_s", "tip_x_m", "tip_y_m", "tip_speed_m_s", "energy_J", "energy_error_J"});
    Progress progress(std::to_string(arguments.model.numLinks) + " links falling");
    constexpr int samplesPerFrame = 8;
    const int numSamples = arguments.frames * samplesPerFrame;
    double initialEnergy = 0;
    Vec3 lastTip(0);
    for (int i = 0; i <= numSamples && !wasInterrupted(); ++i) {
        const double time = arguments.time * i / numSamples;
        try {
            if (i > 0) integrator.stepTo(time);
        } catch (const std::runtime_error& error) {
            failure = error.what();
            break;
        }
        const State& state = integrator.getState();
        const Vec3 tip = model.calcTip(state);
        const double speed = i == 0 ? 0 : (tip - lastTip).norm() / (arguments.time / numSamples);
        const double energy = model.flexible.calcEnergy(state);
        if (i == 0) initialEnergy = energy;
        lastTip = tip;
        const double error = energy - initialEnergy - integrator.getWork();
        csv.write({time, tip[0], tip[1], speed, energy, error});
        fall.time.push_back(time);
        fall.tipSpeed.push_back(speed);
        fall.energyError.push_back(error);
        if (speed > fall.largestTipSpeed) {
            fall.largestTipSpeed = speed;
            fall.timeOfLargest = time;
        }
        if (i % samplesPerFrame == 0 && !arguments.noFrames) fall.frames.push_back(state);
        progress.show(double(i) / numSamples);
    }
    return fall;
}

void printFall(const ChainModel& model, const Fall& fall, const IntegratorStatistics& s) {
    double energyError = 0, kinetic = 0;
    for (double error : fall.energyError) energyError = std::max(energyError, std::abs(error));
    kinetic = model.links.size() * model.links[0].getPart().mass * 9.81 * model.getLength();
    Table table;
    table.addHeading("Falling chain");
    table.add("links", long(model.links.size()));
    table.add("length", model.getLength(), "m");
    table.add("steps", s.stepsTaken);
    table.add("Newton iterations", s.newtonIterations);
    table.add("factorizations", s.factorizations);
    table.add("wall time", s.totalSeconds, "s", 3);
    table.add("largest speed of the free end", fall.largestTipSpeed, "m/s");
    table.add("at", fall.timeOfLargest, "s");
    table.add("largest |energy - initial - work|", energyError, "J", 3);
    table.add("weight times length, for comparison", kinetic, "J", 3);
    std::printf("\n%s\n", table.toString().c_str());
}

/** Largest displacement in each link, by frame [m]. **/
std::vector<std::vector<double>> calcDeflections(const ChainModel& model,
                                                 const std::vector<State>& states) {
    std::vector<std::vector<double>> deflections;
    for (const State& state : states) {
        deflections.emplace_back();
        for (const FlexibleBody& link : model.links)
            deflections.back().push_back(link.calcLargestDisplacement(state));
    }
    return deflections;
}

/** Index of the link that deforms most, by frame, smoothed for the camera. **/
std::vector<double> findBend(const std::vector<std::vector<double>>& deflections) {
    std::vector<double> bend;
    for (const std::vector<double>& ofFrame : deflections) {
        double sum = 1e-300, weighted = 0;
        for (size_t k = 0; k < ofFrame.size(); ++k) {
            const double weight = std::pow(1e6 * ofFrame[k], 8);
            sum += weight;
            weighted += weight * double(k);
        }
        const double link = weighted / sum;
        bend.push_back(bend.empty() ? link : 0.5 * bend.back() + 0.5 * link);
    }
    return bend;
}

/** Drawn position of the chain at `link` links from its start, in Ground [m]. **/
Vec3 calcPointOfChain(const ChainModel& model, const OffscreenVisualizer& viz, const State& state,
                      double link) {
    const double last = double(model.links.size()) - 1;
    const size_t k = size_t(std::clamp(link, 0.0, last));
    const Vec3 p = viz.calcDrawnPose(state, model.links[k].interface("fork")).p();
    const Vec3 next = viz.calcDrawnPose(state, model.links[k].interface("eye")).p();
    return p + (link - double(k)) * (next - p);
}

/** Rounds down to one significant digit. **/
double roundDown(double x) {
    const double power = std::pow(10, std::floor(std::log10(x)));
    return std::floor(x / power) * power;
}

/** Every `interval`-th State in one picture: the darkest pixels of all, since links are darker than
the background. **/
Image drawStroboscope(OffscreenVisualizer viz, const std::vector<State>& states, size_t interval) {
    viz.setShowShadows(false).setShowSimTime(false);
    const Image first = viz.drawFrame(states[0]);
    Image sum = first;
    for (size_t i = interval; i < states.size() && !wasInterrupted(); i += interval) {
        const Image next = viz.drawFrame(states[i]);
        for (int y = 0; y < sum.getHeight(); ++y)
            for (int x = 0; x < sum.getWidth(); ++x)
                if (next.getPixel(x, y)[1] < sum.getPixel(x, y)[1])
                    sum.setPixel(x, y, next.getPixel(x, y));
    }
    return sum;
}

/** Writes frames (the whole chain on the left, its most deformed part on the right), a stroboscopic
 * picture, a contact sheet and a video. **/
void render(const Arguments& arguments, const ChainModel& model, const std::vector<State>& states) {
    constexpr int height = 720, leftWidth = 800, rightWidth = 640, legendWidth = 170;
    OffscreenVisualizer whole(model.system, leftWidth, height);
    OffscreenVisualizer closeUp(model.system, rightWidth + legendWidth, height);
    OffscreenVisualizer strobe(model.system, 1280, height);

    // Nine of ten frames stay below the upper end of the colours. Deformations of that size are
    // drawn up to a tenth of a link, and the largest up to a third of a link.
    const std::vector<std::vector<double>> deflections = calcDeflections(model, states);
    std::vector<double> peaks;
    for (const auto& ofFrame : deflections)
        peaks.push_back(*std::max_element(ofFrame.begin(), ofFrame.end()));
    std::sort(peaks.begin(), peaks.end());
    const double high = std::max(peaks[peaks.size() * 9 / 10], 1e-12);
    const double factor = std::max(1.0, roundDown(std::min(model.getPitch() / 10 / high,
                                                           model.getPitch() / 3 / peaks.back())));
    for (OffscreenVisualizer* viz : {&whole, &closeUp, &strobe}) {
        for (const FlexibleBody& link : model.links) viz->addFlexibleBody(link);
        viz->setShowUndeformed(false).setCameraView(0.15, 0.06).setDeformationFactor(factor);
        viz->fitToMotion(states).setContourRange(0, high);
    }
    const std::string links = std::to_string(model.links.size()) + " flexible links";
    whole.setWindowTitle(links);
    strobe.setWindowTitle(links + ", released from the horizontal");
    closeUp.setWindowTitle("Where it deforms most");

    const std::string folder = arguments.out + "/frames";
    fs::remove_all(folder);
    fs::create_directories(folder);
    const std::vector<double> bend = findBend(deflections);
    const Rotation view(BodyRotationSequence, 0.5, YAxis, -0.25, XAxis);
    std::vector<std::string> files;
    {
        Progress progress("frames");
        for (size_t i = 0; i < states.size() && !wasInterrupted(); ++i) {
            const State& state = states[i];
            const Vec3 center = calcPointOfChain(model, closeUp, state, bend[i]);
            // The strip of the legend is cut off below, so the camera's centre is shifted.
            closeUp.setCameraTransform(Transform(
                view, center + view * Vec3(0.55 * model.getPitch(), 0, 8 * model.getPitch())));
            Image frame(leftWidth + rightWidth, height);
            frame.paste(whole.drawFrame(state), 0, 0);
            frame.paste(closeUp.drawFrame(state), leftWidth, 0);
            char name[40];
            std::snprintf(name, sizeof name, "/frame_%05d.png", int(i));
            files.push_back(folder + name);
            frame.writePng(files.back());
            progress.show(double(i + 1) / double(states.size()));
        }
    }
    std::printf("wrote %zu frames to %s\n", files.size(), folder.c_str());
    if (wasInterrupted() || files.empty()) return;
    drawStroboscope(strobe, states, std::max<size_t>(1, states.size() / 24))
        .writePng(arguments.out + "/stroboscope.png");
    std::printf("wrote %s/stroboscope.png\n", arguments.out.c_str());
    std::vector<std::string> chosen;
    for (size_t k = 0; k < 6; ++k) chosen.push_back(files[(files.size() - 1) * (k + 1) / 6]);
    makeContactSheet(chosen, 2, 720).writePng(arguments.out + "/contact_sheet.png");
    std::printf("wrote %s/contact_sheet.png\n", arguments.out.c_str());
    const std::string video = arguments.out + "/chain.mp4";
    if (writeVideo(folder, video, framesPerSecond))
        std::printf("wrote %s (%.3g times slower than life)\n", video.c_str(),
                    double(states.size() - 1) / framesPerSecond / arguments.time);
    else
        std::printf("no video: ffmpeg is not installed\n");
}

int run(const Arguments& arguments) {
    const auto part = readLink(arguments);
    fs::create_directories(arguments.out);
    if (!arguments.noStudy) plotStudy(arguments, runStudy(arguments, part));
    if (arguments.model.numLinks == 0 || wasInterrupted()) return wasInterrupted() ? 130 : 0;

    ChainModel model(arguments.model, part);
    BdfIntegrator integrator(model.system);
    integrator.setAccuracy(arguments.accuracy);
    if (arguments.threads > 0) integrator.setNumThreads(arguments.threads);
    integrator.initialize(model.makeInitialState());
    std::string failure;
    const Fall fall = runFall(arguments, model, integrator, failure);
    if (!failure.empty()) std::fprintf(stderr, "chain: %s\n", failure.c_str());
    if (fall.time.empty()) return 130;
    printFall(model, fall, integrator.getStatistics());
    if (!fall.frames.empty() && !wasInterrupted()) render(arguments, model, fall.frames);
    return wasInterrupted() ? 130 : failure.empty() ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
    Arguments arguments;
    CLI::App app("Chain of flexible links: a scaling study, and one chain falling.");
    app.option_defaults()->take_last()->always_capture_default();
    const std::map<std::string, ChainOptions::Joints> joints{{"ball", ChainOptions::Joints::Ball},
                                                             {"pin", ChainOptions::Joints::Pin}};
    app.add_option("--largest", arguments.largest,
                   "Number of links of the longest chain in the study")
        ->check(CLI::Range(1, 1000000));
    app.add_option("--links", arguments.model.numLinks,
                   "Number of links of the falling chain; 0: no falling chain")
        ->check(CLI::NonNegativeNumber);
    app.add_option("--joints", arguments.model.joints, "Kind of the joints: ball or pin")
        ->transform(CLI::CheckedTransformer(joints));
    app.add_option("--damping", arguments.model.damping, "Damping ratio of each mode")
        ->check(CLI::NonNegativeNumber);
    app.add_option("--gravity", arguments.model.gravity, "Gravity [m/s2]")
        ->check(CLI::NonNegativeNumber);
    app.add_option("--accuracy", arguments.accuracy,
                   "Local error allowed in a step of the fall [m]")
        ->check(CLI::PositiveNumber);
    app.add_option("--time", arguments.time, "Duration of the fall [s]")
        ->check(CLI::PositiveNumber);
    app.add_option("--parts", arguments.parts, "Folder of the reduced parts");
    app.add_option("-o,--output", arguments.out, "Folder to write");
    app.add_option("--frames", arguments.frames, "Number of pictures")->check(CLI::Range(1, 10000));
    app.add_flag("--no-frames", arguments.noFrames, "Draw the plot only");
    app.add_flag("--no-study", arguments.noStudy, "Simulate the falling chain only");
    app.add_option("--threads", arguments.threads,
                   "Number of threads (default: chosen by the library)")
        ->check(CLI::NonNegativeNumber);
    CLI11_PARSE(app, argc, argv);
    std::setvbuf(stdout, nullptr, _IOLBF, 0);  // in step with the progress on standard error
    catchInterrupts();
    try {
        return run(arguments);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "chain: %s\n", error.what());
        return 1;
    }
}
