// Aeroengine stator of five flexible casings, shaken by the unbalance of its rotor during run-up.
//
// Connector (titanium, 50 Craig-Bampton modes), compressor casing (titanium, 32), combustion
// chamber (nickel alloy, 26), turbine casing (nickel alloy, 32) and nozzle (nickel alloy, 26),
// welded flange to flange: 2.25 m long, 0.52 to 0.82 m wide, 274 kg. Two ball hinges hold the
// connector, one the nozzle. The rotor runs up to 250 Hz within 1.5 s, with 4 kg mm of unbalance in
// each bearing (16 g at a radius of 250 mm). Each part's modes are damped by 5 % of critical; the
// lowest modes of the whole engine, far below the parts' own frequencies, then have 0.3 to 1.3 %.
// It starts at rest, deformed by its weight. Reads the reduced parts, finds the natural modes of
// the assembly, integrates the run-up with BdfIntegrator, and writes a table, responses (CSV),
// plots of the response over the speed and of its spectrum, frames, a video and a contact sheet.
// The model itself: support/StatorModel.

#include <CLI/CLI.hpp>
#include <filesystem>

#include "simflex/part/ReducedBodyFile.h"
#include "simflex/render/ContactSheet.h"
#include "simflex/render/OffscreenVisualizer.h"
#include "simflex/render/Video.h"
#include "simflex/solver/BdfIntegrator.h"
#include "support/Csv.h"
#include "support/Plot.h"
#include "support/Progress.h"
#include "support/Spectrum.h"
#include "support/StatorModel.h"
#include "support/Table.h"

using namespace SimTK;
using namespace simflex;
using namespace simflex::examples;

namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr double framesPerSecond = 30;
constexpr int samplesPerTurn = 24;    // at full speed
constexpr int framesPerCycle = 16;    // of the slow motion that the frames show
constexpr double lowestSpeed = 20;    // plotted [Hz]
constexpr double windowWidth = 0.12;  // of the spectra [s]

struct Arguments {
    StatorOptions model;
    double accuracy = 1e-8, time = 1.6;
    std::string parts = "build/release/parts", out = "build/output/stator";
    bool noFrames = false;
    int frames = 240, threads = 0;

    double sampleInterval() const { return 1 / (samplesPerTurn * model.speed); }
};

using Parts = std::vector<std::shared_ptr<const ReducedBody>>;

/** Values of the probes, by sample, in SI units. **/
struct Probes {
    std::vector<double> time, speed, angle, energyError;
    std::array<std::vector<double>, 2> vertical, lateral;  // of the bearings
    std::vector<Vector> q;                                 // for the frames
    std::vector<double> weightCarried;                     // by the hinges
    double largestHingeForce = 0, largestKinetic = 0, largestConstraintError = 0, outputSeconds = 0;
};

double secondsSince(Clock::time_point start) {
    return std::chrono::duration<double>(Clock::now() - start).count();
}

Parts readParts(const Arguments& arguments) {
    Parts parts;
    for (const std::string name : StatorModel::getPartNames()) {
        const std::string path = arguments.parts + "/" + name + ".h5";
        if (!fs::exists(path))
            throw std::runtime_error("there is no part " + path +
                                     ": name the folder with --parts; examples/run makes it");
        parts.push_back(std::make_shared<const ReducedBody>(readReducedBody(path)));
    }
    return parts;
}

void printParts(const Parts& parts) {
    for (const auto& part : parts) {
        std::printf("%-18s %6d DOF -> %d modes, %5.1f kg, first frequencies", part->name.c_str(),
                    3 * part->mesh.numNodes(), part->numModes, part->mass);
        for (int i = 0; i < 4; ++i)
            std::printf("%s %.0f", i ? "," : "", std::sqrt(part->omegaSquared[i]) / (2 * Pi));
        std::printf(" Hz\n");
    }
}

void printModel(const Arguments& arguments, const LinearModel& linear) {
    const StatorOptions& o = arguments.model;
    std::printf(
        "rotor run up to %.4g Hz within %.4g s; unbalance %.3g kg mm in front, %.3g kg mm a "
        "quarter turn behind in the rear\n",
        o.speed, o.runUp, 1e3 * o.frontUnbalance, 1e3 * o.rearUnbalance);
    std::printf("gravity %.4g m/s2, modal damping of the parts %.3g %% of critical\n", o.gravity,
                100 * o.damping);
    std::printf("time %.4g s, accuracy %.3g m\n", arguments.time, arguments.accuracy);
    std::printf("natural frequencies of the stator (damping):");
    for (int k = 0; k < 6; ++k)
        std::printf("%s %.1f Hz (%.2f %%)", k ? "," : "", linear.getFrequency(k),
                    100 * linear.getDampingRatio(k));
    std::printf("\n\n");
}

/** Integrates sample by sample until the end, Ctrl-C or a failed step, whose error goes to
 * `failure`. **/
Probes runUp(const Arguments& arguments, const StatorModel& model, BdfIntegrator& integrator,
             std::string& failure) {
    Csv csv(arguments.out + "/response.csv",
            {"time_s",         "speed_Hz",        "front_y_m",       "front_z_m",
             "rear_y_m",       "rear_z_m",        "left_hinge_x_N",  "left_hinge_y_N",
             "left_hinge_z_N", "right_hinge_x_N", "right_hinge_y_N", "right_hinge_z_N",
             "rear_hinge_x_N", "rear_hinge_y_N",  "rear_hinge_z_N",  "kinetic_J",
             "strain_J",       "energy_J",        "work_J",          "energy_error_J"});
    Probes probes;
    Progress progress("run-up, simflex");
    const int numSamples = int(std::ceil(arguments.time / arguments.sampleInterval()));
    double initialEnergy = 0;
    for (int i = 0; i <= numSamples && !wasInterrupted(); ++i) {
        const double time = std::min(i * arguments.sampleInterval(), arguments.time);
        try {
            if (i > 0) integrator.stepTo(time);
        } catch (const std::runtime_error& error) {
            failure = error.what();
            break;
        }

        const auto start = Clock::now();
        const State& state = integrator.getState();
        const Vec3 rotor = arguments.model.calcAngle(time);
        probes.time.push_back(time);
        probes.angle.push_back(rotor[0]);
        probes.speed.push_back(rotor[1] / (2 * Pi));
        std::vector<double> row{time, probes.speed.back()};
        for (auto bearing : {StatorModel::FrontBearing, StatorModel::RearBearing}) {
            const Vec3 displacement = model.calcBearingDisplacement(state, bearing);
            probes.vertical[bearing].push_back(displacement[1]);
            probes.lateral[bearing].push_back(displacement[2]);
            row.insert(row.end(), {displacement[1], displacement[2]});
        }
        double carried = 0;
        for (const Joint& hinge :
             {Joint(model.leftHinge), Joint(model.rightHinge), Joint(model.rearHinge)}) {
            const Vec3 force = hinge.calcForceOnM(state, integrator.getMultipliers(hinge))[1];
            row.insert(row.end(), {force[0], force[1], force[2]});
            probes.largestHingeForce = std::max(probes.largestHingeForce, force.norm());
            carried += force[1];
        }
        probes.weightCarried.push_back(carried);
        const double kinetic = model.flexible.calcKineticEnergy(state);
        double strain = 0;
        for (const FlexibleBody& body : model.getBodies()) strain += body.calcStrainEnergy(state);
        const double energy = kinetic + model.system.calcPotentialEnergy(state);
        const double work = integrator.getWork();
        if (i == 0) initialEnergy = energy;
        probes.energyError.push_back(energy - initialEnergy - work);
        probes.largestKinetic = std::max(probes.largestKinetic, kinetic);
        probes.largestConstraintError =
            std::max(probes.largestConstraintError, integrator.getLargestConstraintError());
        row.insert(row.end(), {kinetic, strain, energy, work, probes.energyError.back()});
        csv.write(row);
        if (!arguments.noFrames) probes.q.push_back(state.getQ());
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

/** Half the range of values within each turn of the rotor, over the speed at mid-turn. **/
struct Envelope {
    std::vector<double> speed, amplitude;
};

Envelope calcEnvelope(const Probes& probes, const std::vector<double>& values) {
    Envelope envelope;
    for (size_t first = 0; first < values.size();) {
        size_t last = first;
        double low = values[first], high = low;
        while (last < values.size() && probes.angle[last] - probes.angle[first] < 2 * Pi) {
            low = std::min(low, values[last]);
            high = std::max(high, values[last]);
            ++last;
        }
        if (last == values.size()) break;  // the last turn is incomplete
        const double speed = probes.speed[(first + last) / 2];
        if (speed >= lowestSpeed) {
            envelope.speed.push_back(speed);
            envelope.amplitude.push_back((high - low) / 2);
        }
        first = last;
    }
    return envelope;
}

void printTable(const Arguments& arguments, const Probes& probes, const Parts& parts,
                const IntegratorStatistics& s, double linearSeconds) {
    const double total = s.totalSeconds + probes.outputSeconds;
    const double phases = s.evaluationSeconds + s.factorSeconds + s.schurSeconds +
                          s.backSubstitutionSeconds + s.simbodySeconds + s.outputSeconds;
    int numDofs = 0, numModes = 0;
    double mass = 0;
    for (const auto& part : parts) {
        numDofs += 3 * part->mesh.numNodes();
        numModes += part->numModes;
        mass += part->mass;
    }
    Table table;
    table.addHeading("Model");
    table.add("degrees of freedom of the meshes", long(numDofs));
    table.add("modes, speeds",
              std::to_string(numModes) + ", " + std::to_string(numModes + 6 * parts.size()));
    table.add("mass", mass, "kg");
    table.addHeading("Integration");
    table.add("steps", s.stepsTaken);
    table.add("Newton iterations", s.newtonIterations);
    table.add("linear solves", s.linearSolves);
    table.add("factorizations", s.factorizations);
    table.add("redundant constraints", long(s.redundantConstraints));
    table.addHeading("Wall time");
    table.add("natural modes, static equilibrium", 1e3 * linearSeconds, "ms");
    table.add("evaluation", 1e3 * s.evaluationSeconds, "ms");
    table.add("factor", 1e3 * s.factorSeconds, "ms");
    table.add("Schur complement", 1e3 * s.schurSeconds, "ms");
    table.add("back-substitution", 1e3 * s.backSubstitutionSeconds, "ms");
    table.add("Simbody", 1e3 * s.simbodySeconds, "ms");
    table.add("output (probes)", 1e3 * (s.outputSeconds + probes.outputSeconds), "ms");
    table.add("other", 1e3 * (s.totalSeconds - phases), "ms");
    table.add("total", 1e3 * total, "ms");
    table.addHeading("Result");
    table.add("rotor turns", probes.angle.back() / (2 * Pi));
    table.add("weight", mass * arguments.model.gravity, "N");
    table.add("vertical force of the hinges at rest", probes.weightCarried.front(), "N");
    table.add("largest force of a hinge", probes.largestHingeForce, "N");
    table.add("sag at rest, front bearing", -1e6 * probes.vertical[0].front(), "µm");
    table.add("sag at rest, rear bearing", -1e6 * probes.vertical[1].front(), "µm");
    const char* names[] = {"front", "rear"};
    for (int bearing = 0; bearing < 2; ++bearing)
        for (const bool isVertical : {true, false}) {
            const Envelope envelope = calcEnvelope(
                probes, isVertical ? probes.vertical[bearing] : probes.lateral[bearing]);
            if (envelope.speed.empty()) continue;
            const auto peak =
                std::max_element(envelope.amplitude.begin(), envelope.amplitude.end());
            const std::string label =
                std::string(names[bearing]) + " bearing, " + (isVertical ? "vertical" : "lateral");
            table.add("largest amplitude of the " + label, 1e6 * *peak, "µm");
            table.add("  at", envelope.speed[peak - envelope.amplitude.begin()], "Hz");
        }
    table.add("largest kinetic energy", probes.largestKinetic, "J");
    table.add("largest |energy - initial - work|", largest(probes.energyError), "J", 3);
    table.add("largest constraint error", probes.largestConstraintError, "m", 3);
    std::printf("\n%s\n", table.toString().c_str());
}

std::vector<double> scaled(std::vector<double> values, double factor) {
    for (double& value : values) value *= factor;
    return values;
}

/** Plots amplitudes of the bearings over the speed, during run-up and at constant speed. **/
void plotResponse(const Arguments& arguments, const StatorModel& model, const LinearModel& linear,
                  const Probes& probes) {
    Plot figure{"Stator: motion of the rotor's bearings during run-up", "rotor speed [Hz]", {}};
    for (int k = 0; k < linear.getNumModes() && linear.getFrequency(k) < arguments.model.speed; ++k)
        if (linear.getFrequency(k) > lowestSpeed) {
            char label[40];
            std::snprintf(label, sizeof label, "%.1f Hz", linear.getFrequency(k));
            figure.marks.push_back({linear.getFrequency(k), label});
        }
    std::vector<double> speeds;
    for (double speed = lowestSpeed; speed <= arguments.model.speed; speed += 0.25)
        speeds.push_back(speed);
    const std::array<int, 2> colors{Plot::Blue, Plot::Orange};
    const std::array<const char*, 2> names{"front", "rear"};
    std::array<Plot::Panel, 2> panels;
    panels[0].title = "Vertical";
    panels[1].title = "Lateral";
    std::array<std::array<std::vector<double>, 2>, 2> steady;  // direction, bearing
    for (const double speed : speeds)
        for (int b = 0; b < 2; ++b) {
            const Vec2 amplitude =
                model.calcSteadyAmplitude(linear, StatorModel::Bearing(b), speed);
            for (int direction = 0; direction < 2; ++direction)
                steady[direction][b].push_back(1e6 * amplitude[direction]);
        }
    for (int direction = 0; direction < 2; ++direction) {
        Plot::Panel& panel = panels[direction];
        panel.yLabel = "amplitude [µm]";
        panel.isLogarithmic = true;
        for (int b = 0; b < 2; ++b)
            panel.series.push_back({std::string(names[b]) + ", constant speed", speeds,
                                    steady[direction][b], colors[b], true});
        for (int b = 0; b < 2; ++b) {
            const Envelope envelope =
                calcEnvelope(probes, direction == 0 ? probes.vertical[b] : probes.lateral[b]);
            panel.series.push_back({std::string(names[b]) + ", run-up", envelope.speed,
                                    scaled(envelope.amplitude, 1e6), colors[b]});
        }
        figure.panels.push_back(panel);
    }
    writePlot(figure, arguments.out + "/response.png");
}

/** Plots the spectrum of the rear bearing's lateral motion during run-up. **/
void plotSpectrum(const Arguments& arguments, const LinearModel& linear, const Probes& probes) {
    Figure figure;
    figure.title = "Stator: spectrum of the rear bearing's lateral motion during run-up";
    figure.xLabel = "rotor speed [Hz]";
    FigurePanel& panel = figure.panels.emplace_back();
    panel.label = "frequency [Hz]";
    FigureMap& map = panel.map;
    map.label = "amplitude [µm]";
    const double highest = 1.4 * arguments.model.speed;
    for (double f = 0; f <= highest; f += 1) map.y.push_back(f);
    const std::vector<double> lateral = scaled(probes.lateral[1], 1e6);
    // Evenly over the speed, as long as it rises.
    size_t sample = 0;
    for (double speed = 0; speed <= 0.998 * arguments.model.speed; speed += 1) {
        while (sample + 1 < probes.speed.size() && probes.speed[sample] < speed) ++sample;
        if (probes.speed[sample] < speed) break;
        map.x.push_back(speed);
        map.rows.push_back(calcAmplitudeSpectrum(lateral, arguments.sampleInterval(),
                                                 probes.time[sample], windowWidth, map.y));
    }
    if (map.x.size() < 2) return;
    const double last = map.x.back();
    for (int k = 0; k < linear.getNumModes() && linear.getFrequency(k) < highest; ++k) {
        char label[40];
        std::snprintf(label, sizeof label, "%.1f Hz", linear.getFrequency(k));
        panel.curves.push_back(
            {label, {0, last}, {linear.getFrequency(k), linear.getFrequency(k)}});
        panel.curves.back().isFaint = true;
    }
    panel.curves.push_back({"1 × speed", {0, last}, {0, last}});
    panel.curves.back().isFaint = true;
    drawFigure(arguments.out + "/spectrum.png", figure);
}

/** The rotor at the angle of a frame's time. **/
class RotorDecoration : public DecorationGenerator {
public:
    explicit RotorDecoration(const StatorModel& model) : m_model(model) {}

    void generateDecorations(const State& state, Array_<DecorativeGeometry>& geometry) override {
        m_model.addRotorDecorations(m_model.getOptions().calcAngle(state.getTime())[0], geometry);
    }

private:
    const StatorModel& m_model;
};

/** States under a stroboscope, evenly over the speed: each is whole turns and 1/framesPerCycle of a
 * turn after the one before, so that the frames show the vibration in slow motion. **/
std::vector<State> makeStrobedStates(const Arguments& arguments, const Probes& probes,
                                     const State& like) {
    std::vector<State> states;
    size_t k = 0;
    const double highest = probes.speed.back();
    for (int frame = 0; frame < arguments.frames; ++frame) {
        const double speed = lowestSpeed + (highest - lowestSpeed) * frame / arguments.frames;
        while (k + 2 < probes.speed.size() && probes.speed[k + 1] < speed) ++k;
        const double turns = double(frame) / framesPerCycle;
        const double angle = 2 * Pi * (turns + std::ceil(probes.angle[k] / (2 * Pi) - turns));
        while (k + 2 < probes.angle.size() && probes.angle[k + 1] < angle) ++k;
        if (probes.angle[k + 1] < angle) break;
        const double part = (angle - probes.angle[k]) / (probes.angle[k + 1] - probes.angle[k]);
        State state = like;
        state.setTime(probes.time[k] + part * (probes.time[k + 1] - probes.time[k]));
        state.updQ() = (1 - part) * probes.q[k] + part * probes.q[k + 1];
        states.push_back(state);
    }
    return states;
}

/** The frame of largest motion in each sixth of the run-up. **/
std::vector<int> findStrongFrames(const StatorModel& model, const std::vector<State>& states,
                                  int numFrames) {
    std::vector<int> frames;
    for (int part = 0; part < 6; ++part) {
        int strongest = -1;
        double most = -1;
        const int begin = numFrames * part / 6;
        const int end = numFrames * (part + 1) / 6;
        for (int i = begin; i < end; ++i) {
            double motion = 0;
            model.system.realize(states[i], Stage::Velocity);
            for (auto bearing : {StatorModel::FrontBearing, StatorModel::RearBearing})
                motion += model.calcBearingDisplacement(states[i], bearing).norm();
            if (motion > most) {
                most = motion;
                strongest = i;
            }
        }
        if (strongest >= 0) frames.push_back(strongest);
    }
    return frames;
}

/** Writes frames of the run with exaggerated deformations, a video and a contact sheet. **/
void render(const Arguments& arguments, const StatorModel& model, const Probes& probes,
            const State& like) {
    const std::vector<State> states = makeStrobedStates(arguments, probes, like);
    if (states.size() < 6) {
        std::printf("no frames: the rotor must turn some times above %.0f Hz\n", lowestSpeed);
        return;
    }
    OffscreenVisualizer viz(model.system, 1280, 720);
    for (const FlexibleBody& body : model.getBodies()) {
        const Transform pose = model.getUndeformedPose(body);
        viz.addDeformableMesh({model.makePicturePart(body), body.getName(),
                               [pose](const State&) { return pose; },
                               [&model, body](const State& state) {
                                   return model.calcPictureCoordinates(body, state);
                               }});
    }
    viz.addDecorationGenerator(new RotorDecoration(model));
    viz.setOutputFolder(arguments.out + "/frames");
    viz.setCameraView(-0.8, 0.22).setShowUndeformed(false);
    double range = 0;  // of the bearings; the inlet's rim exceeds it at times
    for (int b = 0; b < 2; ++b)
        range = std::max({range, largest(probes.vertical[b]), largest(probes.lateral[b])});
    viz.fitToMotion(states);
    viz.setContourRange(0, std::ceil(1.2e4 * range) * 1e-4);
    const std::string video = arguments.out + "/stator.mp4";
    if (isVideoAvailable()) viz.addVideo(video, {framesPerSecond});
    {
        Progress progress("frames");
        for (size_t i = 0; i < states.size() && !wasInterrupted(); ++i) {
            char title[80];
            std::snprintf(title, sizeof title, "Aeroengine stator: rotor at %.0f Hz",
                          arguments.model.calcAngle(states[i].getTime())[1] / (2 * Pi));
            viz.setWindowTitle(title).report(states[i]);
            progress.show(double(i + 1) / double(states.size()));
        }
        viz.finish();
    }
    std::printf("wrote %d frames to %s\n", viz.getNumFrames(), viz.getOutputFolder().c_str());
    if (viz.getNumFrames() < 6) return;

    std::vector<std::string> files;
    for (const int frame : findStrongFrames(model, states, viz.getNumFrames())) {
        char name[40];
        std::snprintf(name, sizeof name, "/frame_%05d.png", frame);
        files.push_back(viz.getOutputFolder() + name);
    }
    makeContactSheet(files, 2, 640).writePng(arguments.out + "/contact_sheet.png");
    std::printf("wrote %s/contact_sheet.png\n", arguments.out.c_str());
    if (isVideoAvailable())
        std::printf("wrote %s (stroboscopic: %d frames a vibration)\n", video.c_str(),
                    framesPerCycle);
    else
        std::printf("no video: ffmpeg is not installed\n");
}

int run(const Arguments& arguments) {
    const Parts parts = readParts(arguments);
    fs::create_directories(arguments.out);
    printParts(parts);

    StatorModel model(arguments.model, parts);
    const auto start = Clock::now();
    const LinearModel linear = model.makeLinearModel();
    const State initial = model.makeInitialState();
    const double linearSeconds = secondsSince(start);
    printModel(arguments, linear);

    BdfIntegrator integrator(model.system);
    integrator.setAccuracy(arguments.accuracy);
    if (arguments.threads > 0) integrator.setNumThreads(arguments.threads);
    integrator.initialize(initial);
    std::string failure;
    const Probes probes = runUp(arguments, model, integrator, failure);
    if (wasInterrupted())
        std::printf("\nstopped at t = %.4g s; what is finished is kept\n", integrator.getTime());
    if (!failure.empty()) std::fprintf(stderr, "stator: %s\n", failure.c_str());
    if (probes.time.size() < 2) return failure.empty() ? 130 : 1;

    printTable(arguments, probes, parts, integrator.getStatistics(), linearSeconds);
    std::printf("wrote %s/response.csv\n", arguments.out.c_str());
    // Plots are logarithmic, over the speed.
    const StatorOptions& options = arguments.model;
    const bool isShaken = options.frontUnbalance != 0 || options.rearUnbalance != 0;
    if (!isShaken || probes.speed.back() < 2 * lowestSpeed)
        std::printf("no plots: they need an unbalance and a speed above %.0f Hz\n",
                    2 * lowestSpeed);
    else {
        plotResponse(arguments, model, linear, probes);
        plotSpectrum(arguments, linear, probes);
        std::printf("wrote %s/response.png, spectrum.png\n", arguments.out.c_str());
    }
    if (!arguments.noFrames && !wasInterrupted()) {
        render(arguments, model, probes, integrator.getState());
        if (wasInterrupted()) std::printf("stopped while drawing; what is finished is kept\n");
    }
    return wasInterrupted() ? 130 : failure.empty() ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
    Arguments arguments;
    CLI::App app("Aeroengine stator of five flexible casings, shaken by its rotor's unbalance.");
    app.option_defaults()->take_last()->always_capture_default();
    app.add_option("--speed", arguments.model.speed, "Speed of the rotor after the run-up [Hz]")
        ->check(CLI::PositiveNumber);
    app.add_option("--run-up", arguments.model.runUp, "Duration of the run-up [s]")
        ->check(CLI::PositiveNumber);
    app.add_option("--front-unbalance", arguments.model.frontUnbalance,
                   "Unbalance at the bearing of the compressor casing [kg m]");
    app.add_option("--rear-unbalance", arguments.model.rearUnbalance,
                   "Unbalance at the bearing of the turbine casing, a quarter turn behind [kg m]");
    app.add_option("--gravity", arguments.model.gravity, "Gravity [m/s2]");
    app.add_option("--damping", arguments.model.damping, "Damping ratio of each mode of the parts")
        ->check(CLI::NonNegativeNumber);
    app.add_option("--accuracy", arguments.accuracy, "Local error allowed in a step [m]")
        ->check(CLI::PositiveNumber);
    app.add_option("--time", arguments.time, "Duration [s]")->check(CLI::PositiveNumber);
    app.add_option("--parts", arguments.parts, "Folder of the reduced parts");
    app.add_option("-o,--output", arguments.out, "Folder to write");
    app.add_option("--frames", arguments.frames, "Approximate number of pictures")
        ->check(CLI::Range(6, 10000));
    app.add_flag("--no-frames", arguments.noFrames, "Draw the plots only");
    app.add_option("--threads", arguments.threads,
                   "Number of threads (default: chosen by the library)")
        ->check(CLI::NonNegativeNumber);
    CLI11_PARSE(app, argc, argv);
    std::setvbuf(stdout, nullptr, _IOLBF, 0);  // in step with the progress on standard error
    catchInterrupts();
    try {
        return run(arguments);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "stator: %s\n", error.what());
        return 1;
    }
}
