/** @file
Frames per second of a deforming part with contour and colour bar, compared with VTK's software
rendering of the same frames.

    bench_render [--triangles N ...] [--size WIDTHxHEIGHT] [--modes 40] [--rival SECONDS]
                 [--frames 240]

The part is a solid ring with a smooth skin, so that both sides draw exactly the same vertices. Work
per frame:

  simflex  deforms the skin (Φξ, normals, values), draws, and returns the picture in memory.
           "same" draws what VTK draws; "default" adds the ground with a soft shadow, the
           undeformed ghost, axes and captions.
  VTK      receives precomputed positions and displacements in arrays that it references without
           a copy (Φξ is not timed); vtkTriangleMeshPointNormals, VTK's fastest filter for
           normals; vtkPolyDataMapper with a lookup table of 256 colours, vtkScalarBarActor, one
           headlight, 4 samples, off-screen; reads the picture back to memory by
           GetRGBACharPixelData. Python only sets pointers and calls Render(). It runs under
           xvfb-run on llvmpipe, the rasterizer of simflex, too. The faster of mapping values to
           colours before and after interpolation counts.

Both use the same camera; the number of pixels that each covers is printed. Times are lower
quartiles, which other load disturbs less than means. Writing PNG files is timed separately. --rival
is VTK's time limit for each size; 0 skips it.

Then the slider-crank of the examples: integration alone, and with frames that the visualizer's
threads draw and write to a folder in parallel: --frames of them in 0.2 s of motion, 0 skips them.

The last line is a JSON object for 100 000 triangles, or for the only size; fps_1e4_default and
fps_1e5_default are for the default scene with 10⁴ and 10⁵ triangles. **/

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

#include "Simbody.h"
#include "simflex/part/ReducedBodyFile.h"
#include "simflex/render/OffscreenVisualizer.h"
#include "simflex/render/SurfaceMesh.h"
#include "simflex/solver/BdfIntegrator.h"
#include "support/SliderCrankModel.h"

namespace simflex {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;
using SimTK::State;
using SimTK::Transform;
using SimTK::Vec3;
using Part = std::shared_ptr<const ReducedBody>;

constexpr double ringRadius = 0.2, sectionRadius = 0.062;
constexpr double fieldOfViewDegrees = 30;
constexpr double largestDisplacement = 0.02;
constexpr int numRivalFrames = 8;  // precomputed displaced positions, shown in turn

struct Arguments {
    std::vector<long> triangles;
    int width = 1280, height = 720, numModes = 40;
    double rivalSeconds = 120;
    int numFrames = 240;
};

double secondsSince(Clock::time_point start) {
    return std::chrono::duration<double>(Clock::now() - start).count();
}

/** Returns the lower quartile of the time of one call, over at least five calls and `seconds`
seconds. **/
double measureQuartile(double seconds, const std::function<void(int)>& work) {
    work(0);
    std::vector<double> times;
    const auto start = Clock::now();
    while (times.size() < 5 || secondsSince(start) < seconds) {
        const auto before = Clock::now();
        work(int(times.size()) + 1);
        times.push_back(secondsSince(before));
    }
    std::nth_element(times.begin(), times.begin() + long(times.size() / 4), times.end());
    return times[times.size() / 4];
}

double readStatus(const char* key) {
    std::ifstream in("/proc/self/status");
    for (std::string line; std::getline(in, line);)
        if (line.rfind(key, 0) == 0) return 1024 * std::atof(line.c_str() + std::strlen(key));
    return 0;
}

/** Makes a solid ring about z of wedges around its core, wavy along its circle; the modes are waves
too. **/
Part makeRing(long numTriangles, int numModes) {
    // Square skin facets: around : across = 2πR : 2πr.
    const double quads = double(numTriangles) / 2;
    const int across = std::max(6, int(std::lround(std::sqrt(quads * sectionRadius / ringRadius))));
    const int around = std::max(12, int(std::lround(quads / across)));
    auto part = std::make_shared<ReducedBody>();
    part->name = "ring";
    part->mass = 1;
    part->inertia = {1, 1, 1, 0, 0, 0};
    part->numModes = numModes;
    Mesh& mesh = part->mesh;
    const std::size_t numNodes = std::size_t(around) * std::size_t(across + 1);
    const std::size_t rows = 3 * numNodes;
    part->Phi.resize(rows * std::size_t(numModes));
    ElementBlock block;
    block.type = ElementType::Wedge6;
    for (int i = 0; i < around; ++i) {
        const double angle = 2 * SimTK::Pi * i / around;
        const Vec3 outward(std::cos(angle), std::sin(angle), 0);
        const double thickness = sectionRadius * (1 + 0.12 * std::cos(12 * angle));
        for (int j = 0; j <= across; ++j) {  // node 0 of a section is its core
            const double turn = 2 * SimTK::Pi * j / across, r = j == 0 ? 0 : thickness;
            const Vec3 s =
                (ringRadius + r * std::cos(turn)) * outward + Vec3(0, 0, r * std::sin(turn));
            const std::size_t node = mesh.nodeNumbers.size();
            mesh.nodeNumbers.push_back(int(node) + 1);
            for (int k = 0; k < 3; ++k) mesh.positions.push_back(s[k]);
            for (int mode = 0; mode < numModes; ++mode) {
                const int waves = 2 + mode / 4;
                const double phase = mode % 2 ? std::sin(waves * angle) : std::cos(waves * angle);
                const Vec3 u = (mode / 2 % 2 ? Vec3(0, 0, 1) : outward) * phase;
                for (std::size_t k = 0; k < 3; ++k)
                    part->Phi[std::size_t(mode) * rows + 3 * node + k] = u[int(k)];
            }
        }
        const auto nodeOf = [&](int section, int j) {
            return (section % around) * (across + 1) + (j == 0 ? 0 : 1 + (j - 1) % across);
        };
        for (int j = 1; j <= across; ++j)
            for (const int section : {i, i + 1})
                for (const int corner : {0, j + 1, j})
                    block.nodes.push_back(nodeOf(section, corner));
    }
    for (int mode = 0; mode < numModes; ++mode) part->omegaSquared.push_back(mode + 1);
    mesh.elements.push_back(std::move(block));
    return part;
}

/** Returns the modal coordinates of frame `number`. **/
SimTK::Vector calcModalCoordinates(int number, int numModes) {
    SimTK::Vector xi(numModes);
    for (int i = 0; i < numModes; ++i)
        xi[i] = largestDisplacement / (2.0 * (1 + i)) * std::sin(0.3 * number * (1 + 0.2 * i) + i);
    return xi;
}

Transform calcCameraPose() {
    const Vec3 from = 0.95 * Vec3(0, -std::cos(0.7), std::sin(0.7));
    return Transform(
        SimTK::Rotation(SimTK::UnitVec3(from), SimTK::ZAxis, Vec3(1, 0, 0), SimTK::XAxis), from);
}

OffscreenVisualizer makeVisualizer(const SimTK::System& system, const Part& part,
                                   const Arguments& arguments) {
    OffscreenVisualizer viz(system, arguments.width, arguments.height);
    viz.setSystemUpDirection(SimTK::ZAxis);
    const int numModes = part->numModes;
    viz.addDeformableMesh({part, "", [](const State&) { return Transform(); },
                           [numModes](const State& state) {
                               return calcModalCoordinates(int(std::lround(state.getTime())),
                                                           numModes);
                           }});
    viz.setCameraTransform(calcCameraPose())
        .setCameraFieldOfView(fieldOfViewDegrees * SimTK::Pi / 180);
    viz.setContourRange(0, largestDisplacement).setDeformationFactor(1);
    return viz;
}

struct FrameTimes {
    double same = 0, all = 0, png = 0, vtk = 0;
};

//------------------------------------------------------------------------------------------------
// VTK

template <class T>
void dump(const fs::path& path, const std::vector<T>& values) {
    std::ofstream out(path, std::ios::binary);
    out.write(reinterpret_cast<const char*>(values.data()),
              std::streamsize(values.size() * sizeof(T)));
    if (!out) throw std::runtime_error("cannot write " + path.string());
}

void writeRivalFrames(const fs::path& folder, const ReducedBody& part) {
    const SurfaceMesh skin = extractSurface(part.mesh);
    std::vector<std::int64_t> triangles;
    for (const auto& t : skin.triangles) triangles.insert(triangles.end(), t.begin(), t.end());
    dump(folder / "triangles", triangles);
    const std::size_t rows = part.mesh.positions.size();
    for (int frame = 0; frame < numRivalFrames; ++frame) {
        const SimTK::Vector xi = calcModalCoordinates(frame, part.numModes);
        std::vector<float> positions, values;
        for (const int node : skin.nodes) {
            Vec3 u(0), s;
            for (int k = 0; k < 3; ++k) s[k] = part.mesh.positions[3 * std::size_t(node) + k];
            for (int mode = 0; mode < part.numModes; ++mode)
                for (int k = 0; k < 3; ++k)
                    u[k] +=
                        xi[mode] * part.Phi[std::size_t(mode) * rows + 3 * std::size_t(node) + k];
            for (int k = 0; k < 3; ++k) positions.push_back(float(s[k] + u[k]));
            values.push_back(float(u.norm()));
        }
        dump(folder / ("positions" + std::to_string(frame)), positions);
        dump(folder / ("values" + std::to_string(frame)), values);
    }
}

const char* const rivalProgram = R"(
import sys, time
import numpy as np
import vtk
from vtk.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray, vtk_to_numpy

width, height, count, seconds = int(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]), float(sys.argv[4])
eye, up, angle, high = eval(sys.argv[5])
triangles = np.fromfile('triangles', np.int64)
starts = np.arange(0, len(triangles) + 1, 3)
positions = [np.fromfile('positions%d' % k, np.float32).reshape(-1, 3) for k in range(count)]
values = [np.fromfile('values%d' % k, np.float32) for k in range(count)]
points_of = [numpy_to_vtk(p) for p in positions]     # refer to the arrays, no copy
values_of = [numpy_to_vtk(v) for v in values]

def measure(interpolates, name):
    cells = vtk.vtkCellArray()
    cells.SetData(numpy_to_vtkIdTypeArray(starts), numpy_to_vtkIdTypeArray(triangles))
    points, mesh = vtk.vtkPoints(), vtk.vtkPolyData()
    mesh.SetPoints(points)
    mesh.SetPolys(cells)
    def show(k):
        points.SetData(points_of[k])
        points.Modified()
        mesh.GetPointData().SetScalars(values_of[k])
        mesh.Modified()
    show(0)
    normals = vtk.vtkTriangleMeshPointNormals()
    normals.SetInputData(mesh)
    table = vtk.vtkLookupTable()
    table.SetNumberOfTableValues(256)
    table.SetHueRange(0.667, 0)
    table.SetRange(0, high)
    table.Build()
    mapper = vtk.vtkPolyDataMapper()
    mapper.SetInputConnection(normals.GetOutputPort())
    mapper.SetLookupTable(table)
    mapper.SetScalarRange(0, high)
    mapper.SetInterpolateScalarsBeforeMapping(interpolates)
    actor, bar = vtk.vtkActor(), vtk.vtkScalarBarActor()
    actor.SetMapper(mapper)
    bar.SetLookupTable(table)
    bar.SetTitle('displacement')
    renderer, window = vtk.vtkRenderer(), vtk.vtkRenderWindow()
    renderer.AddActor(actor)
    renderer.AddActor2D(bar)
    renderer.SetBackground(1, 1, 1)
    camera = renderer.GetActiveCamera()
    camera.SetPosition(*eye)
    camera.SetFocalPoint(0, 0, 0)
    camera.SetViewUp(*up)
    camera.SetViewAngle(angle)
    renderer.ResetCameraClippingRange()
    window.SetMultiSamples(4)
    window.SetOffScreenRendering(1)
    window.SetSize(width, height)
    window.AddRenderer(renderer)
    picture, times, start = vtk.vtkUnsignedCharArray(), [], None
    frame = 0
    while frame < 2 or len(times) < 5 or time.perf_counter() - start < min(3, seconds):
        before = time.perf_counter()
        if frame == 2:     # two frames to warm up
            start = before
        show(frame % count)
        window.Render()
        window.GetRGBACharPixelData(0, 0, width - 1, height - 1, 0, picture)
        if frame >= 2:
            times.append(time.perf_counter() - before)
        frame += 1
        if start and time.perf_counter() - start > seconds:
            break
    bar.SetVisibility(0)
    show(0)
    window.Render()
    window.GetRGBACharPixelData(0, 0, width - 1, height - 1, 0, picture)
    covered = int((vtk_to_numpy(picture)[:, :3].min(axis=1) < 250).sum())
    writer, grab = vtk.vtkPNGWriter(), vtk.vtkWindowToImageFilter()
    grab.SetInput(window)
    writer.SetInputConnection(grab.GetOutputPort())
    writer.SetFileName(name)
    writer.Write()
    renderer_name = [l.split(':')[1].strip() for l in window.ReportCapabilities().split('\n')
                     if 'renderer string' in l]
    return np.sort(times)[len(times) // 4], covered, renderer_name[0] if renderer_name else '?'

late, covered, device = measure(1, 'vtk_late.png')
early, _, _ = measure(0, 'vtk.png')
print('VTK %s on %s: %.1f ms mapping values per vertex, %.1f ms per pixel; covers %d pixels' %
      (vtk.vtkVersion.GetVTKVersion(), device, 1e3 * early, 1e3 * late, covered))
with open('result', 'w') as out:
    out.write('%.9g\n' % min(early, late))
)";

/** Returns VTK's seconds per frame; 0 if it cannot be run. **/
double runRival(const fs::path& folder, const Arguments& arguments, const ReducedBody& part) {
    writeRivalFrames(folder, part);
    std::ofstream(folder / "rival.py") << rivalProgram;
    const Transform X_GC = calcCameraPose();
    char camera[200];
    std::snprintf(camera, sizeof camera, "((%.9g,%.9g,%.9g),(%.9g,%.9g,%.9g),%.9g,%.9g)",
                  X_GC.p()[0], X_GC.p()[1], X_GC.p()[2], X_GC.y()[0], X_GC.y()[1], X_GC.y()[2],
                  fieldOfViewDegrees, largestDisplacement);
    std::fflush(stdout);
    const std::string command =
        "cd '" + folder.string() + "' && xvfb-run -a /usr/bin/python3 rival.py " +
        std::to_string(arguments.width) + " " + std::to_string(arguments.height) + " " +
        std::to_string(numRivalFrames) + " " + std::to_string(arguments.rivalSeconds / 2) + " '" +
        camera + "' 2> rival.log";
    fs::remove(folder / "result");
    // The exit status is ignored: xvfb-run may fail to clean up after a successful run.
    [[maybe_unused]] const int status = std::system(command.c_str());
    double seconds = 0;
    std::ifstream(folder / "result") >> seconds;
    if (!(seconds > 0)) {
        std::ifstream log(folder / "rival.log");
        std::string line, last = "no word";
        while (std::getline(log, line))
            if (!line.empty()) last = line;
        std::printf("VTK could not be run (python3-vtk9, xvfb, xauth?): %s\n", last.c_str());
    }
    return seconds;
}

//------------------------------------------------------------------------------------------------

int countCovered(const Image& image) {
    int count = 0;
    for (int y = 0; y < image.getHeight(); ++y)
        for (int x = 0; x < image.getWidth(); ++x) {
            const Image::Pixel p = image.getPixel(x, y);
            count += std::min({p[0], p[1], p[2]}) < 250;
        }
    return count;
}

FrameTimes measureSize(const Arguments& arguments, long numTriangles, const fs::path& folder) {
    const double before = readStatus("VmRSS:");
    const Part part = makeRing(numTriangles, arguments.numModes);
    const double ofPart = readStatus("VmRSS:") - before;
    SimTK::MultibodySystem system;
    SimTK::SimbodyMatterSubsystem matter(system);
    matter.setShowDefaultGeometry(false);
    State state = system.realizeTopology();

    const auto start = Clock::now();
    OffscreenVisualizer viz = makeVisualizer(system, part, arguments);
    const double setUp = secondsSince(start);
    const auto draw = [&](const OffscreenVisualizer& visualizer, int number) {
        state.setTime(number);
        return visualizer.drawFrame(state);
    };
    const auto first = Clock::now();
    draw(viz, 0);
    const double firstFrame = secondsSince(first);
    std::printf(
        "\nring of %ld triangles, %d modes, %dx%d: set-up %.2f s, first frame %.2f s, "
        "%.0f MB besides the part's %.0f MB\n",
        2 * (long(part->mesh.elements[0].numElements())), part->numModes, arguments.width,
        arguments.height, setUp, firstFrame, 1e-6 * (readStatus("VmRSS:") - before - ofPart),
        1e-6 * ofPart);

    FrameTimes times;
    Image image(1, 1);
    times.all = measureQuartile(2, [&](int number) { image = draw(viz, number); });
    image.writePng((folder / "default.png").string());
    times.png = measureQuartile(1, [&](int) { image.writePng((folder / "default.png").string()); });
    viz.setBackgroundType(SimTK::Visualizer::SolidColor)
        .setShowUndeformed(false)
        .setShowAxes(false)
        .setShowSimTime(false)
        .setShowDeformationFactor(false);
    times.same = measureQuartile(2, [&](int number) { image = draw(viz, number); });
    image.writePng((folder / "same.png").string());
    viz.setShowColorBar(false);
    std::printf("simflex: %.1f ms the same, %.1f ms by default; covers %d pixels\n",
                1e3 * times.same, 1e3 * times.all, countCovered(draw(viz, 0)));
    if (arguments.rivalSeconds > 0) times.vtk = runRival(folder, arguments, *part);
    return times;
}

/** Returns the seconds of a run of 0.2 s of motion, with frames in `folder` unless it is empty. **/
double measureSliderCrank(const Arguments& arguments, const std::string& folder) {
    const auto read = [](const char* name) {
        return std::make_shared<const ReducedBody>(
            readReducedBody(std::string(SIMFLEX_PARTS) + "/" + name + ".h5"));
    };
    examples::SliderCrankModel model({}, read("crank"), read("rod"));
    BdfIntegrator integrator(model.system);
    integrator.setAccuracy(1e-6);
    integrator.initialize(model.makeInitialState());
    OffscreenVisualizer viz(model.system, arguments.width, arguments.height);
    viz.addFlexibleBody(model.crank).addFlexibleBody(model.rod).setOutputFolder(folder);
    if (!folder.empty()) {
        viz.report(integrator.getState());  // creates the context and compiles the shaders
        viz.finish();
    }

    const auto start = Clock::now();
    for (int i = 1; i <= arguments.numFrames; ++i) {
        integrator.stepTo(0.2 * i / arguments.numFrames);
        if (!folder.empty()) viz.report(integrator.getState());
    }
    viz.finish();
    return secondsSince(start);
}

struct FrameShare {
    double alone = 0, withFrames = 0;
    double get() const { return withFrames > 0 ? 1 - alone / withFrames : 0; }
};

FrameShare measureShare(const Arguments& arguments, const fs::path& folder) {
    FrameShare share;
    for (int repetition = 0; repetition < 2; ++repetition) {  // keeps the better of two
        const auto keepBest = [&](double& best, const std::string& to) {
            const double seconds = measureSliderCrank(arguments, to);
            best = best > 0 ? std::min(best, seconds) : seconds;
        };
        keepBest(share.alone, "");
        keepBest(share.withFrames, (folder / "frames").string());
    }
    std::printf(
        "\nslider-crank, 0.2 s of motion: integration %.2f s, with %d frames to PNG files %.2f s "
        "(%.1f ms a frame): frames cost %.0f %% of the run\n",
        share.alone, arguments.numFrames, share.withFrames,
        1e3 * (share.withFrames - share.alone) / arguments.numFrames, 100 * share.get());
    return share;
}

int run(const Arguments& arguments) {
    const char* const keep =
        std::getenv("SIMFLEX_BENCH_FOLDER");  // keeps the pictures for inspection
    std::string pattern =
        std::string(std::getenv("TMPDIR") ? std::getenv("TMPDIR") : "/tmp") + "/bench-XXXXXX";
    if (!keep && !mkdtemp(pattern.data())) throw std::runtime_error("cannot make " + pattern);
    struct Remover {
        fs::path path;
        bool removes;
        ~Remover() {
            if (removes) fs::remove_all(path);
        }
    } remover{keep ? keep : pattern, !keep};
    fs::create_directories(remover.path);

    std::vector<FrameTimes> all;
    for (const long n : arguments.triangles) all.push_back(measureSize(arguments, n, remover.path));

    std::printf(
        "\nframes per second, deformed, drawn and in memory\n%10s %10s %10s %10s %8s %12s\n",
        "triangles", "default", "same", "VTK", "ratio", "PNG alone");
    std::size_t shown = 0;
    for (std::size_t i = 0; i < all.size(); ++i) {
        if (arguments.triangles[i] == 100000) shown = i;
        std::printf("%10ld %10.1f %10.1f %10.1f %7.1fx %9.1f ms\n", arguments.triangles[i],
                    1 / all[i].all, 1 / all[i].same, all[i].vtk > 0 ? 1 / all[i].vtk : 0.0,
                    all[i].vtk / all[i].same, 1e3 * all[i].png);
    }
    FrameShare share;
    if (arguments.numFrames > 0) share = measureShare(arguments, remover.path);
    const FrameTimes& t = all[shown];
    const auto calcDefault = [&](long triangles) {
        const auto found =
            std::find(arguments.triangles.begin(), arguments.triangles.end(), triangles);
        return found == arguments.triangles.end()
                   ? 0.0
                   : 1 / all[std::size_t(found - arguments.triangles.begin())].all;
    };
    std::printf(
        "\n{\"triangles\": %ld, \"fps\": %.2f, \"vtk_fps\": %.2f, \"ratio\": %.2f, "
        "\"fps_default\": %.2f, \"fps_1e4_default\": %.2f, \"fps_1e5_default\": %.2f, "
        "\"png_ms\": %.2f, \"frame_share\": %.3f, \"slider_crank_frames_seconds\": %.2f}\n",
        arguments.triangles[shown], 1 / t.same, t.vtk > 0 ? 1 / t.vtk : 0.0, t.vtk / t.same,
        1 / t.all, calcDefault(10000), calcDefault(100000), 1e3 * t.png, share.get(),
        share.withFrames - share.alone);
    return 0;
}

Arguments parse(int argc, char** argv) {
    Arguments arguments;
    const auto isNumber = [&](int i) {
        return i < argc && std::atof(argv[i]) >= 0 && argv[i][0] != '-';
    };
    for (int i = 1; i < argc; ++i) {
        const std::string option = argv[i];
        if (!isNumber(i + 1)) throw std::invalid_argument(option + " needs a number");
        if (option == "--triangles") {
            while (isNumber(i + 1))
                arguments.triangles.push_back(std::max(100L, std::atol(argv[++i])));
        } else if (option == "--size") {
            if (std::sscanf(argv[++i], "%dx%d", &arguments.width, &arguments.height) != 2)
                throw std::invalid_argument("--size takes WIDTHxHEIGHT");
        } else if (option == "--modes") {
            arguments.numModes = std::max(1, std::atoi(argv[++i]));
        } else if (option == "--rival") {
            arguments.rivalSeconds = std::atof(argv[++i]);
        } else if (option == "--frames") {
            arguments.numFrames = std::atoi(argv[++i]);
        } else {
            throw std::invalid_argument(
                "unknown option " + option +
                "; there are --triangles, --size, --modes, --rival, --frames");
        }
    }
    if (arguments.triangles.empty()) arguments.triangles = {10000, 100000, 1000000};
    return arguments;
}

}  // namespace
}  // namespace simflex

int main(int argc, char** argv) {
    std::setvbuf(stdout, nullptr, _IOLBF, 0);
    try {
        return simflex::run(simflex::parse(argc, argv));
    } catch (const std::exception& error) {
        std::fprintf(stderr, "bench_render: %s\n", error.what());
        return 1;
    }
}
