// Work-precision diagrams: global error against wall time for BDF of orders 1 to 5,
// generalized-alpha and, on models soft and small enough, Simbody's integrators, over accuracies
// 1e-2 to 1e-8 of the size of each model's motion.
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

/** A model and what is looked at in it: lengths [m]. **/
struct Problem {
    std::string name;
    double duration;
    double size;  ///< of the motion that is looked at [m]; accuracies and errors are parts of it
    const MultibodySystem* system = nullptr;
    State state;
    std::function<Probe(const State&)> probe;
    bool runsNatively = false;
    double nativeFactor = 1;      ///< from accuracy to that of Simbody's integrators
    std::shared_ptr<void> model;  ///< keeps the system alive
};

constexpr int NumSamples = 10;  // instants at which solutions are compared
const std::vector<double> accuracies = {1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8};

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

/** With flexible bodies' weights in metres, accuracies of all integrators mean the same. **/
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

/** Two soft links of five and seven modes on balls, swinging out of the plane. **/
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

/** A bob on a rod that is a stiff spring (100 rad/s) of 1 m, let go at 60 degrees, stretched. Rigid
bodies only: Simbody's own integrators run the same model. **/
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

struct Solution {
    std::vector<Probe> samples;
    double seconds = 0;
    long steps = 0;
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
    int order;  ///< 0: not ours
    std::string color;
    std::function<Solution(const Problem&, double accuracy)> run;
};

std::vector<Method> listMethods(const Problem& problem) {
    const char* colors[] = {"#000000", "#e69f00", "#56b4e9", "#009e73", "#0072b2"};
    std::vector<Method> methods;
    for (int order = 1; order <= 5; ++order)
        methods.push_back({"BDF" + std::to_string(order), order, colors[order - 1],
                           [order](const Problem& p, double accuracy) {
                               BdfIntegrator integrator(*p.system);
                               integrator.setMaximumOrder(order);
                               return run(integrator, p, accuracy);
                           }});
    methods.push_back({"generalized-alpha", 2, "#d55e00", [](const Problem& p, double accuracy) {
                           GeneralizedAlphaIntegrator integrator(*p.system);
                           return run(integrator, p, accuracy);
                       }});
    methods.push_back({"Radau", 5, "#882255", [](const Problem& p, double accuracy) {
                           RadauIntegrator integrator(*p.system);
                           return run(integrator, p, accuracy);
                       }});
    if (!problem.runsNatively) return methods;
    methods.push_back({"Simbody RKM", 0, "#cc79a7", [](const Problem& p, double accuracy) {
                           RungeKuttaMersonIntegrator integrator(*p.system);
                           return run(integrator, p, accuracy);
                       }});
    methods.push_back({"Simbody CPodes", 0, "#a8a8a8", [](const Problem& p, double accuracy) {
                           CPodesIntegrator integrator(*p.system);
                           return run(integrator, p, accuracy);
                       }});
    return methods;
}

/** Slope of log error over log accuracy, by least squares. **/
double fitSlope(const std::vector<double>& x, const std::vector<double>& y) {
    double sx = 0, sy = 0, sxx = 0, sxy = 0;
    const double n = double(x.size());
    for (size_t i = 0; i < x.size(); ++i) {
        const double a = std::log10(x[i]), b = std::log10(std::max(y[i], 1e-300));
        sx += a, sy += b, sxx += a * a, sxy += a * b;
    }
    return (n * sxy - sx * sy) / (n * sxx - sx * sx);
}

void study(const Problem& problem, const std::string& folder, std::string& json) {
    const std::vector<Method> methods = listMethods(problem);
    // Two independent references: their difference says how far down errors mean something.
    const double tightest = std::max(1e-10, 1e-13 / problem.size);
    const Solution reference = methods[4].run(problem, tightest);
    const double floor = calcError(methods[3].run(problem, tightest), reference) / problem.size;
    std::printf("\n%s: %g s, in parts of %g m, references of orders 4 and 5 differ by %.1e\n",
                problem.name.c_str(), problem.duration, problem.size, floor);
    std::printf("%-18s %9s %12s %10s %10s\n", "method", "accuracy", "error", "time [ms]", "steps");

    std::string title = problem.name;  // gnuplot would lower what follows an underscore
    std::replace(title.begin(), title.end(), '_', ' ');
    Plot plot{title, "global error, as a part of the motion", {}, {}, true};
    plot.panels.push_back({"", "wall time [ms]", {}, "", true});
    std::vector<std::vector<double>> rows;
    json += (json.size() > 1 ? ", " : "") + ("\"" + problem.name + "\": {");
    for (size_t m = 0; m < methods.size(); ++m) {
        std::vector<double> errors, times;
        bool isMonotonic = true;
        for (double accuracy : accuracies) {
            const Solution solution = methods[m].run(problem, accuracy);
            const double error = calcError(solution, reference) / problem.size;
            if (!errors.empty() && error > errors.back() && error > 3 * floor) isMonotonic = false;
            errors.push_back(error);
            times.push_back(1e3 * solution.seconds);
            std::printf("%-18s %9.0e %12.3e %10.2f %10ld\n", methods[m].name.c_str(), accuracy,
                        error, 1e3 * solution.seconds, solution.steps);
            std::fflush(stdout);
            rows.push_back(
                {double(m), accuracy, error, 1e3 * solution.seconds, double(solution.steps)});
        }
        plot.panels[0].series.push_back({methods[m].name, errors, times, methods[m].color});
        plot.panels[0].series.back().hasPoints = true;
        std::vector<double> x, y;  // above the references' own error
        for (size_t k = 0; k < errors.size(); ++k)
            if (errors[k] > 3 * floor) x.push_back(accuracies[k]), y.push_back(errors[k]);
        const double slope = x.size() > 1 ? fitSlope(x, y) : 0;
        const int order = methods[m].order;
        char text[160];
        std::snprintf(text, sizeof text, "%s\"%s\": {\"slope\": %.2f, \"monotonic\": %s}",
                      m ? ", " : "", methods[m].name.c_str(), slope,
                      isMonotonic ? "true" : "false");
        json += text;
        std::printf("%-18s slope %.2f", "", slope);
        if (order > 0) std::printf(" (at least %.2f is promised)", double(order) / (order + 1));
        std::printf(", %s\n", isMonotonic ? "monotonic" : "NOT monotonic");
    }
    json += "}";

    std::filesystem::create_directories(folder);
    std::ofstream csv(folder + "/" + problem.name + ".csv");
    csv << "method,accuracy,error,time_ms,steps\n";
    for (const std::vector<double>& row : rows) {
        csv << methods[size_t(row[0])].name;
        for (size_t k = 1; k < row.size(); ++k) csv << ',' << row[k];
        csv << '\n';
    }
    if (examples::writePlot(plot, folder + "/" + problem.name + ".png"))
        std::printf("%s\n", (folder + "/" + problem.name + ".png").c_str());
}

}  // namespace
}  // namespace simflex

int main(int argc, char** argv) {
    using namespace simflex;
    const std::map<std::string, Problem (*)()> problems = {{"slider_crank", makeSliderCrank},
                                                           {"spinning_body", makeSpinningBody},
                                                           {"soft_pendulum", makeSoftPendulum},
                                                           {"stator", makeStator},
                                                           {"stiff_pendulum", makeStiffPendulum}};
    std::string folder = SIMFLEX_OUTPUT "/precision", json = "{";
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
    for (const std::string& name : names) study(problems.at(name)(), folder, json);
    std::printf("\n%s}\n", json.c_str());
    return 0;
}
