// Plots of simflex's results over known solutions, for the problems of tests/validation.
//
// Solutions are closed forms, published figures and CalculiX's own results on the whole mesh. The
// models themselves: tests/validation. Writes a picture (lines: simflex, circles: the solution) and
// a table (CSV) for every problem, and prints both values.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>

#include "simflex/solver/BdfIntegrator.h"
#include "simflex/solver/Eigenmodes.h"
#include "support/DoublePendulum.h"
#include "support/Plot.h"
#include "validation/Cantilever.h"
#include "validation/FreeDecay.h"
#include "validation/HangingPendulum.h"
#include "validation/HeavyTop.h"
#include "validation/RotatingCantilever.h"
#include "validation/SimplySupportedBeam.h"
#include "validation/SpinUpBeam.h"
#include "validation/TurningRod.h"
#include "validation/WeldedParts.h"

using namespace SimTK;
using namespace simflex;
using namespace simflex::examples;
using namespace simflex::test;
using simflex::testing::Brick;

namespace {

using Values = std::vector<double>;

struct Arguments {
    std::vector<std::string> problems;
    std::string parts, out = "build/output/validation";
    bool isQuick = false;
};

Plot::Series makeLine(const std::string& label, const Values& x, const Values& y, int color) {
    return {label, x, y, color};
}

/** Circles at the known solution. **/
Plot::Series makeAnswer(const std::string& label, const Values& x, const Values& y) {
    Plot::Series series{label, x, y, Plot::Slate};
    series.hasLine = false;
    return series;
}

/** A thin dashed line. **/
Plot::Series makeGuide(const std::string& label, const Values& x, const Values& y) {
    return {label, x, y, Plot::Gray};
}

Plot::Series makeDots(const std::string& label, const Values& x, const Values& y, int color) {
    Plot::Series series{label, x, y, color};
    series.hasPoints = true;
    return series;
}

void write(const Arguments& arguments, const Plot& plot, const std::string& name) {
    writePlotValues(plot, arguments.out + "/" + name + ".csv");
    writePlot(plot, arguments.out + "/" + name + ".png");
}

void print(const std::string& what, double found, double answer, const char* unit) {
    std::printf("  %-52s %12.5g %-6s (%.5g)\n", what.c_str(), found, unit, answer);
}

Values makeRange(double first, double last, int count) {
    Values values;
    for (int k = 0; k < count; ++k) values.push_back(first + (last - first) * k / (count - 1));
    return values;
}

template <class Function>
Values map(const Values& x, const Function& function) {
    Values y;
    for (const double value : x) y.push_back(function(value));
    return y;
}

//------------------------------------------------------------------------------------------------

struct Lag {
    Values time, lag, extension;  ///< [s, m, m]
};

Lag runSpinUp(bool isStiffened, double end) {
    SpinUpBeam model;
    State state = model.makeState();
    if (!isStiffened) model.beam.disableStiffening(state);
    BdfIntegrator integrator(model.system);
    integrator.setAccuracy(1e-6);
    integrator.initialize(state);
    Lag result;
    for (int k = 0; 0.02 * k <= end; ++k) {
        if (k > 0) integrator.stepTo(0.02 * k);
        const Vec2 tip = model.calcTip(integrator.getState());
        result.time.push_back(0.02 * k);
        result.extension.push_back(tip[0]);
        result.lag.push_back(tip[1]);
    }
    return result;
}

void drawSpinUp(const Arguments& arguments) {
    const double end = arguments.isQuick ? 8 : 20;
    const Lag on = runSpinUp(true, end), off = runSpinUp(false, end);
    Plot plot{
        "Spin-up of a beam (Simo, Vu-Quoc): 10 m, from rest to 6 rad/s in 15 s", "time [s]", {}};
    Plot::Panel lag{"tip's lag behind a rigid beam", "[m]", {}};
    lag.series = {makeLine("stiffened by tension", on.time, on.lag, Plot::Blue),
                  makeLine("not stiffened", off.time, off.lag, Plot::Orange),
                  makeAnswer("published peak", {SpinUpBeam::PeakTime}, {SpinUpBeam::PeakLag})};
    plot.panels = {lag};
    write(arguments, plot, "spin_up");
    print("tip's largest lag", *std::min_element(on.lag.begin(), on.lag.end()), SpinUpBeam::PeakLag,
          "m");
    if (arguments.isQuick) return;

    Values time, swing, extension;
    for (size_t k = 0; k < on.time.size(); ++k) {
        if (on.time[k] < SpinUpBeam::RampTime) continue;
        time.push_back(on.time[k]);
        swing.push_back(1e3 * on.lag[k]);
        extension.push_back(1e6 * on.extension[k]);
    }
    const auto hold = [](double value) { return Values(2, value); };
    const Values ends{time.front(), time.back()};
    Plot after{"Spin-up of a beam: once it turns steadily", "time [s]", {}};
    after.panels = {{"tip's swing about the radius",
                     "[mm]",
                     {makeLine("simflex", time, swing, Plot::Blue),
                      makeGuide("published amplitude", ends, hold(1e3 * SpinUpBeam::Swing)),
                      makeGuide("", ends, hold(-1e3 * SpinUpBeam::Swing))}},
                    {"extension",
                     "[µm]",
                     {makeLine("simflex", time, extension, Plot::Blue),
                      makeGuide("published, steady", ends, hold(1e6 * SpinUpBeam::Extension))}}};
    write(arguments, after, "spin_up_steady");
    const auto [low, high] = std::minmax_element(swing.begin(), swing.end());
    print("amplitude afterwards", (*high - *low) / 2, 1e3 * SpinUpBeam::Swing, "mm");
    double mean = 0;
    for (const double value : extension) mean += value / double(extension.size());
    print("mean extension afterwards", mean, 1e6 * SpinUpBeam::Extension, "µm");
}

//------------------------------------------------------------------------------------------------

void drawRotatingCantilever(const Arguments& arguments) {
    const BeamOptions options = getRotatingCantileverOptions();
    const double flapUnit = calcFrequencyUnit(options.width),
                 lagUnit = calcFrequencyUnit(options.height);
    const Values etas = makeRange(0, 12, arguments.isQuick ? 3 : 25);
    Plot plot{"Rotating cantilever, frequencies over speed (Wright, Smith, Thresher, Wang)",
              "speed  η = Ω (mL^4/EI)^{1/2}  [1]",
              {}};
    double largest = 0;
    for (const size_t k : {size_t(1), size_t(0)}) {
        const auto flap = [&](double eta) {
            return calcRotatingModes(getRotatingCantileverPart(), eta * flapUnit).flap.at(k) /
                   flapUnit;
        };
        const auto lag = [&](double eta) {
            return calcRotatingModes(getRotatingCantileverPart(), eta * lagUnit).lag.at(k) /
                   lagUnit;
        };
        Values eta, table, turned;
        for (const WrightRow& row : kWrightTable) {
            eta.push_back(row.eta);
            table.push_back(row.lambda[k]);
            turned.push_back(std::sqrt(square(row.lambda[k]) - square(row.eta)));
            largest = std::max({largest, std::abs(flap(row.eta) / table.back() - 1),
                                std::abs(lag(row.eta) / turned.back() - 1)});
        }
        plot.panels.push_back({k == 0 ? "first modes" : "second modes",
                               "λ = ω (mL^4/EI)^{1/2}  [1]",
                               {makeLine("flap", etas, map(etas, flap), Plot::Blue),
                                makeLine("lag", etas, map(etas, lag), Plot::Orange),
                                makeAnswer("table; lag: (λ^2 − η^2)^{1/2}", eta, table),
                                makeAnswer("", eta, turned)}});
    }
    write(arguments, plot, "rotating_cantilever");
    print("largest deviation from the table", 100 * largest, 0, "%");
}

void drawCentrifugalRod(const Arguments& arguments) {
    const Values speeds = makeRange(100, 3000, arguments.isQuick ? 4 : 30);
    const auto toMilli = [](double metres) { return 1e3 * metres; };
    TurningRod rod;
    const Values found = map(speeds, [&](double speed) {
        rod.turn(speed);
        return toMilli(rod.calcStretch());
    });
    const auto exact = [&](double speed) { return toMilli(rod.calcExactStretch(speed)); };
    const auto brick = rod.getBrick();
    const auto linear = [&](double speed) {
        return toMilli(brick.rho * square(speed) * std::pow(brick.size[0], 3) / (3 * brick.E));
    };
    Values difference, softening;
    for (size_t k = 0; k < speeds.size(); ++k) {
        difference.push_back(100 * (found[k] / exact(speeds[k]) - 1));
        softening.push_back(100 * (linear(speeds[k]) / exact(speeds[k]) - 1));
    }
    Plot plot{"Steel rod of 0.5 m that turns about its end", "speed [rad/s]", {}};
    plot.panels = {{"stretch",
                    "[mm]",
                    {makeLine("simflex", speeds, found, Plot::Blue),
                     makeGuide("ρω^2L^3/3E", speeds, map(speeds, linear)),
                     makeAnswer("tan(kL)/k − L", speeds, map(speeds, exact))}},
                   {"difference from tan(kL)/k − L, k^2 = ρω^2/E",
                    "[%]",
                    {makeLine("simflex", speeds, difference, Plot::Blue),
                     makeGuide("ρω^2L^3/3E", speeds, softening)}}};
    write(arguments, plot, "centrifugal_rod");
    print("stretch at 3000 rad/s", found.back(), exact(3000), "mm");
}

//------------------------------------------------------------------------------------------------

/** Nodes of an edge along x. **/
std::vector<int> findEdge(const ReducedBody& part, const Brick& brick) {
    std::vector<int> nodes;
    for (int k = 0; k < part.mesh.numNodes(); ++k) {
        const auto s = part.mesh.position(k);
        if (s[1] < -0.499 * brick.size[1] && s[2] < -0.499 * brick.size[2])
            nodes.push_back(part.mesh.nodeNumbers[size_t(k)]);
    }
    return nodes;
}

void drawSag(const Arguments& arguments) {
    const Brick brick;
    const simflex::testing::TestFolder folder;
    simflex::testing::writeText(folder / "brick.inp", brick.text());
    const auto calculix = simflex::testing::calcCalculixDisplacements(
        folder, folder / "brick.inp", {"LEFT", {0, 0, 0}}, {"RIGHT", {brick.size[0], 0, 0}}, "LINE",
        "*DLOAD\nBODY, GRAV, 9.81, 0, -0.8, 0.6\n");
    const auto part = reduceBrick(brick, 50);
    Cantilever model(part, 9.81 * Vec3(0, -0.8, 0.6));
    const State undeformed = model.makeState();
    StaticEquilibrium equilibrium(model.system);
    equilibrium.setTolerance(1e-14);
    equilibrium.solve(undeformed);
    model.system.realize(undeformed, Stage::Position);

    Values x, found[2], answer[2], difference[2];
    const double tip = std::abs(calculix.rbegin()->second[1]);
    for (const int node : findEdge(*part, brick)) {
        const Vec3 place = model.beam.calcNodeLocation(undeformed, node),
                   shift = model.beam.calcNodeLocation(equilibrium.getState(), node) - place;
        x.push_back(1e3 * place[0]);
        for (int a = 0; a < 2; ++a) {
            const double own = calculix.at(node)[size_t(1 + a)];
            found[a].push_back(1e6 * shift[1 + a]);
            answer[a].push_back(1e6 * own);
            difference[a].push_back(1e6 * (shift[1 + a] - own) / tip);
        }
    }
    Plot plot{"Aluminium brick, 200 × 30 × 20 mm, clamped by its end: sag under its weight",
              "along the brick [mm]",
              {}};
    plot.panels = {
        {"displacement of an edge",
         "[µm]",
         {makeLine("upright", x, found[0], Plot::Blue),
          makeLine("sideways", x, found[1], Plot::Orange),
          makeAnswer("CalculiX, whole mesh", x, answer[0]), makeAnswer("", x, answer[1])}},
        {"difference, of the upright sag at the end",
         "[ppm]",
         {makeDots("upright", x, difference[0], Plot::Blue),
          makeDots("sideways", x, difference[1], Plot::Orange)}}};
    write(arguments, plot, "sag");
    print("sag at the end, upright", found[0].back(), answer[0].back(), "µm");
    print("sag at the end, sideways", found[1].back(), answer[1].back(), "µm");
}

void drawWeldedParts(const Arguments& arguments) {
    const size_t count = 8;
    const std::vector<double> answer = WeldedParts(40).calcCalculixFrequencies(int(count) + 2);
    const Values numbers = makeRange(1, double(count), int(count));
    Plot plot{"Two bricks welded into an L, clamped by one end: natural frequencies", "mode", {}};
    Plot::Panel frequencies{"frequency", "[Hz]", {}}, errors{"difference from CalculiX", "[%]", {}};
    const int colors[] = {Plot::Orange, Plot::Green, Plot::Blue};
    const int modes[] = {20, 30, 40};
    for (int i = 0; i < 3; ++i) {
        WeldedParts model(modes[i]);
        const std::vector<Eigenmode> found =
            calcEigenmodes(calcLinearization(model.system, model.makeState()));
        Values hertz, percent;
        for (size_t k = 0; k < count; ++k) {
            hertz.push_back(found[k].frequency);
            percent.push_back(100 * (found[k].frequency / answer[k] - 1));
        }
        const std::string label = std::to_string(modes[i]) + " Craig–Bampton modes a part";
        if (i == 2) frequencies.series.push_back(makeDots(label, numbers, hertz, colors[i]));
        errors.series.push_back(
            makeDots(std::to_string(modes[i]) + " modes", numbers, percent, colors[i]));
        print("eighth frequency, " + std::to_string(modes[i]) + " modes", hertz.back(),
              answer[count - 1], "Hz");
    }
    frequencies.series.push_back(makeAnswer("CalculiX, both in one mesh", numbers,
                                            Values(answer.begin(), answer.begin() + count)));
    plot.panels = {frequencies, errors};
    write(arguments, plot, "welded_parts");
}

void drawReactions(const Arguments& arguments) {
    const Brick brick;
    const auto part = reduceBrick(brick, 30);
    const double P = 10, L = brick.size[0];
    Values x, left, right, leftAnswer, rightAnswer;
    for (const int node : findEdge(*part, brick)) {
        SimplySupportedBeam model(part, Vec3(0), node, SpatialVec(Vec3(0), Vec3(0, -P, 0)));
        model.solve();
        const double a = model.calcUndeformedNode(node)[0];
        x.push_back(1e3 * a);
        left.push_back(model.calcReaction(model.pin)[1][1]);
        right.push_back(model.calcReaction(model.roller)[1][1]);
        leftAnswer.push_back(P * (1 - a / L));
        rightAnswer.push_back(P * a / L);
    }
    Plot plot{
        "Beam on a pin and a roller: reactions to a load of 10 N", "place of the load [mm]", {}};
    plot.panels = {
        {"upward force of the support",
         "[N]",
         {makeLine("pin", x, left, Plot::Blue), makeLine("roller", x, right, Plot::Orange),
          makeAnswer("lever rule", x, leftAnswer), makeAnswer("", x, rightAnswer)}}};
    write(arguments, plot, "reactions");
    const size_t middle = x.size() / 3;
    print("pin's force, load at " + std::to_string(int(x[middle])) + " mm", left[middle],
          leftAnswer[middle], "N");
}

//------------------------------------------------------------------------------------------------

void drawHangingPendulum(const Arguments& arguments) {
    const ReducedBody soft = *reduceBrick({}, 30);
    const auto makePart = [&](double stiffening) {
        return std::make_shared<const ReducedBody>(soft.withScaledStiffness(stiffening));
    };
    {
        const double amplitude = 0.01;
        HangingPendulum model(makePart(1e-3));
        BdfIntegrator integrator(model.system);
        integrator.setAccuracy(1e-10);
        integrator.initialize(model.makeState(amplitude));
        const double omega = model.calcRigidFrequency();
        Values time, found, difference, answerTime, answer;
        const double end = arguments.isQuick ? 1 : 4;
        for (int k = 0; 0.02 * k <= end; ++k) {
            if (k > 0) integrator.stepTo(0.02 * k);
            const Vec3 center = model.body.getFramePose(integrator.getState()).p();
            time.push_back(0.02 * k);
            found.push_back(1e3 * std::atan2(center[0], -center[1]));
            const double rigid = 1e3 * amplitude * std::cos(omega * 0.02 * k);
            difference.push_back(found.back() - rigid);
            if (k % 4 > 0) continue;
            answerTime.push_back(0.02 * k);
            answer.push_back(rigid);
        }
        Plot plot{
            "Brick of 0.2 m that hangs on a pin at its end, a thousand times softer than aluminium",
            "time [s]",
            {}};
        plot.panels = {{"angle of its centre of mass",
                        "[mrad]",
                        {makeLine("simflex", time, found, Plot::Blue),
                         makeAnswer("rigid: cos((mgd/I)^{1/2} t)", answerTime, answer)}},
                       {"difference", "[mrad]", {makeLine("", time, difference, Plot::Blue)}}};
        write(arguments, plot, "hanging_pendulum");
    }
    Values stiffness, slower, bound;
    for (double factor = 1e-3; factor < 2e2; factor *= 10) {
        HangingPendulum model(makePart(factor));
        StaticEquilibrium equilibrium(model.system);
        equilibrium.solve(model.makeState(0.1));
        const double omega = model.calcRigidFrequency(),
                     found =
                         2 * Pi *
                         calcEigenmodes(calcLinearization(model.system, equilibrium.getState()))[0]
                             .frequency;
        stiffness.push_back(factor);
        slower.push_back(1 - found / omega);
        bound.push_back(square(omega) / model.body.getPart().omegaSquared[0]);
        if (factor == 1e-3) print("small swings of the soft brick", found, omega, "rad/s");
    }
    Plot plot{"Hanging brick: how much slower it swings than a rigid one",
              "stiffness, of aluminium's",
              {}};
    plot.hasLogarithmicX = true;
    plot.panels = {{"1 − ω/ω_{rigid}",
                    "[1]",
                    {makeDots("simflex", stiffness, slower, Plot::Blue),
                     makeGuide("its order, (ω_{rigid}/Ω_{bending})^2", stiffness, bound)}}};
    plot.panels[0].isLogarithmic = true;
    write(arguments, plot, "hanging_pendulum_stiffness");
}

void drawFreeDecay(const Arguments& arguments) {
    Plot plot{"Clamped beam pulled aside by its tip and let go, damping in proportion to stiffness",
              "time [s]",
              {}};
    for (const double ratio : {0.005, 0.02, 0.05}) {
        const auto history = FreeDecay(ratio).run(arguments.isQuick ? 6 : 12, 3e-10);
        // Part of the lowest mode in the initial shape: 12/(βL)⁴.
        const double first = 12 / std::pow(1.8751, 4) * FreeDecay::Deflection;
        const auto toMicro = [](double metres) { return 1e6 * metres; };
        const auto envelope = [&](double sign) {
            return map(history.time, [&](double t) {
                return toMicro(sign * first * std::exp(-ratio * FreeDecay::calcFrequency() * t));
            });
        };
        char title[80];
        std::snprintf(title, sizeof title, "tip, ζ = %g %% of critical", 100 * ratio);
        plot.panels.push_back(
            {title,
             "[µm]",
             {makeLine("simflex", history.time, map(history.tip, toMicro), Plot::Blue),
              makeGuide("e^{−ζωt}, ω of Euler and Bernoulli", history.time, envelope(1)),
              makeGuide("", history.time, envelope(-1))}});
        print("ratio recovered from peaks", 100 * recoverDampingRatio(history), 100 * ratio, "%");
    }
    write(arguments, plot, "free_decay");
}

//------------------------------------------------------------------------------------------------

template <class Look>
void runTop(HeavyTop& top, const State& state, double accuracy, double end, double interval,
            const Look& look) {
    BdfIntegrator integrator(top.system);
    integrator.setAccuracy(accuracy);
    // At 300 rad/s the residuals of Newton's iteration add up: tighter than the default.
    ImplicitIntegrator::NewtonTolerances tolerances;
    tolerances.displacement = 3e-5;
    integrator.setNewtonTolerances(tolerances);
    integrator.initialize(state);
    for (int k = 0; interval * k <= end; ++k) {
        if (k > 0) integrator.stepTo(interval * k);
        look(integrator.getState());
    }
}

void drawTopPath(const Arguments& arguments, double period) {
    const auto circle = [](double tilt) {
        Values x, z;
        for (const double angle : makeRange(0, 2 * Pi, 181)) {
            x.push_back(1e3 * HeavyTop::Length * std::sin(tilt) * std::cos(angle));
            z.push_back(1e3 * HeavyTop::Length * std::sin(tilt) * std::sin(angle));
        }
        return std::array<Values, 2>{x, z};
    };
    const auto upper = circle(HeavyTop::Tilt), lower = circle(HeavyTop::calcLowestTilt());
    Plot plot{"Heavy top on a flexible stem, let go at rest: path of the disc from above",
              "[mm]",
              {{"one turn of precession", "[mm]", {}}}};
    plot.hasEqualScales = true;
    for (const double stiffening : {1.0, 100.0}) {
        HeavyTop top(stiffening);
        Values x, z;
        runTop(top, top.makeReleasedState(), 1e-6, arguments.isQuick ? 0.3 : period, 0.005,
               [&](const State& state) {
                   const Vec3 p = top.calcDisc(state);
                   x.push_back(1e3 * p[0]);
                   z.push_back(-1e3 * p[2]);
               });
        plot.panels[0].series.push_back(stiffening == 1
                                            ? makeLine("flexible", x, z, Plot::Orange)
                                            : makeLine("100 times stiffer", x, z, Plot::Blue));
    }
    plot.panels[0].series.push_back(makeGuide("limits of the rigid top", upper[0], upper[1]));
    plot.panels[0].series.push_back(makeGuide("", lower[0], lower[1]));
    write(arguments, plot, "heavy_top_path");
}

void drawTopConservation(const Arguments& arguments, double period) {
    Plot plot{"Heavy top on a flexible stem: what should stay", "time [s]", {}};
    Plot::Panel energy{"energy, change of mgd", "[1]", {}},
        momentum{"angular momentum about the vertical, change of itself", "[1]", {}};
    energy.isLogarithmic = momentum.isLogarithmic = true;
    const int colors[] = {Plot::Orange, Plot::Green, Plot::Blue};
    for (int i = 0; i < 3; ++i) {
        const double accuracy = std::pow(10, -5 - i);
        HeavyTop top(1);
        Values time, e, m;
        Real energyAtFirst = 0, momentumAtFirst = 0;
        runTop(top, top.makeReleasedState(), accuracy,
               arguments.isQuick ? 0.1 : (i == 2 ? 1 : 3) * period, 0.01, [&](const State& state) {
                   top.system.realize(state, Stage::Dynamics);
                   const Real E = top.flexible.calcEnergy(state),
                              H = top.flexible.calcMomentum(state)[0][1];
                   if (state.getTime() == 0) {
                       energyAtFirst = E;
                       momentumAtFirst = H;
                       return;
                   }
                   time.push_back(state.getTime());
                   e.push_back(std::abs(E - energyAtFirst) / top.calcWeightMoment());
                   m.push_back(std::abs(H / momentumAtFirst - 1));
               });
        char label[40];
        std::snprintf(label, sizeof label, "accuracy 10^{%d} m", -5 - i);
        energy.series.push_back(makeLine(label, time, e, colors[i]));
        momentum.series.push_back(makeLine(label, time, m, colors[i]));
        std::snprintf(label, sizeof label, "%.0e m", accuracy);
        print(std::string("largest change of energy, accuracy ") + label,
              *std::max_element(e.begin(), e.end()), 0, "mgd");
    }
    plot.panels = {energy, momentum};
    write(arguments, plot, "heavy_top_conservation");
}

void drawTopPrecession(const Arguments& arguments) {
    Values stiffness, difference, guide;
    const double end = arguments.isQuick ? 0.1 : 0.5;
    for (double factor = 3; factor < (arguments.isQuick ? 20 : 2000); factor *= std::sqrt(10)) {
        HeavyTop top(factor);
        double largest = 0;
        runTop(top, top.makeSteadyState(), 1e-8, end, 0.01, [&](const State& state) {
            largest = std::max(
                largest, std::abs(top.calcAzimuth(state) - state.getTime() * top.calcPrecession()));
        });
        stiffness.push_back(factor);
        difference.push_back(largest / (end * HeavyTop::calcPrecession()));
        guide.push_back(difference.front() * stiffness.front() / factor);
    }
    Plot plot{"Heavy top in steady precession: how far it departs from Lagrange's top",
              "stiffness of the stem, of steel's",
              {}};
    plot.hasLogarithmicX = true;
    plot.panels = {{"largest difference of azimuth, of the angle turned in 0.5 s",
                    "[1]",
                    {makeDots("simflex", stiffness, difference, Plot::Blue),
                     makeGuide("1/stiffness", stiffness, guide)}}};
    plot.panels[0].isLogarithmic = true;
    write(arguments, plot, "heavy_top_precession");
    print("departure from Lagrange's top, stiffest stem", difference.back(), 0, "");
}

void drawHeavyTop(const Arguments& arguments) {
    const double period = 2 * Pi / HeavyTop::calcPrecession();
    drawTopPath(arguments, period);
    drawTopConservation(arguments, period);
    drawTopPrecession(arguments);
}

void drawDoublePendulum(const Arguments& arguments) {
    DoublePendulum model;
    const State state = model.makeState();
    const Vector byBdf = model.runBdf(state, 1e-11, 5),
                 natively = model.runNatively<RungeKuttaMersonIntegrator>(state, 1e-10);
    Values accuracies, merson, cpodes, bdf, guide;
    for (int k = 3; k <= (arguments.isQuick ? 5 : 9); ++k) {
        const double accuracy = std::pow(10, -k);
        accuracies.push_back(accuracy);
        merson.push_back(
            (model.runNatively<RungeKuttaMersonIntegrator>(state, accuracy) - byBdf).normInf());
        cpodes.push_back((model.runNatively<CPodesIntegrator>(state, accuracy) - byBdf).normInf());
        bdf.push_back((model.runBdf(state, accuracy, 2) - natively).normInf());
        guide.push_back(std::pow(accuracy, 2.0 / 3));
    }
    Plot plot{"Flexible double pendulum: Simbody's own integrators against block elimination",
              "accuracy asked for [m]",
              {}};
    plot.hasLogarithmicX = true;
    plot.panels = {{"largest difference",
                    "[m]",
                    {makeDots("Merson − BDF5", accuracies, merson, Plot::Blue),
                     makeDots("CPodes − BDF5", accuracies, cpodes, Plot::Green),
                     makeDots("BDF2 − Merson", accuracies, bdf, Plot::Orange),
                     makeGuide("accuracy^{2/3}", accuracies, guide)}}};
    plot.panels[0].isLogarithmic = true;
    write(arguments, plot, "double_pendulum");
    print("sharpest runs, difference", (byBdf - natively).normInf(), 0, "m");
}

//------------------------------------------------------------------------------------------------

struct Problem {
    const char* name;
    void (*draw)(const Arguments&);
};
constexpr Problem problems[] = {
    {"rotating_cantilever", drawRotatingCantilever},
    {"centrifugal_rod", drawCentrifugalRod},
    {"spin_up", drawSpinUp},
    {"sag", drawSag},
    {"welded_parts", drawWeldedParts},
    {"hanging_pendulum", drawHangingPendulum},
    {"double_pendulum", drawDoublePendulum},
    {"heavy_top", drawHeavyTop},
    {"free_decay", drawFreeDecay},
    {"reactions", drawReactions},
};

void run(const Arguments& arguments) {
    std::filesystem::create_directories(arguments.out);
    const auto& names = arguments.problems;
    std::printf("what simflex gives (and the answer)\n");
    for (const Problem& problem : problems) {
        if (!names.empty() && std::find(names.begin(), names.end(), problem.name) == names.end())
            continue;
        std::printf("%s\n", problem.name);
        std::fflush(stdout);
        problem.draw(arguments);
    }
    std::printf("pictures and tables in %s\n", arguments.out.c_str());
}

}  // namespace

int main(int argc, char** argv) {
    Arguments arguments;
    std::vector<std::string> names;
    for (const Problem& problem : problems) names.push_back(problem.name);
    CLI::App app("Problems with known answers, drawn over the answer.");
    app.option_defaults()->always_capture_default();
    app.add_option("problem", arguments.problems, "Problems to draw (default: all)")
        ->check(CLI::IsMember(names));
    app.add_flag("--quick", arguments.isQuick, "Take fewer values and shorter motions");
    app.add_option("--parts", arguments.parts, "Not needed: the parts are made here");
    app.add_option("-o,--output", arguments.out, "Folder to write")->take_last();
    CLI11_PARSE(app, argc, argv);
    try {
        run(arguments);
        return 0;
    } catch (const std::exception& error) {
        std::fprintf(stderr, "validation: %s\n", error.what());
        return 1;
    }
}
