// Cost of a row of results relative to a step, on the slider-crank of examples/ and the stator:
// with BDF, whose steps are the cheapest, and with Radau, the default of model files. The last line
// is a JSON object with the ratio of row to step, with and without the search for largest
// displacements.
//
//   bench_output [--repetitions N]     default: 5, of which the fastest counts

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <functional>

#include "simflex/base/SecondsSince.h"
#include "simflex/part/ReducedBodyFile.h"
#include "simflex/solver/BdfIntegrator.h"
#include "simflex/solver/RadauIntegrator.h"
#include "support/SliderCrankModel.h"
#include "support/StatorModel.h"

namespace simflex {
namespace {

using namespace SimTK;
using Clock = std::chrono::steady_clock;
using examples::SliderCrankModel;
using examples::StatorModel;

std::shared_ptr<const ReducedBody> readPart(const std::string& name) {
    return std::make_shared<const ReducedBody>(
        readReducedBody(std::string(SIMFLEX_PARTS) + "/" + name + ".h5"));
}

/** One part of a row. **/
struct Column {
    const char* name;
    std::function<double(const ImplicitIntegrator&, const State&)> calc;
};

struct Problem {
    const char* name;
    const MultibodySystem* system;
    State start;
    double duration;
    int rows;
    std::vector<Column> columns;
};

/** Seconds of the whole integration and of the rows: points shown between steps, States, and each
column. **/
struct Seconds {
    double integration = 0, shown = 0;
    std::vector<double> columns;
    long steps = 0;
    double sum = 0;  // keeps the compiler from removing calls

    /** The last column searches for the largest displacements. **/
    double calcRow(int rows, size_t numColumns) const {
        double seconds = shown;
        for (size_t k = 0; k < numColumns; ++k) seconds += columns[k];
        return seconds / rows;
    }
};

template <class Integrator>
double run(const Problem& problem, int rows, Seconds& seconds) {
    Integrator integrator(*problem.system);
    integrator.setNumThreads(1);
    integrator.initialize(problem.start);
    double stepping = 0;
    seconds.columns.assign(problem.columns.size(), 0);
    for (int row = 1; row <= rows; ++row) {
        const auto start = Clock::now();
        integrator.stepTo(problem.duration * row / rows);
        stepping += secondsSince(start);
        const auto shown = Clock::now();
        const State& state = integrator.getState();
        seconds.shown += secondsSince(shown);
        for (size_t k = 0; k < problem.columns.size(); ++k) {
            const auto begun = Clock::now();
            seconds.sum += problem.columns[k].calc(integrator, state);
            seconds.columns[k] += secondsSince(begun);
        }
    }
    seconds.steps = integrator.getStatistics().stepsTaken;
    return stepping;
}

template <class Integrator>
Seconds measure(const Problem& problem) {
    Seconds bare, seconds;
    bare.integration = run<Integrator>(problem, 1, bare);
    const double stepping = run<Integrator>(problem, problem.rows, seconds);
    seconds.integration = bare.integration;
    seconds.steps = bare.steps;
    seconds.shown += stepping - bare.integration;  // points between steps
    return seconds;
}

/** Ratio of row time to step time. **/
struct Ratio {
    double whole, withoutLargest;
};

template <class Integrator>
Ratio reportOf(const char* method, const Problem& problem, int repetitions) {
    Seconds best = measure<Integrator>(problem);
    for (int k = 1; k < repetitions; ++k) {
        const Seconds next = measure<Integrator>(problem);
        if (next.integration < best.integration) {
            best.integration = next.integration;
        }
        best.shown = std::min(best.shown, next.shown);
        for (size_t c = 0; c < best.columns.size(); ++c)
            best.columns[c] = std::min(best.columns[c], next.columns[c]);
    }
    const size_t all = best.columns.size();
    const double step = best.integration / double(best.steps);
    const double row = best.calcRow(problem.rows, all);
    std::printf("%s, %s: %ld steps of %.1f us, %d rows of %.1f us\n", problem.name, method,
                best.steps, 1e6 * step, problem.rows, 1e6 * row);
    std::printf("  %-24s %8.2f us\n", "the State between steps", 1e6 * best.shown / problem.rows);
    for (size_t c = 0; c < best.columns.size(); ++c)
        std::printf("  %-24s %8.2f us\n", problem.columns[c].name,
                    1e6 * best.columns[c] / problem.rows);
    return {row / step, best.calcRow(problem.rows, all - 1) / step};
}

struct Ratios {
    Ratio bdf, radau;
};

Ratios report(const Problem& problem, int repetitions) {
    return {reportOf<BdfIntegrator>("BDF", problem, repetitions),
            reportOf<RadauIntegrator>("Radau", problem, repetitions)};
}

double sum(const Vec3& v) {
    return v[0] + v[1] + v[2];
}

Ratios reportSliderCrank(int repetitions) {
    SliderCrankModel model({}, readPart("crank"), readPart("rod"));
    const FlexibleBodySubsystem& flexible = model.flexible;
    std::vector<Column> columns{
        {"positions",
         [&](const ImplicitIntegrator&, const State& s) {
             return model.calcCrankAngle(s, 0) + model.calcSliderPosition(s) +
                    model.calcRodDeflection(s) + model.calcCrankDeflection(s);
         }},
        {"velocities",
         [&](const ImplicitIntegrator&, const State& s) {
             return model.slider.getOneU(s, 0) + sum(model.rod.getFrameVelocity(s)[1]);
         }},
        {"three reactions",
         [&](const ImplicitIntegrator& integrator, const State& s) {
             double all = 0;
             for (const Joint* joint :
                  {(const Joint*)&model.mainBearing, (const Joint*)&model.crankPin,
                   (const Joint*)&model.gudgeonPin})
                 all += sum(joint->calcForceOnM(s, integrator.getMultipliers(*joint))[1]);
             return all;
         }},
        {"strain energies",
         [&](const ImplicitIntegrator&, const State& s) {
             return model.crank.calcStrainEnergy(s) + model.rod.calcStrainEnergy(s);
         }},
        {"kinetic energy",
         [&](const ImplicitIntegrator&, const State& s) { return flexible.calcKineticEnergy(s); }},
        {"potential energy", [&](const ImplicitIntegrator&,
                                 const State& s) { return flexible.calcPotentialEnergy(s); }},
        {"largest displacements", [&](const ImplicitIntegrator&, const State& s) {
             return model.crank.calcLargestDisplacement(s) + model.rod.calcLargestDisplacement(s);
         }}};
    return report({"slider_crank", &model.system, model.makeInitialState(), 0.2, 960, columns},
                  repetitions);
}

Ratios reportStator(int repetitions) {
    std::vector<std::shared_ptr<const ReducedBody>> parts;
    for (const char* name : StatorModel::getPartNames()) parts.push_back(readPart(name));
    examples::StatorOptions options;
    options.runUp = 0.05;
    options.speed = 200;
    StatorModel model(options, parts);
    const FlexibleBodySubsystem& flexible = model.flexible;
    std::vector<Column> columns{
        {"positions",
         [&](const ImplicitIntegrator&, const State& s) {
             return sum(model.calcBearingDisplacement(s, StatorModel::FrontBearing)) +
                    sum(model.calcBearingDisplacement(s, StatorModel::RearBearing));
         }},
        {"three reactions",
         [&](const ImplicitIntegrator& integrator, const State& s) {
             double all = 0;
             for (const Joint* joint :
                  {(const Joint*)&model.leftHinge, (const Joint*)&model.rightHinge,
                   (const Joint*)&model.rearHinge})
                 all += sum(joint->calcForceOnM(s, integrator.getMultipliers(*joint))[1]);
             return all;
         }},
        {"strain energies",
         [&](const ImplicitIntegrator&, const State& s) {
             double all = 0;
             for (const FlexibleBody& body : model.getBodies()) all += body.calcStrainEnergy(s);
             return all;
         }},
        {"kinetic energy",
         [&](const ImplicitIntegrator&, const State& s) { return flexible.calcKineticEnergy(s); }},
        {"potential energy", [&](const ImplicitIntegrator&,
                                 const State& s) { return flexible.calcPotentialEnergy(s); }},
        {"largest displacements", [&](const ImplicitIntegrator&, const State& s) {
             double all = 0;
             for (const FlexibleBody& body : model.getBodies())
                 all += body.calcLargestDisplacement(s);
             return all;
         }}};
    return report({"stator", &model.system, model.makeInitialState(), 0.05, 400, columns},
                  repetitions);
}

}  // namespace
}  // namespace simflex

int main(int argc, char** argv) {
    int repetitions = 5;
    CLI::App app("What a row of results costs beside a step.");
    app.add_option("--repetitions", repetitions, "of which the fastest counts")
        ->check(CLI::Range(1, 1000))
        ->capture_default_str();
    CLI11_PARSE(app, argc, argv);
    const simflex::Ratios crank = simflex::reportSliderCrank(repetitions);
    const simflex::Ratios stator = simflex::reportStator(repetitions);
    std::printf(
        "{\"row_over_step\": %.3f, \"row_over_step_stator\": %.3f, "
        "\"without_largest\": %.3f, \"without_largest_stator\": %.3f, "
        "\"row_over_radau_step\": %.3f, \"row_over_radau_step_stator\": %.3f, "
        "\"radau_without_largest\": %.3f, \"radau_without_largest_stator\": %.3f}\n",
        crank.bdf.whole, stator.bdf.whole, crank.bdf.withoutLargest, stator.bdf.withoutLargest,
        crank.radau.whole, stator.radau.whole, crank.radau.withoutLargest,
        stator.radau.withoutLargest);
}
