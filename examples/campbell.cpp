// Campbell diagram of a disc that spins on the end of a flexible rod: forward and backward whirl.
//
// The rod is clamped at its big end. A hub, a rigid body welded to its small end, carries the disc
// on an ordinary Simbody Pin along the rod. Writes campbell.csv, campbell.png and frames of the
// lowest mode at the highest speed.

#include <CLI/CLI.hpp>
#include <filesystem>

#include "simflex/forces/ModalDamping.h"
#include "simflex/part/ReducedBodyFile.h"
#include "simflex/render/OffscreenVisualizer.h"
#include "simflex/solver/CampbellDiagram.h"
#include "simflex/solver/StaticEquilibrium.h"
#include "support/Plot.h"

using namespace SimTK;
using namespace simflex;
using namespace simflex::examples;

namespace {

struct Arguments {
    double discMass = 0.3, discRadius = 0.06, damping = 0.01, speed = 1500, amplitude = 0.01;
    int numSpeeds = 31, numModes = 4, frames = 24;
    std::string parts = "build/release/parts", out = "build/output/campbell";
};

struct RotorModel {
    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    GeneralForceSubsystem forces{system};
    Force::Gravity gravity{forces, matter, -YAxis, 9.81};
    FlexibleBodySubsystem flexible{system, matter};  // after the other forces
    FlexibleBody rod;
    MobilizedBody::Free hub;
    MobilizedBody::Pin disc;
    Joint::Weld clamp, seat;

    RotorModel(const Arguments& arguments, const std::shared_ptr<const ReducedBody>& part)
        : rod(flexible, part),
          hub(matter.Ground(), Transform(),
              Body::Rigid(MassProperties(0.05, Vec3(0), Inertia(5e-6))), Transform()),
          disc(hub, Transform(zToX()), makeDisc(arguments), Transform(zToX())),
          clamp(flexible, matter.Ground(), rod.interface("big_end"), "clamp"),
          seat(flexible, rod.interface("small_end"), hub, "seat") {
        ModalDamping(flexible, rod, arguments.damping);
        matter.setShowDefaultGeometry(false);
    }

    static Rotation zToX() { return Rotation(Pi / 2, YAxis); }

    static Body::Rigid makeDisc(const Arguments& arguments) {
        const double m = arguments.discMass, r = arguments.discRadius, thickness = 0.01;
        Body::Rigid body(
            MassProperties(m, Vec3(0), m * UnitInertia::cylinderAlongX(r, thickness / 2)));
        body.addDecoration(Transform(Rotation(Pi / 2, ZAxis)),
                           DecorativeCylinder(r, thickness / 2).setColor(Vec3(0.3, 0.5, 0.8)));
        return body;
    }

    /** Assembled, undeformed. **/
    State makeState() {
        State state = system.realizeTopology();
        rod.setPoseByInterface(state, "big_end", Transform());
        system.realize(state, Stage::Velocity);
        hub.setQToFitTransform(state, rod.interface("small_end").calcMotion(state).X);
        return state;
    }
};

void drawMode(const Arguments& arguments, const RotorModel& model, const Linearization& linear,
              const Eigenmode& mode) {
    OffscreenVisualizer visualizer(model.system);
    visualizer.addFlexibleBody(model.rod).setDeformationFactor(1);
    visualizer.setOutputFolder(arguments.out + "/frames");
    const std::vector<State> states =
        calcModeStates(model.system, linear, mode, arguments.amplitude, arguments.frames);
    visualizer.fitToMotion(states);
    visualizer.reportAll(states);
    std::printf("%d frames of the lowest mode at %g rad/s in %s/frames\n", arguments.frames,
                arguments.speed, arguments.out.c_str());
}

void plot(const Arguments& arguments, const CampbellDiagram& diagram) {
    const int colors[] = {Plot::Blue, Plot::Orange, Plot::Green};
    Plot plot{"Disc on a flexible rod", "speed [rad/s]", {}};
    Plot::Panel frequencies, damping;
    frequencies.title = "natural frequencies, and once per turn";
    frequencies.yLabel = "[Hz]";
    for (size_t k = 0; k < diagram.branches.size(); ++k)
        frequencies.series.push_back(
            {"", diagram.speeds, diagram.branches[k].frequency, colors[k % 3]});
    std::vector<double> once;
    for (const double speed : diagram.speeds) once.push_back(speed / (2 * Pi));
    frequencies.series.push_back({"once per turn", diagram.speeds, once, Plot::Gray});
    damping.title = "damping";
    damping.yLabel = "[% of critical]";
    for (size_t k = 0; k < diagram.branches.size(); ++k) {
        std::vector<double> percent;
        for (const double ratio : diagram.branches[k].dampingRatio) percent.push_back(100 * ratio);
        damping.series.push_back({"", diagram.speeds, percent, colors[k % 3]});
    }
    plot.panels = {frequencies, damping};
    writePlot(plot, arguments.out + "/campbell.png");
}

int run(const Arguments& arguments) {
    const std::string path = arguments.parts + "/rod.h5";
    RotorModel model(arguments, std::make_shared<const ReducedBody>(readReducedBody(path)));
    StaticEquilibrium equilibrium(model.system);
    equilibrium.solve(model.makeState());
    State state = equilibrium.getState();

    std::vector<Real> speeds;
    for (int i = 0; i < arguments.numSpeeds; ++i)
        speeds.push_back(arguments.speed * i / std::max(1, arguments.numSpeeds - 1));
    const auto linearize = [&](Real speed) {
        model.disc.setOneU(state, 0, speed);
        return calcLinearization(model.system, state);
    };
    const CampbellDiagram diagram =
        calcCampbellDiagram(speeds, arguments.numModes,
                            [&](Real speed, int) { return calcEigenmodes(linearize(speed)); });
    std::filesystem::create_directories(arguments.out);
    writeCampbellDiagram(arguments.out + "/campbell.csv", diagram);
    std::printf("%-6s %14s %14s %12s\n", "branch", "at rest [Hz]", "at speed [Hz]", "damping [%]");
    for (size_t k = 0; k < diagram.branches.size(); ++k) {
        const CampbellDiagram::Branch& branch = diagram.branches[k];
        std::printf("%-6zu %14.2f %14.2f %12.3f\n", k + 1, branch.frequency.front(),
                    branch.frequency.back(), 100 * branch.dampingRatio.back());
    }
    plot(arguments, diagram);
    if (arguments.frames > 0) {
        const Linearization linear = linearize(speeds.back());
        for (const Eigenmode& mode : calcEigenmodes(linear)) {
            if (mode.isRigidMotion()) continue;
            drawMode(arguments, model, linear, mode);
            break;
        }
    }
    return 0;
}

}  // namespace

int main(int argc, char** argv) {
    Arguments arguments;
    CLI::App app("Campbell diagram of a disc on the end of a flexible rod.");
    app.option_defaults()->take_last()->always_capture_default();
    app.add_option("--speed", arguments.speed, "Highest speed of the disc [rad/s]");
    app.add_option("--speeds", arguments.numSpeeds, "Number of speeds")->check(CLI::PositiveNumber);
    app.add_option("--modes", arguments.numModes, "Number of modes to follow")
        ->check(CLI::PositiveNumber);
    app.add_option("--disc-mass", arguments.discMass, "Mass of the disc [kg]")
        ->check(CLI::PositiveNumber);
    app.add_option("--disc-radius", arguments.discRadius, "Radius of the disc [m]")
        ->check(CLI::PositiveNumber);
    app.add_option("--damping", arguments.damping, "Damping ratio of each mode")
        ->check(CLI::NonNegativeNumber);
    app.add_option("--frames", arguments.frames, "Number of pictures of the lowest mode")
        ->check(CLI::NonNegativeNumber);
    app.add_option("--parts", arguments.parts, "Folder of the reduced parts");
    app.add_option("-o,--output", arguments.out, "Folder to write");
    CLI11_PARSE(app, argc, argv);
    try {
        return run(arguments);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "campbell: %s\n", error.what());
        return 1;
    }
}
