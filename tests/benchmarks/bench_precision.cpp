// Work-precision diagrams: global error against wall time for BDF of orders 1 to 5,
// generalized-alpha, Radau and, on models soft and small enough, Simbody's integrators, over
// accuracies from 1e-2 to 1e-8 of the size of each model's motion. Two longer problems compare
// Radau and the default BDF by their cost for a given error.
//
//   bench_precision [--out DIR] [MODEL...]     default: all models, build/output/precision

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <memory>

#include "simflex/part/ReducedBodyFile.h"
#include "simflex/solver/BdfIntegrator.h"
#include "simflex/solver/GeneralizedAlphaIntegrator.h"
#include "simflex/solver/RadauIntegrator.h"
#include "support/Plot.h"
#include "support/PointMassPart.h"
#include "support/SliderCrankModel.h"
#include "support/StatorModel.h"

namespace simflex {
namespace {

using namespace SimTK;
using examples::Plot;
using Probe = std::vector<double>;

/** A model and its observed quantities: lengths [m]. **/
struct Problem {
    std::string name;
    double duration;
    double size;  ///< of the observed motion [m]; accuracies and errors are relative to it
    std::string error = "global error, as a part of the motion";
    std::vector<double> accuracies = {1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8};
    double tightest = 1e-10;        ///< accuracy of the reference
    bool comparesDefaults = false;  ///< only the default BDF and Radau
    Probe end;                      ///< published end values, if any
    const MultibodySystem* system = nullptr;
    State state;
    std::function<Probe(const State&)> probe;
    bool runsNatively = false;
    double nativeFactor = 1;      ///< accuracy of Simbody's integrators over ours
    std::shared_ptr<void> model;  ///< keeps the system alive
};

constexpr int NumSamples = 10;  // instants at which solutions are compared

std::shared_ptr<const ReducedBody> readPart(const std::string& name) {
    return std::make_shared<const ReducedBody>(
        readReducedBody(std::string(SIMFLEX_PARTS) + "/" + name + ".h5"));
}

Problem makeSliderCrank() {
    examples::SliderCrankOptions options;
    options.drive = examples::SliderCrankOptions::Drive::Torque;
    options.runUp = 0.02;
    options.damping = 0.05;
    static const auto crank = readPart("crank"), rod = readPart("rod");
    auto model = std::make_shared<examples::SliderCrankModel>(options, crank, rod);
    Problem problem;
    problem.name = "slider_crank";
    problem.duration = 0.1;
    problem.size = 1e-2;
    problem.state = model->makeInitialState();
    problem.system = &model->system;
    problem.probe = [m = model.get()](const State& state) {
        return Probe{m->calcSliderPosition(state), m->calcRodDeflection(state),
                     m->calcCrankDeflection(state)};
    };
    problem.model = model;
    return problem;
}

/** The same without damping, for longer and under a torque that turns it a few times, so excited
modes persist. Observes the slider's position in metres. **/
Problem makeFreeSliderCrank() {
    examples::SliderCrankOptions options;
    options.drive = examples::SliderCrankOptions::Drive::Torque;
    options.torque = 0.1;
    options.damping = 0;
    static const auto crank = readPart("crank"), rod = readPart("rod");
    auto model = std::make_shared<examples::SliderCrankModel>(options, crank, rod);
    Problem problem;
    problem.name = "slider_crank_free";
    problem.duration = 1;
    problem.size = 1;
    problem.error = "largest error of the slider's position [m]";
    problem.accuracies = {1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11};
    problem.tightest = 1e-12;
    problem.comparesDefaults = true;
    problem.state = model->makeInitialState();
    problem.system = &model->system;
    problem.probe = [m = model.get()](const State& state) {
        return Probe{m->calcSliderPosition(state)};
    };
    problem.model = model;
    return problem;
}

Problem makeStator() {
    examples::StatorOptions options;
    options.runUp = 0.05;
    options.speed = 200;
    static const auto parts = [] {
        std::vector<std::shared_ptr<const ReducedBody>> list;
        for (const char* name : examples::StatorModel::getPartNames())
            list.push_back(readPart(name));
        return list;
    }();
    auto model = std::make_shared<examples::StatorModel>(options, parts);
    Problem problem;
    problem.name = "stator";
    problem.duration = 0.05;
    problem.size = 1e-4;
    problem.tightest = 1e-9;
    problem.state = model->makeInitialState();
    problem.system = &model->system;
    problem.probe = [m = model.get()](const State& state) {
        Probe probe;
        for (auto bearing :
             {examples::StatorModel::FrontBearing, examples::StatorModel::RearBearing})
            for (int a = 0; a < 3; ++a)
                probe.push_back(m->calcBearingDisplacement(state, bearing)[a]);
        return probe;
    };
    problem.model = model;
    return problem;
}

struct Multibody {
    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    GeneralForceSubsystem forces{system};
    FlexibleBodySubsystem flexible{system, matter};
};

/** Weights of the flexible bodies in metres give accuracies the same meaning for all
integrators. **/
void runNatively(Problem& problem, const Multibody& model) {
    problem.system = &model.system;
    model.flexible.initializeNative(problem.state, 1e-12);
    problem.runsNatively = true;
    problem.nativeFactor = problem.size;
}

/** A soft part of seven modes, spinning and vibrating in free flight. **/
Problem makeSpinningBody() {
    auto model = std::make_shared<Multibody>();
    test::PointMassPartOptions options;
    options.numModes = 7;
    options.lowestFrequency = 8;
    options.highestFrequency = 30;
    const auto part = test::makePointMassPart(options);
    const FlexibleBody body(model->flexible, part.body);
    Problem problem;
    problem.name = "spinning_body";
    problem.duration = 0.5;
    problem.size = 1e-3;
    problem.state = model->system.realizeTopology();
    body.setFrameVelocity(problem.state, SpatialVec(Vec3(3, 1, -2), Vec3(0.3, -0.2, 0.1)));
    Vector xi(7), xiDot(7);
    for (int i = 0; i < 7; ++i) {
        xi[i] = 2e-3 * std::cos(1.0 + i);
        xiDot[i] = 0.05 * std::sin(2.0 + i);
    }
    body.setModalCoordinates(problem.state, xi);
    body.setModalSpeeds(problem.state, xiDot);
    runNatively(problem, *model);
    problem.probe = [body](const State& state) {
        Probe probe;
        const auto& numbers = body.getPart().mesh.nodeNumbers;
        for (int node : {numbers.front(), numbers.back()})
            for (int a = 0; a < 3; ++a) probe.push_back(body.calcNodeLocation(state, node)[a]);
        return probe;
    };
    problem.model = model;
    return problem;
}

/** Two soft links with five and seven modes on balls, swinging out of the plane. **/
Problem makeSoftPendulum() {
    auto model = std::make_shared<Multibody>();
    Force::Gravity(model->forces, model->matter, -YAxis, 9.81);
    const auto makeLink = [&](unsigned seed, int modes) {
        test::PointMassPartOptions options;
        options.seed = seed;
        options.numModes = modes;
        options.lowestFrequency = 8;
        options.highestFrequency = 30;
        return FlexibleBody(model->flexible, test::makePointMassPart(options).body);
    };
    const FlexibleBody upper = makeLink(3, 5), lower = makeLink(4, 7);
    Joint::Ball(model->flexible, model->matter.Ground(), upper.interface("A"));
    Joint::Ball(model->flexible, upper.interface("B"), lower.interface("A"));
    Problem problem;
    problem.name = "soft_pendulum";
    problem.duration = 0.5;
    problem.size = 1e-2;
    problem.state = model->system.realizeTopology();
    upper.setPoseByInterface(problem.state, "A", Transform());
    model->system.realize(problem.state, Stage::Velocity);
    lower.setPoseByInterface(problem.state, "A", upper.interface("B").calcMotion(problem.state).X);
    lower.setFrameVelocity(problem.state, SpatialVec(Vec3(0, 1, 0.5), Vec3(0)));
    runNatively(problem, *model);
    problem.probe = [upper, lower](const State& state) {
        Probe probe;
        for (const FlexibleBody& body : {upper, lower})
            for (int a = 0; a < 3; ++a)
                probe.push_back(
                    body.calcNodeLocation(state, body.getPart().mesh.nodeNumbers.back())[a]);
        return probe;
    };
    problem.model = model;
    return problem;
}

/** A bob on a rod that is a stiff 1 m spring (100 rad/s), released stretched at 60 degrees. Rigid
bodies only, so Simbody's own integrators run the same model. **/
Problem makeStiffPendulum() {
    auto model = std::make_shared<Multibody>();
    Force::UniformGravity(model->forces, model->matter, Vec3(0, -9.81, 0));
    const Body::Rigid rod(MassProperties(0.1, Vec3(0), Inertia(0.01)));
    const Body::Rigid bob(MassProperties(1, Vec3(0), Inertia(0.004)));
    MobilizedBody::Pin pin(model->matter.updGround(), Transform(), rod, Transform());
    MobilizedBody::Slider slider(pin, Transform(), bob, Transform());
    Force::MobilityLinearSpring(model->forces, slider, MobilizerQIndex(0), 1e4, 1);
    Problem problem;
    problem.name = "stiff_pendulum";
    problem.duration = 1;
    problem.size = 1e-3;
    problem.state = model->system.realizeTopology();
    pin.setAngle(problem.state, -Pi / 6);
    slider.setLength(problem.state, 1.005);
    problem.system = &model->system;
    problem.probe = [slider](const State& state) {
        const Vec3 p = slider.getBodyOriginLocation(state);
        return Probe{p[0], p[1]};
    };
    problem.runsNatively = true;
    problem.model = model;
    return problem;
}

/** Andrews' squeezing mechanism: seven bodies in a plane, K1 driven by a torque, K3 held by a
spring. All loops close at one point of K2. Angles in the order β, Θ, γ, Φ, δ, Ω, ε, in radians.
Data and end values: IVP test set, problem "andrews"; E. Hairer, G. Wanner, Solving ODEs II,
VII.7. **/
Problem makeAndrews() {
    auto model = std::make_shared<Multibody>();
    const auto makeBody = [](Real mass, const Vec3& center, Real inertia) {
        return Body::Rigid(
            MassProperties(mass, center, Inertia(inertia).shiftFromMassCenter(-center, mass)));
    };
    MobilizedBody& ground = model->matter.updGround();
    const Vec3 A(-0.06934, -0.00227, 0), B(-0.03635, 0.03273, 0), C(0.014, 0.072, 0);
    using Pin = MobilizedBody::Pin;
    Pin k1(ground, Vec3(0), makeBody(0.04325, Vec3(0.00092, 0, 0), 2.194e-6), Vec3(0));
    Pin k2(k1, Vec3(0.007, 0, 0), makeBody(0.00365, Vec3(-0.0115, 0, 0), 4.410e-7), Vec3(0));
    Pin k3(ground, B, makeBody(0.02373, Vec3(0.01043, -0.01874, 0), 5.255e-6), Vec3(0));
    Pin k5(ground, A, makeBody(0.07050, Vec3(0.02308, 0.00916, 0), 1.169e-5), Vec3(0));
    Pin k4(k5, Vec3(0.04, 0, 0), makeBody(0.00706, Vec3(0, -0.00579, 0), 5.667e-7), Vec3(0));
    Pin k7(ground, A, makeBody(0.05498, Vec3(-0.01228, -0.00449, 0), 1.912e-5), Vec3(0));
    Pin k6(k7, Vec3(0, -0.04, 0), makeBody(0.00706, Vec3(0.00579, 0, 0), 5.667e-7), Vec3(0));
    const Attachment end(k2, Vec3(-0.028, 0, 0));
    Joint::PointOnLine(model->flexible, end, Attachment(k3, Vec3(0, -0.035, 0)));
    Joint::PointOnLine(model->flexible, end, Attachment(k4, Vec3(0, -0.02, 0)));
    Joint::PointOnLine(model->flexible, end, Attachment(k6, Vec3(0.02, 0, 0)));
    Force::TwoPointLinearSpring(model->forces, k3, Vec3(0.02, -0.018, 0), ground, C, 4530, 0.07785);
    Force::MobilityConstantForce(model->forces, k1, MobilizerUIndex(0), 0.033);
    Problem problem;
    problem.name = "andrews";
    problem.duration = 0.03;
    problem.size = 1;
    problem.error = "largest error of the angles [rad]";
    problem.accuracies = {1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11};
    problem.tightest = 1e-13;
    problem.comparesDefaults = true;
    problem.end = {15.81077119629904,  -15.75637105984298, 0.04082224013073101, -0.5347301163226948,
                   0.5244099658805304, 0.5347301163226948, 1.048080741042263};
    problem.state = model->system.realizeTopology();
    problem.system = &model->system;
    std::vector<Pin> pins = {k1, k2, k3, k4, k5, k6, k7};
    const double angles[] = {-0.0617138900142764496, 0,
                             0.455279819163070380,   0.222668390165885885,
                             0.487364979543842550,   -0.222668390165885885,
                             1.23054744454982119};
    for (size_t k = 0; k < pins.size(); ++k) pins[k].setAngle(problem.state, angles[k]);
    problem.probe = [pins](const State& state) {
        Probe probe;
        for (const Pin& pin : pins) probe.push_back(pin.getAngle(state));
        return probe;
    };
    problem.model = model;
    return problem;
}

struct Solution {
    std::vector<Probe> samples;
    double seconds = 0;
    long steps = 0, iterations = 0;
};

double secondsSince(std::chrono::steady_clock::time_point start) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

Solution run(ImplicitIntegrator& integrator, const Problem& problem, double accuracy) {
    Solution solution;
    integrator.setAccuracy(accuracy * problem.size);
    integrator.setNumThreads(1);
    const auto start = std::chrono::steady_clock::now();
    integrator.initialize(problem.state);
    double probing = 0;
    for (int k = 1; k <= NumSamples; ++k) {
        integrator.stepTo(k * problem.duration / NumSamples);
        const auto probeStart = std::chrono::steady_clock::now();
        solution.samples.push_back(problem.probe(integrator.getState()));
        probing += secondsSince(probeStart);
    }
    solution.seconds = secondsSince(start) - probing;
    solution.steps = integrator.getStatistics().stepsTaken;
    solution.iterations = integrator.getStatistics().newtonIterations;
    return solution;
}

Solution run(Integrator& integrator, const Problem& problem, double accuracy) {
    Solution solution;
    integrator.setAccuracy(accuracy * problem.nativeFactor);
    const auto start = std::chrono::steady_clock::now();
    TimeStepper stepper(*problem.system, integrator);
    stepper.initialize(problem.state);
    for (int k = 1; k <= NumSamples; ++k) {
        stepper.stepTo(k * problem.duration / NumSamples);
        problem.system->realize(stepper.getState(), Stage::Position);
        solution.samples.push_back(problem.probe(stepper.getState()));
    }
    solution.seconds = secondsSince(start);
    solution.steps = integrator.getNumStepsTaken();
    solution.iterations = integrator.getNumIterations();
    return solution;
}

double calcError(const Solution& solution, const Solution& reference) {
    double error = 0;
    for (size_t k = 0; k < reference.samples.size(); ++k)
        for (size_t i = 0; i < reference.samples[k].size(); ++i)
            error = std::max(error, std::abs(solution.samples[k][i] - reference.samples[k][i]));
    return error;
}

struct Method {
    std::string name;
    int order;  ///< 0: no promised slope
    int color;
    std::function<Solution(const Problem&, double accuracy)> run;
};

std::vector<Method> listMethods(const Problem& problem) {
    const int colors[] = {Plot::Slate, Plot::Gold, Plot::Sky, Plot::Green, Plot::Blue};
    const Method radau{"Radau", 0, Plot::Pink, [](const Problem& p, double accuracy) {
                           RadauIntegrator integrator(*p.system);
                           return run(integrator, p, accuracy);
                       }};
    if (problem.comparesDefaults)
        return {{"default BDF", 0, colors[1],
                 [](const Problem& p, double accuracy) {
                     BdfIntegrator integrator(*p.system);
                     return run(integrator, p, accuracy);
                 }},
                radau};
    std::vector<Method> methods;
    for (int order = 1; order <= 5; ++order)
        methods.push_back({"BDF" + std::to_string(order), order, colors[order - 1],
                           [order](const Problem& p, double accuracy) {
                               BdfIntegrator integrator(*p.system);
                               integrator.setMaximumOrder(order);
                               return run(integrator, p, accuracy);
                           }});
    methods.push_back({"generalized-alpha", 2, Plot::Orange, [](const Problem& p, double accuracy) {
                           GeneralizedAlphaIntegrator integrator(*p.system);
                           return run(integrator, p, accuracy);
                       }});
    methods.push_back(radau);
    if (!problem.runsNatively) return methods;
    methods.push_back({"Simbody RKM", 0, Plot::Orange, [](const Problem& p, double accuracy) {
                           RungeKuttaMersonIntegrator integrator(*p.system);
                           return run(integrator, p, accuracy);
                       }});
    methods.push_back({"Simbody CPodes", 0, Plot::Gold, [](const Problem& p, double accuracy) {
                           CPodesIntegrator integrator(*p.system);
                           return run(integrator, p, accuracy);
                       }});
    return methods;
}

/** Fits the slope of log error over log accuracy by least squares. **/
double fitSlope(const std::vector<double>& x, const std::vector<double>& y) {
    double sx = 0, sy = 0, sxx = 0, sxy = 0;
    const double n = double(x.size());
    for (size_t i = 0; i < x.size(); ++i) {
        const double a = std::log10(x[i]), b = std::log10(std::max(y[i], 1e-300));
        sx += a, sy += b, sxx += a * a, sxy += a * b;
    }
    return (n * sxy - sx * sy) / (n * sxx - sx * sx);
}

/** Result of a method at one accuracy. **/
struct Run {
    double accuracy, error, seconds, steps, iterations;
};
using Runs = std::vector<Run>;

/** Returns the cost of a run with this error by logarithmic interpolation between two runs.
Extrapolation beyond the last run is reported and assumes order 2, where the error falls as
accuracy^(2/3) and the cost grows as its inverse square root. **/
double findCost(const Runs& runs, double error, double Run::*cost) {
    size_t k = 0;
    while (k < runs.size() && runs[k].error > error) ++k;
    if (k == 0) return runs[0].*cost;
    if (k == runs.size()) {
        std::printf("(to an error of %g: extrapolated from %.1e)\n", error, runs.back().error);
        return runs.back().*cost * std::sqrt(runs.back().error / error);
    }
    const Run &before = runs[k - 1], &after = runs[k];
    const double share = std::log(error / before.error) / std::log(after.error / before.error);
    return before.*cost * std::pow(after.*cost / (before.*cost), share);
}

/** Runs of all methods, by name. **/
using Study = std::map<std::string, Runs>;

/** Errors are differences from Radau's solution at the tightest accuracy.
@param floor  distance of that solution from the published values, from BDF5 or from Radau at ten
times the accuracy; smaller errors are meaningless **/
Solution findReference(const Problem& problem, const std::vector<Method>& methods, double& floor) {
    const auto run = [&](const std::string& name, double accuracy) {
        return std::find_if(methods.begin(), methods.end(),
                            [&](const Method& method) { return method.name == name; })
            ->run(problem, accuracy);
    };
    const Solution reference = run("Radau", problem.tightest);
    Solution second = reference;
    if (!problem.end.empty())
        second.samples.back() = problem.end;
    else if (problem.comparesDefaults)
        second = run("Radau", 10 * problem.tightest);
    else
        second = run("BDF5", problem.tightest);
    floor = calcError(second, reference) / problem.size;
    return reference;
}

Study study(const Problem& problem, const std::string& folder, std::string& json) {
    const std::vector<Method> methods = listMethods(problem);
    double floor = 0;
    const Solution reference = findReference(problem, methods, floor);
    std::printf("\n%s: %g s; %s", problem.name.c_str(), problem.duration, problem.error.c_str());
    if (problem.size != 1) std::printf(", %g m", problem.size);
    std::printf("; two references differ by %.1e\n", floor);
    std::printf("%-18s %9s %12s %10s %10s %10s\n", "method", "accuracy", "error", "time [ms]",
                "steps", "iterations");

    Plot plot{problem.name, problem.error, {}, {}, true};
    plot.panels.push_back({"", "wall time [ms]", {}, true});
    Study result;
    json += (json.empty() ? "" : ", ") + ("\"" + problem.name + "\": {");
    for (const Method& method : methods) {
        Runs& runs = result[method.name];
        std::vector<double> errors, times;
        std::vector<double> x, y;  // above the reference's own error
        bool isMonotonic = true;
        double worst = 0;  // error over accuracy
        for (double accuracy : problem.accuracies) {
            Solution solution = method.run(problem, accuracy);
            for (int repeat = 1; repeat < 3 && solution.seconds < 0.3; ++repeat)
                solution.seconds =
                    std::min(solution.seconds, method.run(problem, accuracy).seconds);
            const double error = calcError(solution, reference) / problem.size;
            if (!runs.empty() && error > runs.back().error && error > 3 * floor)
                isMonotonic = false;
            if (error > floor) errors.push_back(error), times.push_back(1e3 * solution.seconds);
            if (error > 3 * floor) {
                x.push_back(accuracy), y.push_back(error);
                worst = std::max(worst, error / accuracy);
            }
            runs.push_back({accuracy, error, solution.seconds, double(solution.steps),
                            double(solution.iterations)});
            std::printf("%-18s %9.0e %12.3e %10.2f %10ld %10ld\n", method.name.c_str(), accuracy,
                        error, 1e3 * solution.seconds, solution.steps, solution.iterations);
            std::fflush(stdout);
        }
        plot.panels[0].series.push_back(
            {method.name, errors, times, method.color, method.name.compare(0, 7, "Simbody") == 0});
        plot.panels[0].series.back().hasPoints = true;
        const double slope = x.size() > 1 ? fitSlope(x, y) : 0;
        char text[160];
        std::snprintf(
            text, sizeof text,
            "%s\"%s\": {\"slope\": %.2f, \"error_over_accuracy\": %.3g, \"monotonic\": %s}",
            &method == &methods.front() ? "" : ", ", method.name.c_str(), slope, worst,
            isMonotonic ? "true" : "false");
        json += text;
        std::printf("%-18s slope %.2f", "", slope);
        if (method.order > 0)
            std::printf(" (at least %.2f is promised)", double(method.order) / (method.order + 1));
        std::printf(", error at most %.3g accuracies, %s\n", worst,
                    isMonotonic ? "monotonic" : "NOT monotonic");
    }
    json += "}";

    std::filesystem::create_directories(folder);
    std::ofstream csv(folder + "/" + problem.name + ".csv");
    csv << "method,accuracy,error,time_ms,steps,iterations\n";
    for (const Method& method : methods)
        for (const Run& run : result[method.name])
            csv << method.name << ',' << run.accuracy << ',' << run.error << ','
                << 1e3 * run.seconds << ',' << run.steps << ',' << run.iterations << '\n';
    examples::writePlot(plot, folder + "/" + problem.name + ".png");
    std::printf("%s\n", (folder + "/" + problem.name + ".png").c_str());
    return result;
}

/** Returns the JSON figures that compare Radau with the default BDF. **/
std::string summarize(const Problem& problem, const Study& study) {
    if (!problem.comparesDefaults) return "";
    const Runs &bdf = study.at("default BDF"), &radau = study.at("Radau");
    char text[400];
    if (problem.name == "andrews") {
        const double steps = findCost(radau, 1e-5, &Run::steps);
        std::printf("to 1e-5 rad: %.0f steps by Radau, %.0f by BDF\n", steps,
                    findCost(bdf, 1e-5, &Run::steps));
        std::snprintf(text, sizeof text, ", \"andrews_error_1e-5_steps\": %.0f", steps);
        return text;
    }
    double ratios[2];
    for (int k = 0; k < 2; ++k) {
        const double error = k == 0 ? 1e-5 : 1e-7;
        const double own = findCost(radau, error, &Run::seconds),
                     other = findCost(bdf, error, &Run::seconds);
        ratios[k] = own / other;
        std::printf("to %g m: %.3f s by Radau, %.3f s by BDF\n", error, own, other);
    }
    const auto at = [](const Runs& runs) {  // at the default accuracy
        return *std::find_if(runs.begin(), runs.end(),
                             [](const Run& run) { return run.accuracy == 1e-6; });
    };
    const Run r = at(radau), b = at(bdf);
    std::snprintf(text, sizeof text,
                  ", \"slider_crank_free\": {\"radau\": {\"error\": %.2e, \"seconds\": %.4f}, "
                  "\"bdf\": {\"error\": %.2e, \"seconds\": %.4f}}, \"radau_over_bdf_at_1e-5\": "
                  "%.3f, \"radau_over_bdf_at_1e-7\": %.4f, \"newton_iterations_per_step\": %.2f",
                  r.error, r.seconds, b.error, b.seconds, ratios[0], ratios[1],
                  r.iterations / r.steps);
    return text;
}

}  // namespace
}  // namespace simflex

int main(int argc, char** argv) {
    using namespace simflex;
    const std::map<std::string, Problem (*)()> problems = {
        {"slider_crank", makeSliderCrank},          {"spinning_body", makeSpinningBody},
        {"soft_pendulum", makeSoftPendulum},        {"stator", makeStator},
        {"slider_crank_free", makeFreeSliderCrank}, {"andrews", makeAndrews},
        {"stiff_pendulum", makeStiffPendulum}};
    std::string folder = SIMFLEX_OUTPUT "/precision", slopes, goals;
    std::vector<std::string> names;
    for (int i = 1; i < argc; ++i) {
        const std::string argument = argv[i];
        if (argument == "--out" && i + 1 < argc) {
            folder = argv[++i];
        } else if (problems.count(argument)) {
            names.push_back(argument);
        } else {
            std::fprintf(stderr, "bench_precision [--out DIR] [MODEL...]; models:");
            for (const auto& problem : problems) std::fprintf(stderr, " %s", problem.first.c_str());
            std::fprintf(stderr, "\n");
            return 2;
        }
    }
    if (names.empty())
        for (const auto& problem : problems) names.push_back(problem.first);
    for (const std::string& name : names) {
        const Problem problem = problems.at(name)();
        goals += summarize(problem, study(problem, folder, slopes));
    }
    std::printf("\n{\"slopes\": {%s}%s}\n", slopes.c_str(), goals.c_str());
    return 0;
}
