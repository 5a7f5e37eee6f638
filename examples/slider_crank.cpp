// Slider-crank with flexible crank and connecting rod, beside the same mechanism with rigid parts.
//
// Reads two reduced parts, integrates them in Simbody with BdfIntegrator, runs the rigid mechanism
// in plain Simbody, and writes a table, probes (CSV), a plot, frames, a video and a contact sheet.
// The model itself: support/SliderCrankModel.

#include <CLI/CLI.hpp>
#include <filesystem>

#include "simflex/part/ReducedBodyFile.h"
#include "simflex/render/ContactSheet.h"
#include "simflex/render/OffscreenVisualizer.h"
#include "simflex/render/RunComparison.h"
#include "simflex/solver/BdfIntegrator.h"
#include "support/Csv.h"
#include "support/Plot.h"
#include "support/Progress.h"
#include "support/RigidSliderCrank.h"
#include "support/SliderCrankModel.h"
#include "support/Table.h"

using namespace SimTK;
using namespace simflex;
using namespace simflex::examples;

namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr int numSamples = 960;  // of the probes
constexpr double framesPerSecond = 30;
constexpr double rigidAccuracy = 1e-8;

struct Arguments {
    SliderCrankOptions model;
    double accuracy = 1e-6, time = 0.2;
    std::string rod = "rod", parts = "build/release/parts", out = "build/output/slider_crank";
    bool noFrames = false, compares = false;
    int frames = 240, threads = 0;

    int samplesPerFrame() const { return std::max(1, numSamples / frames); }
};

struct Part {
    std::string name;
    std::shared_ptr<const ReducedBody> body;
};

/** Values of the probes, by sample, in SI units. **/
struct Probes {
    std::vector<double> time, angle, slider, rodDeflection, crankDeflection, energyError;
    double largestEnergy = 0, largestConstraintError = 0, largestCrank = 0, largestRod = 0,
           outputSeconds = 0;
    std::vector<State> frames;
};

double secondsSince(Clock::time_point start) {
    return std::chrono::duration<double>(Clock::now() - start).count();
}

Part readPart(const Arguments& arguments, const std::string& name) {
    const std::string path = arguments.parts + "/" + name + ".h5";
    if (!fs::exists(path))
        throw std::runtime_error("there is no part " + path +
                                 ": name the folder with --parts; examples/run makes it");
    return {name, std::make_shared<const ReducedBody>(readReducedBody(path))};
}

void printPart(const Part& part) {
    const ReducedBody& body = *part.body;
    std::printf("%-12s %6d nodes -> %d modes, %.4g g, first frequencies", part.name.c_str(),
                body.mesh.numNodes(), body.numModes, 1e3 * body.mass);
    for (int i = 0; i < 4; ++i)
        std::printf("%s %.0f", i ? "," : "", std::sqrt(body.omegaSquared[i]) / (2 * Pi));
    std::printf(" Hz\n");
}

void printModel(const Arguments& arguments, const SliderCrankModel& model) {
    const SliderCrankOptions& o = arguments.model;
    std::printf(
        "crank %.0f mm, rod %.0f mm, slider %.0f g, gravity %.4g m/s2, modal damping %.3g %% of "
        "critical\n",
        1e3 * model.getCrankLength(), 1e3 * model.getRodLength(), 1e3 * o.sliderMass, o.gravity,
        100 * o.damping);
    if (o.drive == SliderCrankOptions::Drive::Speed)
        std::printf("crank run up to %.4g rad/s within %.4g s, then constant\n", o.speed, o.runUp);
    else
        std::printf(
            "drive torque ramped to %.4g N m within %.4g s, then constant; flywheel %.4g kg m2\n",
            o.torque, o.runUp, o.calcFlywheelInertia());
    std::printf("time %.4g s, accuracy %.3g m\n\n", arguments.time, arguments.accuracy);
}

std::vector<RigidSample> runRigid(const Arguments& arguments, const Part& crank, const Part& rod) {
    std::vector<double> times(numSamples + 1);
    for (int i = 0; i <= numSamples; ++i) times[i] = arguments.time * i / numSamples;
    Progress progress("rigid parts, Simbody");
    return runRigidSliderCrank(arguments.model, *crank.body, *rod.body, times, rigidAccuracy,
                               [&](double fraction) {
                                   progress.show(fraction);
                                   return !wasInterrupted();
                               });
}

/** Integrates sample by sample until the end, Ctrl-C or a failed step, whose error goes to
 * `failure`. **/
Probes runFlexible(const Arguments& arguments, SliderCrankModel& model, BdfIntegrator& integrator,
                   const std::vector<RigidSample>& rigid, std::string& failure) {
    Csv csv(arguments.out + "/probes.csv",
            {"time_s", "crank_angle_rad", "slider_flexible_m", "slider_rigid_m",
             "slider_difference_m", "rod_deflection_m", "crank_deflection_m", "bearing_x_N",
             "bearing_y_N", "bearing_rigid_x_N", "bearing_rigid_y_N", "kinetic_J", "strain_crank_J",
             "strain_rod_J", "energy_J", "work_J", "energy_error_J"});
    Probes probes;
    Progress progress("flexible parts, simflex");
    double initialEnergy = 0;
    for (int i = 0; i < int(rigid.size()) && !wasInterrupted(); ++i) {
        const double time = arguments.time * i / numSamples;
        try {
            if (i > 0) integrator.stepTo(time);
        } catch (const std::runtime_error& error) {
            failure = error.what();
            break;
        }

        const auto start = Clock::now();
        const State& state = integrator.getState();
        const double angle =
            model.calcCrankAngle(state, probes.angle.empty() ? 0 : probes.angle.back());
        const double slider = model.calcSliderPosition(state);
        const double kinetic = model.flexible.calcKineticEnergy(state),
                     energy = kinetic + model.flexible.calcPotentialEnergy(state),
                     work = integrator.getWork();
        if (i == 0) initialEnergy = energy;
        const Vec3 bearing =
            model.mainBearing.calcForceOnM(state, integrator.getMultipliers(model.mainBearing))[1];
        probes.time.push_back(time);
        probes.angle.push_back(angle);
        probes.slider.push_back(slider);
        probes.rodDeflection.push_back(model.calcRodDeflection(state));
        probes.crankDeflection.push_back(model.calcCrankDeflection(state));
        probes.energyError.push_back(energy - initialEnergy - work);
        probes.largestEnergy = std::max(probes.largestEnergy, kinetic);
        probes.largestConstraintError =
            std::max(probes.largestConstraintError, integrator.getLargestConstraintError());
        csv.write({time, angle, slider, rigid[i].sliderPosition, slider - rigid[i].sliderPosition,
                   probes.rodDeflection.back(), probes.crankDeflection.back(), bearing[0],
                   bearing[1], rigid[i].bearingForce[0], rigid[i].bearingForce[1], kinetic,
                   model.crank.calcStrainEnergy(state), model.rod.calcStrainEnergy(state), energy,
                   work, probes.energyError.back()});
        probes.largestCrank =
            std::max(probes.largestCrank, model.crank.calcLargestDisplacement(state));
        probes.largestRod = std::max(probes.largestRod, model.rod.calcLargestDisplacement(state));
        if (i % arguments.samplesPerFrame() == 0 && !arguments.noFrames)
            probes.frames.push_back(state);
        probes.outputSeconds += secondsSince(start);
        progress.show(double(i) / numSamples);
    }
    return probes;
}

double largest(const std::vector<double>& values) {
    double result = 0;
    for (double value : values) result = std::max(result, std::abs(value));
    return result;
}

std::vector<double> scaled(std::vector<double> values, double factor) {
    for (double& value : values) value *= factor;
    return values;
}

std::vector<double> calcDifference(const Probes& probes, const std::vector<RigidSample>& rigid) {
    std::vector<double> difference;
    for (size_t i = 0; i < probes.slider.size(); ++i)
        difference.push_back(probes.slider[i] - rigid[i].sliderPosition);
    return difference;
}

void printTable(const Probes& probes, const std::vector<RigidSample>& rigid,
                const IntegratorStatistics& s) {
    const double total = s.totalSeconds + probes.outputSeconds;
    const double phases = s.evaluationSeconds + s.factorSeconds + s.schurSeconds +
                          s.backSubstitutionSeconds + s.simbodySeconds + s.outputSeconds;
    Table table;
    table.addHeading("Integration");
    table.add("steps", s.stepsTaken);
    table.add("Newton iterations", s.newtonIterations);
    table.add("linear solves", s.linearSolves);
    table.add("factorizations", s.factorizations);
    table.add("redundant constraints", long(s.redundantConstraints));
    table.addHeading("Wall time");
    table.add("evaluation", 1e3 * s.evaluationSeconds, "ms");
    table.add("factor", 1e3 * s.factorSeconds, "ms");
    table.add("Schur complement", 1e3 * s.schurSeconds, "ms");
    table.add("back-substitution", 1e3 * s.backSubstitutionSeconds, "ms");
    table.add("Simbody", 1e3 * s.simbodySeconds, "ms");
    table.add("output (probes)", 1e3 * (s.outputSeconds + probes.outputSeconds), "ms");
    table.add("other", 1e3 * (s.totalSeconds - phases), "ms");
    table.add("total", 1e3 * total, "ms");
    table.addHeading("Result");
    table.add("crank turns", probes.angle.back() / (2 * Pi), "");
    table.add("largest kinetic energy", probes.largestEnergy, "J");
    table.add("largest |energy - initial - work|", largest(probes.energyError), "J", 3);
    table.add("largest constraint error", probes.largestConstraintError, "m", 3);
    table.add("largest deflection of the rod's middle", 1e3 * largest(probes.rodDeflection), "mm");
    table.add("largest deflection of the crank pin", 1e3 * largest(probes.crankDeflection), "mm");
    table.add("largest displacement in the crank", 1e3 * probes.largestCrank, "mm");
    table.add("largest displacement in the rod", 1e3 * probes.largestRod, "mm");
    table.add("slider, largest difference from the rigid run",
              1e3 * largest(calcDifference(probes, rigid)), "mm");
    std::printf("\n%s\n", table.toString().c_str());
}

void plot(const Arguments& arguments, const Probes& probes, const std::vector<RigidSample>& rigid) {
    std::vector<double> rigidPosition;
    for (size_t i = 0; i < probes.time.size(); ++i)
        rigidPosition.push_back(rigid[i].sliderPosition);
    const std::vector<double> time = scaled(probes.time, 1e3);
    Plot figure{"Slider-crank with flexible crank and connecting rod", "time [ms]", {}};
    figure.panels.push_back(
        {"Slider position",
         "position [mm]",
         {{"rigid parts", time, scaled(rigidPosition, 1e3), Plot::Slate},
          {"flexible parts", time, scaled(probes.slider, 1e3), Plot::Blue, true}}});
    figure.panels.push_back(
        {"Flexible − rigid",
         "difference [mm]",
         {{"", time, scaled(calcDifference(probes, rigid), 1e3), Plot::Orange}}});
    figure.panels.push_back({"Deflection of the rod's middle from the line between its pins",
                             "deflection [µm]",
                             {{"", time, scaled(probes.rodDeflection, 1e6), Plot::Green}}});
    writePlot(figure, arguments.out + "/plot.png");
    std::printf("wrote %s/plot.png\n", arguments.out.c_str());
}

/** Curves beside the frames: difference of the slider from that of rigid parts, and deflection of
the rod. **/
ProbePlot makeProbePlot(const Probes& probes, const std::vector<RigidSample>& rigid) {
    ProbePlot plot;
    plot.setTimeUnit("ms", 1e-3);
    plot.addPanel("Slider, flexible − rigid parts", "µm", 1e-6);
    plot.addCurve("", probes.time, calcDifference(probes, rigid));
    plot.addPanel("Deflection of the rod's middle", "µm", 1e-6);
    plot.addCurve("", probes.time, probes.rodDeflection);
    return plot;
}

std::vector<State> calcPictureStates(const SliderCrankModel& model,
                                     const std::vector<State>& states) {
    std::vector<State> ofPictures;
    for (const State& state : states) ofPictures.push_back(model.calcPictureState(state));
    return ofPictures;
}

OffscreenVisualizer makeVisualizer(const SliderCrankModel& model, int width, int height) {
    OffscreenVisualizer viz(model.system, width, height);
    viz.addFlexibleBody(model.crank).addFlexibleBody(model.rod).setCameraView(0.28, 0.2);
    viz.addDecoration(model.crank.interface("pin"), model.makeCrankPin());
    return viz;
}

void printVideo(const Arguments& arguments, const std::string& file) {
    std::printf(
        "wrote %s (%.3g times slower than life)\n", file.c_str(),
        double(numSamples) / arguments.samplesPerFrame() / framesPerSecond / arguments.time);
}

/** Progress bar of drawing, which ends at Ctrl-C. **/
FrameProgress showProgress(const std::string& task) {
    return [progress = std::make_shared<Progress>(task)](int done, int total) {
        progress->show(double(done) / total);
        return !wasInterrupted();
    };
}

/** Writes a video of the mechanism with rigid parts beside the flexible one, exaggerated. **/
void compare(const Arguments& arguments, const SliderCrankModel& model,
             const std::vector<State>& states, double factor, const ProbePlot& plot) {
    OffscreenVisualizer rigid = makeVisualizer(model, 960, 720),
                        flexible = makeVisualizer(model, 960, 720);
    rigid.setDeformationFactor(0).setShowDeformationFactor(false);
    rigid.setContour(Contour::None).setShowUndeformed(false);
    flexible.setDeformationFactor(factor);

    RunComparison both(rigid, flexible, {"rigid parts", "flexible parts"});
    const std::string video = arguments.out + "/rigid_and_flexible.mp4";
    both.fitToMotion(states, states).setOutputFolder("").addVideo(video, {framesPerSecond});
    both.addPlot(plot);
    both.reportAll(states, states, showProgress("rigid and flexible"));
    both.finish();
    printVideo(arguments, video);
}

/** Writes frames of the run with exaggerated deformations, a video and a contact sheet. **/
void render(const Arguments& arguments, const SliderCrankModel& model, const Probes& probes,
            const std::vector<RigidSample>& rigid) {
    OffscreenVisualizer viz = makeVisualizer(model, 1280, 720);
    viz.setOutputFolder(arguments.out + "/frames");
    viz.setWindowTitle("Slider-crank with flexible crank and connecting rod");
    const std::vector<State> states = calcPictureStates(model, probes.frames);
    // The range of the rod's deflection; the crank lags behind its drive by more, and exceeds it.
    viz.setDeformationFactor(100).setContourRange(0, 1e-4);
    viz.fitToMotion(states);
    const ProbePlot plot = makeProbePlot(probes, rigid);
    viz.addPlot(plot);
    const std::string video = arguments.out + "/slider_crank.mp4";
    if (isVideoAvailable()) viz.addVideo(video, {framesPerSecond});
    viz.reportAll(states, showProgress("frames"));
    viz.finish();
    std::printf("wrote %d frames to %s\n", viz.getNumFrames(), viz.getOutputFolder().c_str());
    if (viz.getNumFrames() == 0) return;
    if (isVideoAvailable())
        printVideo(arguments, video);
    else
        std::printf("no video: ffmpeg is not installed\n");

    std::vector<std::string> files;
    for (int k = 0; k < 6; ++k) {
        char name[40];
        std::snprintf(name, sizeof name, "/frame_%05d.png", (viz.getNumFrames() - 1) * (k + 1) / 6);
        files.push_back(viz.getOutputFolder() + name);
    }
    makeContactSheet(files, 2, 640).writePng(arguments.out + "/contact_sheet.png");
    std::printf("wrote %s/contact_sheet.png\n", arguments.out.c_str());
    if (arguments.compares && isVideoAvailable() && !wasInterrupted())
        compare(arguments, model, states, viz.getDeformationFactor(), plot);
}

int run(const Arguments& arguments) {
    const Part crank = readPart(arguments, "crank"), rod = readPart(arguments, arguments.rod);
    fs::create_directories(arguments.out);
    printPart(crank);
    printPart(rod);

    SliderCrankModel model(arguments.model, crank.body, rod.body);
    printModel(arguments, model);
    const std::vector<RigidSample> rigid = runRigid(arguments, crank, rod);

    BdfIntegrator integrator(model.system);
    integrator.setAccuracy(arguments.accuracy);
    if (arguments.threads > 0) integrator.setNumThreads(arguments.threads);
    integrator.initialize(model.makeInitialState());
    std::string failure;
    const Probes probes = runFlexible(arguments, model, integrator, rigid, failure);
    if (wasInterrupted())
        std::printf("\nstopped at t = %.4g s; what is finished is kept\n", integrator.getTime());
    if (!failure.empty()) std::fprintf(stderr, "slider_crank: %s\n", failure.c_str());
    if (probes.time.empty()) return 130;

    printTable(probes, rigid, integrator.getStatistics());
    std::printf("wrote %s/probes.csv\n", arguments.out.c_str());
    plot(arguments, probes, rigid);
    if (!arguments.noFrames && !wasInterrupted()) {
        render(arguments, model, probes, rigid);
        if (wasInterrupted()) std::printf("stopped while drawing; what is finished is kept\n");
    }
    return wasInterrupted() ? 130 : failure.empty() ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
    Arguments arguments;
    CLI::App app("Slider-crank with flexible crank and connecting rod.");
    app.option_defaults()->take_last()->always_capture_default();
    const std::map<std::string, SliderCrankOptions::Drive> drives{
        {"speed", SliderCrankOptions::Drive::Speed}, {"torque", SliderCrankOptions::Drive::Torque}};
    app.add_option("--drive", arguments.model.drive,
                   "What is constant after the run-up: speed or torque")
        ->transform(CLI::CheckedTransformer(drives));
    app.add_option("--speed", arguments.model.speed, "Speed of the crank [rad/s]");
    app.add_option("--torque", arguments.model.torque, "Torque on the crank [N m]");
    app.add_option("--run-up", arguments.model.runUp, "Duration of the run-up [s]")
        ->check(CLI::PositiveNumber);
    app.add_option("--slider-mass", arguments.model.sliderMass, "Mass of the slider [kg]")
        ->check(CLI::PositiveNumber);
    app.add_option("--damping", arguments.model.damping, "Damping ratio of each mode")
        ->check(CLI::NonNegativeNumber);
    app.add_option("--accuracy", arguments.accuracy, "Local error allowed in a step [m]")
        ->check(CLI::PositiveNumber);
    app.add_option("--time", arguments.time, "Duration [s]")->check(CLI::PositiveNumber);
    app.add_option("--rod", arguments.rod,
                   "Part of the rod: rod (1 mm hexahedra) or shapely_rod (tetrahedra)")
        ->check(CLI::IsMember({"rod", "shapely_rod"}));
    app.add_option("--parts", arguments.parts, "Folder of the reduced parts");
    app.add_option("-o,--output", arguments.out, "Folder to write");
    app.add_option("--frames", arguments.frames, "Approximate number of pictures")
        ->check(CLI::Range(1, numSamples));
    app.add_flag("--no-frames", arguments.noFrames, "Draw the plot only");
    app.add_flag("--compare", arguments.compares,
                 "Also make a video of rigid and flexible parts side by side");
    app.add_option("--threads", arguments.threads,
                   "Number of threads (default: chosen by the library)")
        ->check(CLI::NonNegativeNumber);
    CLI11_PARSE(app, argc, argv);
    std::setvbuf(stdout, nullptr, _IOLBF, 0);  // in step with the progress on standard error
    catchInterrupts();
    try {
        return run(arguments);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "slider_crank: %s\n", error.what());
        return 1;
    }
}
