// Pictures of every kind: stress, reactions, cameras, plots, and Simbody's own geometry.
//
// Runs the slider-crank with a shapely connecting rod that was reduced with stress, and a plain
// Simbody system; writes one picture of each kind and a contact sheet of them.

#include <CLI/CLI.hpp>
#include <filesystem>

#include "simflex/part/ReducedBodyFile.h"
#include "simflex/render/ContactSheet.h"
#include "simflex/render/OffscreenVisualizer.h"
#include "simflex/render/ProbePlot.h"
#include "simflex/solver/BdfIntegrator.h"
#include "support/Progress.h"
#include "support/SliderCrankModel.h"

using namespace SimTK;
using namespace simflex;
using namespace simflex::examples;

namespace {

constexpr double endTime = 0.1;  // [s]
constexpr int numStates = 400;

/** States and measurements of a run, by sample, in SI units. **/
struct Run {
    std::vector<State> states;
    std::vector<double> time, deflection, pinForce;
};

Run simulate(SliderCrankModel& model) {
    BdfIntegrator integrator(model.system);
    integrator.setAccuracy(1e-6);
    integrator.initialize(model.makeInitialState());
    Run run;
    Progress progress("integration");
    for (int i = 0; i <= numStates && !wasInterrupted(); ++i) {
        const double time = endTime * i / numStates;
        if (i > 0) integrator.stepTo(time);
        const State& state = integrator.getState();
        model.system.realize(state, Stage::Velocity);
        run.states.push_back(state);
        run.time.push_back(time);
        run.deflection.push_back(model.calcRodDeflection(state));
        const Vector lambda = integrator.getMultipliers(model.gudgeonPin);
        run.pinForce.push_back(model.gudgeonPin.calcForceOnM(state, lambda)[1].norm());
        progress.show(double(i) / numStates);
    }
    return run;
}

const State& findLargest(const Run& run, const std::vector<double>& values) {
    return run.states[std::max_element(values.begin(), values.end()) - values.begin()];
}

/** Von Mises stress where the load on the gudgeon pin is largest, with joints and reactions. **/
Image drawStress(const SliderCrankModel& model, const Run& run) {
    OffscreenVisualizer viz(model.system);
    viz.addFlexibleBody(model.crank).addFlexibleBody(model.rod);
    viz.setContour(Contour::VonMises).setDeformationFactor(1);
    viz.setShowUndeformed(false).setShowJoints(true).setShowReactions(true);
    viz.setWindowTitle("Stress in crank and rod, joints and their reactions");
    viz.setCameraView(0.3, 0.35);
    const State& state = findLargest(run, run.pinForce);
    viz.fitToMotion({state});
    return viz.drawFrame(state);
}

/** Deformation, 100 times enlarged, from three cameras, one of which follows the rod; below them
curves of the run. **/
Image drawViews(const SliderCrankModel& model, const Run& run) {
    constexpr double factor = 100;
    OffscreenVisualizer viz(model.system, 1280, 500);
    viz.addFlexibleBody(model.crank).addFlexibleBody(model.rod).setDeformationFactor(factor);
    viz.setWindowTitle("Three cameras, two probes").setShowUndeformed(false);
    viz.addView(CameraView("rides with the rod").setFollowedBody(model.rod.getFrame(), 0.14));
    viz.addView(CameraView("from the front").setDirection(0, 0).setOrthographic());
    ProbePlot plot;
    plot.addPanel("deflection of the rod", "µm", 1e-6).addCurve("", run.time, run.deflection);
    plot.addPanel("force on the gudgeon pin", "N").addCurve("", run.time, run.pinForce);
    viz.addPlot(plot, PlotSide::Below, 220);
    std::vector<State> states;
    for (size_t i = 0; i < run.states.size(); i += 10)
        states.push_back(model.calcPictureState(run.states[i]));
    viz.fitToMotion(states);
    return viz.drawFrame(model.calcPictureState(findLargest(run, run.deflection)));
}

/** A signed component of the displacement, 500 times enlarged. **/
Image drawSigned(const SliderCrankModel& model, const Run& run) {
    OffscreenVisualizer viz(model.system);
    viz.addFlexibleBody(model.rod).setContour(Contour::DisplacementY).setDeformationFactor(500);
    viz.setWindowTitle("Displacement across the rod").setTheme(OffscreenVisualizer::Theme::Dark);
    viz.setCameraView(0.2, 0.25).setShowElementEdges(true);
    const State& state = findLargest(run, run.deflection);
    viz.fitToMotion({state});
    return viz.drawFrame(state);
}

/** Simbody's own geometry, for any System: no flexible part, transparency in the right order. **/
Image drawSimbody() {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    matter.setShowDefaultGeometry(false);
    Body::Rigid body(MassProperties(1, Vec3(0), UnitInertia(1)));
    const Vec3 glass(0.45, 0.65, 0.85), brass(0.85, 0.65, 0.25), steel(0.55, 0.58, 0.62);
    body.addDecoration(Vec3(0), DecorativeSphere(0.5).setColor(glass).setOpacity(0.3));
    body.addDecoration(Vec3(0), DecorativeTorus(0.42, 0.03).setColor(brass));
    body.addDecoration(Rotation(Pi / 2, YAxis), DecorativeTorus(0.36, 0.03).setColor(steel));
    body.addDecoration(Vec3(0),
                       DecorativeEllipsoid(Vec3(0.2, 0.1, 0.1)).setColor(Vec3(0.7, 0.2, 0.2)));
    body.addDecoration(Vec3(0), DecorativeCylinder(0.02, 0.7).setColor(steel));
    body.addDecoration(Vec3(0, 0.7, 0), DecorativeText("gyroscope").setScale(0.08));
    MobilizedBody::Ball gyroscope(matter.Ground(), Vec3(0, 0.8, 0), body, Vec3(0, -0.7, 0));
    matter.Ground().addBodyDecoration(
        Vec3(0, 0.3, 0),
        DecorativeCone(Vec3(0, -0.3, 0), UnitVec3(YAxis), 0.8, 0.2).setColor(steel));
    matter.Ground().addBodyDecoration(
        Vec3(0), DecorativeArrow(Vec3(0.7, 1.2, 0), Vec3(0.7, 0.6, 0), 0.12).setColor(brass));
    matter.Ground().addBodyDecoration(Vec3(0.74, 0.9, 0), DecorativeText("g").setScale(0.1));
    matter.Ground().addBodyDecoration(Vec3(-0.9, 0.2, 0),
                                      DecorativeBrick(Vec3(0.2)).setColor(glass).setRepresentation(
                                          DecorativeGeometry::DrawWireframe));
    matter.Ground().addBodyDecoration(Vec3(-0.9, 0.2, 0), DecorativeFrame(0.3));
    State state = system.realizeTopology();
    gyroscope.setQToFitRotation(state, Rotation(-0.35, ZAxis));
    OffscreenVisualizer viz(system);
    viz.setWindowTitle("Any Simbody system").setShowSimTime(false);
    return viz.drawFrame(state);
}

}  // namespace

int main(int argc, char** argv) try {
    CLI::App app("Pictures of every kind: stress, cameras, plots, Simbody's own geometry");
    std::string parts = "build/release/parts", out = "build/output/gallery";
    app.add_option("--parts", parts, "Folder of the reduced parts")->capture_default_str();
    app.add_option("-o,--output", out, "Folder to write")->capture_default_str();
    CLI11_PARSE(app, argc, argv);
    catchInterrupts();

    const auto read = [&](const std::string& name) {
        return std::make_shared<const ReducedBody>(readReducedBody(parts + "/" + name + ".h5"));
    };
    SliderCrankOptions options;
    options.speed = 200;
    SliderCrankModel model(options, read("crank_stress"), read("shapely_rod_stress"));
    const Run run = simulate(model);
    if (wasInterrupted()) return 130;

    const std::vector<Image> pictures = {drawStress(model, run), drawViews(model, run),
                                         drawSigned(model, run), drawSimbody()};
    std::filesystem::create_directories(out);
    const char* const names[] = {"stress", "views", "signed", "simbody"};
    for (size_t i = 0; i < pictures.size(); ++i)
        pictures[i].writePng(out + "/" + names[i] + ".png");
    makeContactSheet(pictures, 2, 800).writePng(out + "/gallery.png");
    std::printf("wrote %s/gallery.png and the pictures in it\n", out.c_str());
    return 0;
} catch (const std::exception& error) {
    std::fprintf(stderr, "gallery: %s\n", error.what());
    return 1;
}
