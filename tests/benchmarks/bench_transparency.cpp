// Processor time of a 1280 x 720 frame drawn to memory, for a number of intersecting ellipsoids,
// bricks and cylinders, translucent and opaque. Translucent surfaces are sorted at each sample,
// once by fragment lists and once by depth peeling.
//
//   bench_transparency [--benchmark_...]
//
// The last line is a JSON object: processor time [ms] of each, and the translucent times as
// multiples of the opaque ones.

#include <benchmark/benchmark.h>

#include <cmath>
#include <cstdio>
#include <map>
#include <string>

#include "simflex/render/gl/GlRenderer.h"
#include "simflex/render/gl/GlTransparency.h"

namespace simflex {
namespace {

using SimTK::Rotation;
using SimTK::Transform;
using SimTK::Vec3;

constexpr int width = 1280, height = 720;

enum class Way { Opaque, Lists, Peeling };

/** A heap of shapes around the origin, each about a quarter of the heap's size. **/
Scene makeHeap(int numShapes, double opacity) {
    Scene scene;
    const SurfaceGeometryPtr shapes[] = {createSphere(48), createBrick(), createCylinder(48)};
    for (int i = 0; i < numShapes; ++i) {
        const double angle = 2.39996 * i;  // the golden angle spreads the shapes evenly
        const double y = (2 * i + 1.0) / numShapes - 1, radius = std::sqrt(1 - y * y);
        SurfaceItem item;
        item.geometry = shapes[i % 3];
        item.X_GM = Transform(Rotation(0.7 * i, SimTK::UnitVec3(1, 2, 3)),
                              0.6 * Vec3(radius * std::cos(angle), y, radius * std::sin(angle)));
        item.scale = Vec3(0.32, 0.2, 0.25);
        item.color = 0.5 * (Vec3(1) + Vec3(std::sin(i), std::sin(2 * i), std::sin(3 * i)));
        item.opacity = opacity;
        scene.surfaces.push_back(item);
    }
    return scene;
}

void drawHeap(benchmark::State& state, Way way) {
    GlRenderer renderer;
    if (way == Way::Peeling) renderer.updTransparency().forbidLists();
    const Scene scene = makeHeap(int(state.range(0)), way == Way::Opaque ? 1 : 0.4);
    FrameStyle style;
    style.ground.isShown = false;
    Camera camera;
    camera.X_GC.updP() = Vec3(0, 0, 4);
    camera.nearPlane = 2;
    camera.farPlane = 8;
    renderer.draw(scene, camera, style, width, height);  // compiles the shaders
    for (auto _ : state)
        benchmark::DoNotOptimize(renderer.draw(scene, camera, style, width, height));
}

/** Prints one line per benchmark and stores its processor time. **/
class Reporter : public benchmark::ConsoleReporter {
public:
    std::map<std::string, double> milliseconds;

    void ReportRuns(const std::vector<Run>& runs) override {
        ConsoleReporter::ReportRuns(runs);
        for (const Run& run : runs)
            milliseconds[run.run_name.function_name + "/" + run.run_name.args] =
                run.GetAdjustedCPUTime();
    }
};

}  // namespace
}  // namespace simflex

int main(int argc, char** argv) {
    using namespace simflex;
    benchmark::Initialize(&argc, argv);
    if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
    const std::map<std::string, Way> ways = {
        {"opaque", Way::Opaque}, {"lists", Way::Lists}, {"peeling", Way::Peeling}};
    for (const auto& [name, way] : ways)
        benchmark::RegisterBenchmark(name.c_str(), drawHeap, way)
            ->Unit(benchmark::kMillisecond)
            ->MeasureProcessCPUTime()
            ->Arg(30);
    Reporter reporter;
    benchmark::RunSpecifiedBenchmarks(&reporter);
    benchmark::Shutdown();
    const auto get = [&](const char* name) {
        return reporter.milliseconds[std::string(name) + "/30"];
    };
    std::printf(
        "\n{\"opaque_ms\": %.1f, \"lists_ms\": %.1f, \"peeling_ms\": %.1f, "
        "\"lists_ratio\": %.2f, \"peeling_ratio\": %.2f}\n",
        get("opaque"), get("lists"), get("peeling"), get("lists") / get("opaque"),
        get("peeling") / get("opaque"));
    return 0;
}
