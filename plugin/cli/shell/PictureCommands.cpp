/** @file
Commands of the prompt for pictures and plots, in the terminal and in files. **/

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "simflex/base/Progress.h"
#include "simflex/base/UnfinishedFile.h"
#include "simflex/cli/Format.h"
#include "simflex/cli/Messages.h"
#include "simflex/cli/ProgressBar.h"
#include "simflex/cli/shell/Shell.h"
#include "simflex/cli/shell/TerminalPicture.h"
#include "simflex/cli/shell/TerminalPlot.h"
#include "simflex/model/file/NearestName.h"
#include "simflex/model/pictures/Pictures.h"
#include "simflex/model/results/ProbeChoice.h"
#include "simflex/model/results/ResultFigure.h"

namespace simflex {
namespace cli {
namespace {

using Names = std::vector<std::string>;

void checkPng(const std::string& path) {
    if (path.size() < 5 || path.compare(path.size() - 4, 4, ".png") != 0)
        throw std::runtime_error("'" + path + "' is not the name of a picture: write NAME.png");
}

// ---- show, save

void show(Shell& shell, const Words&) {
    const Terminal terminal = Terminal::detect();
    if (!terminal.isTerminal)
        throw std::runtime_error("the output is no terminal: write the picture by 'save NAME.png'");
    const Image image = shell.makeVisualizer()->drawFrame(shell.updSession().getState());
    std::fputs(drawTerminalPicture(image, terminal).c_str(), stdout);
}

void save(Shell& shell, const Words& words) {
    checkPng(words[0]);
    checkReplaceable(words[0], "\x89PNG", "picture");
    const SimTK::State& state = shell.updSession().getState();
    const Image image = shell.makeVisualizer()->drawFrame(state);
    image.writePng(words[0]);
    writeOut("%s: %d x %d pixels\n", words[0].c_str(), image.getWidth(), image.getHeight());
}

// ---- camera

double calcAngle(const Shell& shell, const std::string& text) {
    const double angle = shell.calcNumber(text);
    if (std::abs(angle) > 2 * SimTK::Pi + 1e-9)
        throw std::runtime_error("angles are in radians, and " + text +
                                 " is more than a whole turn: degrees are written " + text +
                                 "*deg");
    return angle;
}

void setDirection(Shell& shell, const Words& words) {
    std::optional<SimTK::Vec2>& direction = shell.updPictureSettings().camera.direction;
    if (words.size() == 3) {
        direction = SimTK::Vec2(calcAngle(shell, words[1]), calcAngle(shell, words[2]));
        return;
    }
    if (words.size() < 2)
        throw std::runtime_error(
            "the direction is missing: write 'camera view front', or two angles");
    const NamedView& view = findNamed(getNamedViews(), "view", words[1]);
    direction = SimTK::Vec2(view.azimuth, view.elevation);
}

void setFollowed(Shell& shell, const Words& words) {
    if (words.size() < 2)
        throw std::runtime_error("the frame is missing: write 'camera follow FRAME', or 'none'");
    PictureSettings::Camera& camera = shell.updPictureSettings().camera;
    if (words[1] == "none") {
        camera.followedFrame.clear();
        return;
    }
    shell.updSession().getModel().findFrame(words[1]);  // throws for an unknown frame
    const double size = words.size() > 2 ? shell.calcNumber(words[2]) : 0;
    if (size < 0) throw std::runtime_error("the height of the view must be positive");
    camera.followedFrame = words[1];
    camera.followedSize = size;
}

const Names CameraWords = {"view",        "orbit",        "zoom", "follow",
                           "perspective", "orthographic", "reset"};

void setCamera(Shell& shell, const Words& words) {
    PictureSettings::Camera& camera = shell.updPictureSettings().camera;
    const std::string& what = words[0];
    if (what == "view") return setDirection(shell, words);
    if (what == "follow") return setFollowed(shell, words);
    const size_t most = what == "zoom" ? 2 : what == "orbit" ? 3 : 1;
    if (words.size() > most) throw std::runtime_error("'" + words[most] + "' is too much");
    if (what == "zoom") {
        const double zoom = words.size() > 1 ? shell.calcNumber(words[1]) : 1;
        if (!(zoom > 0)) throw std::runtime_error("the zoom must be positive");
        camera.zoom = zoom;
    } else if (what == "orbit") {
        if (words.size() < 2)
            throw std::runtime_error("the angle is missing: write 'camera orbit 30*deg'");
        SimTK::Vec2 direction =
            camera.direction.value_or(SimTK::Vec2(25 * SimTK::Pi / 180, 16 * SimTK::Pi / 180));
        direction[0] += calcAngle(shell, words[1]);
        if (words.size() > 2) direction[1] += calcAngle(shell, words[2]);
        camera.direction = direction;
    } else if (what == "perspective") {
        camera.projection = CameraView::Projection::Perspective;
    } else if (what == "orthographic") {
        camera.projection = CameraView::Projection::Orthographic;
    } else if (what == "reset") {
        camera = {};
    } else {
        throw std::runtime_error(describeUnknown("setting of the camera", what, CameraWords));
    }
}

Names completeCamera(const Shell& shell, const Words& before, const std::string&) {
    if (before.empty()) return CameraWords;
    Names names;
    if (before.size() == 1 && before[0] == "view") names = getNames(getNamedViews());
    if (before.size() == 1 && before[0] == "follow" && shell.hasSession()) {
        names.push_back("none");
        for (const Model::BodyEntry& body : shell.updSession().getModel().getBodies())
            names.push_back(body.name);
    }
    return names;
}

// ---- exaggerate, contour

void exaggerate(Shell& shell, const Words& words) {
    const double factor = words[0] == "auto" ? 0 : shell.calcNumber(words[0]);
    if (words[0] != "auto" && !(factor > 0))
        throw std::runtime_error("the factor must be positive, or 'auto'");
    shell.updPictureSettings().exaggeration = factor;
}

void setContour(Shell& shell, const Words& words) {
    std::optional<Contour>& contour = shell.updPictureSettings().contour;
    const std::optional<Contour> before = contour;
    contour = findNamed(getNamedContours(), "contour", words[0]).contour;
    try {
        if (shell.hasSession()) shell.makeVisualizer();  // throws for stress that a part lacks
    } catch (...) {
        contour = before;
        throw;
    }
}

// ---- draw

void draw(Shell& shell, const Words& words) {
    findNamed(getDrawings(), "thing to draw", words[0]);  // throws for an unknown item
    const std::string wish = words.size() > 1 ? words[1] : "on";
    if (wish != "on" && wish != "off")
        throw std::runtime_error("write 'draw " + words[0] + " on' or 'off', not '" + wish + "'");
    shell.updPictureSettings().shown[words[0]] = wish == "on";
}

// ---- plot

struct PlotRequest {
    Names names;
    double from = -std::numeric_limits<double>::infinity();
    double to = std::numeric_limits<double>::infinity();
    std::string file;
};

PlotRequest readPlot(const Shell& shell, const Words& words) {
    PlotRequest request;
    for (size_t i = 0; i < words.size(); ++i) {
        const std::string& word = words[i];
        if (word != "from" && word != "to" && word != "into") {
            request.names.push_back(word);
            continue;
        }
        if (++i == words.size())
            throw std::runtime_error("a value is missing after '" + word + "'");
        if (word == "into")
            request.file = words[i];
        else
            (word == "from" ? request.from : request.to) = shell.calcNumber(words[i]);
    }
    if (request.names.empty()) throw std::runtime_error("name a probe");
    if (!(request.from < request.to)) throw std::runtime_error("'from' must be before 'to'");
    return request;
}

/** Returns the recorded history in the form that `simflex run` writes. **/
Results::Analysis makeAnalysis(const Session& session) {
    Results::Analysis analysis;
    analysis.name = "record";
    analysis.type = "transient";
    analysis.time = session.getRecord().time;
    size_t first = 0;
    for (const Probe& probe : session.getProbes()) {
        Results::Series series{{probe.name, probe.unit, probe.columns}, {}};
        for (const std::vector<double>& row : session.getRecord().rows)
            series.rows.emplace_back(row.begin() + long(first),
                                     row.begin() + long(first + probe.columns.size()));
        first += probe.columns.size();
        analysis.probes.push_back(std::move(series));
    }
    return analysis;
}

std::vector<TerminalCurve> collectCurves(const Results::Analysis& record,
                                         const PlotRequest& request) {
    std::vector<TerminalCurve> curves;
    for (const std::string& name : request.names)
        for (const ChosenColumn& column : chooseColumns(record, {name})) {
            TerminalCurve curve{column.name, column.unit, {}, {}};
            for (size_t row = 0; row < record.time.size(); ++row) {
                if (record.time[row] < request.from || record.time[row] > request.to) continue;
                curve.time.push_back(record.time[row]);
                curve.values.push_back(column.values[row]);
            }
            curves.push_back(std::move(curve));
        }
    if (curves[0].time.size() < 2)
        throw std::runtime_error("nothing is recorded there yet: 'run' first");
    return curves;
}

void plot(Shell& shell, const Words& words) {
    const PlotRequest request = readPlot(shell, words);
    const Session& session = shell.updSession();
    const Results::Analysis rows = makeAnalysis(session);
    const std::vector<TerminalCurve> curves = collectCurves(rows, request);
    if (request.file.empty()) {
        std::fputs(drawTerminalPlot(curves, Terminal::detect()).c_str(), stdout);
        return;
    }
    FigureWishes wishes;
    wishes.probes = request.names;
    wishes.from = request.from;
    wishes.to = request.to;
    Figure figure = makeResultFigure({{"", &rows}}, wishes);
    figure.title = session.getTitle();
    drawFigure(request.file, figure);
    writeOut("%s\n", request.file.c_str());
}

Names completePlot(const Shell& shell, const Words& before, const std::string& word) {
    if (!before.empty() && before.back() == "into")
        return completePath(word, {".png", ".svg", ".pdf"});
    if (!shell.hasSession()) return {};
    Names names = getNames(shell.updSession().getProbes());
    for (const Probe& probe : shell.updSession().getProbes())
        for (const std::string& column : probe.columns)
            if (!column.empty()) names.push_back(probe.name + '.' + column);
    if (!before.empty()) names.insert(names.end(), {"from", "to", "into"});
    return names;
}

// ---- video

void film(Shell& shell, const Words& words) {
    constexpr int mostFrames = 100000;
    Session& session = shell.updSession();
    const ModelValue pictures = session.getModel().getFile().get("pictures");
    const double seconds = shell.calcNumber(words[1]),
                 slowMotion = words.size() > 2 ? shell.calcNumber(words[2])
                                               : pictures.get("slow_motion").getNumber();
    if (!(seconds > 0)) throw std::runtime_error("the duration of the video must be positive");
    if (!(slowMotion > 0)) throw std::runtime_error("the slow motion must be positive");
    const double wanted = std::ceil(seconds * slowMotion * pictures.get("rate").getNumber());
    if (wanted > mostFrames)
        throw std::runtime_error("these are " + formatNumber(wanted) + " pictures, more than " +
                                 std::to_string(mostFrames));
    const int numFrames = std::max(1, int(wanted));
    OffscreenVisualizer visualizer = *shell.makeVisualizer();
    addVideo(session.getModel(), words[0], visualizer);  // throws for an unsupported format

    MotionRecorder motion(session.getModel().getSystem());
    motion.record(session.getState());
    const double begin = session.getTime();
    const std::string phase = "to t = " + formatNumber(begin + seconds) + " s";
    ProgressBar bar(!shell.showsProgress(), {{phase, 1}});
    Session::Outcome outcome = Session::Outcome::ReachedTime;
    for (int frame = 1; frame <= numFrames && outcome == Session::Outcome::ReachedTime; ++frame) {
        const double time = begin + seconds * frame / numFrames;
        outcome = session.runTo(time, time - session.getTime(), [&](double fraction) {
            return bar.show(phase, (frame - 1 + fraction) / numFrames);
        });
        if (outcome != Session::Outcome::Stopped) motion.record(session.getState());
    }
    bar.clear();
    if (outcome == Session::Outcome::Stopped)
        throw Cancelled("the time is " + formatNumber(session.getTime()) + " s; there is no video");
    if (!drawMotion(session.getModel(), motion, makeAnalysis(session), visualizer,
                    shell.makeListener()))
        throw Cancelled("the time is " + formatNumber(session.getTime()) + " s; there is no video");
    writeOut("%s: %d pictures, t = %s s\n", words[0].c_str(), motion.getNumStates(),
             formatNumber(session.getTime()).c_str());
}

}  // namespace

void addPictureCommands(std::vector<Command>& commands) {
    const std::string group = "Pictures and plots";
    commands.push_back(
        {group, "plot", "PROBE ... [from TIME] [to TIME] [into FILE]",
         "Plot probes, or their components such as 'slider.x', in the terminal or into a file",
         "Files are drawn as by 'simflex plot': .png, .svg or .pdf.", 1, 1000, plot, completePlot});
    commands.push_back({group,
                        "show",
                        "",
                        "Show the model in the terminal",
                        "For terminals with kitty's graphics: kitty, WezTerm, Ghostty, Konsole; "
                        "elsewhere use 'save'.",
                        0,
                        0,
                        show,
                        {}});
    commands.push_back({group, "save", "FILE.png", "Write the picture to a file", "", 1, 1, save,
                        completeFile({".png"})});
    commands.push_back({group, "camera",
                        "view | orbit | zoom | follow | perspective | orthographic | reset ...",
                        "Place the camera of 'show', 'save' and 'video'",
                        "view NAME (front, back, left, right or side, top, bottom, isometric), "
                        "view AZIMUTH ELEVATION,\n"
                        "orbit ANGLE [ANGLE] from where it stands, angles as 30*deg or in radians; "
                        "zoom FACTOR, follow FRAME [HEIGHT],\n"
                        "follow none, "
                        "perspective, orthographic, reset: the model file's camera again.",
                        1, 3, setCamera, completeCamera});
    commands.push_back(
        {group, "video", "FILE SECONDS [SLOW_MOTION]",
         "Run on for some seconds and make a video of it (.mp4, .gif or .webp)",
         "Rate, slow motion and plots are those of 'pictures' in the model file; SLOW_MOTION is "
         "how many\nseconds of video make a second of the motion. Ctrl-C keeps the state reached.",
         2, 3, film, completeFile({".mp4", ".gif", ".webp"})});
    commands.push_back({group, "draw", "THING [on | off]", "Show or hide something in pictures",
                        "joints, connectors, loads, reactions, ghost, wireframe, axes, shadows, "
                        "ambient_occlusion.",
                        1, 2, draw, [](const Shell&, const Words& before, const std::string&) {
                            return before.empty() ? getNames(getDrawings()) : Names{"on", "off"};
                        }});
    commands.push_back(
        {group, "exaggerate", "FACTOR | auto", "Draw deformations this many times larger", "", 1, 1,
         exaggerate, [](const Shell&, const Words&, const std::string&) { return Names{"auto"}; }});
    commands.push_back(
        {group, "contour", "NAME", "Choose what the colors show",
         "Displacements, velocities or strain energy; stress, of parts reduced with --stress.", 1,
         1, setContour, [](const Shell&, const Words&, const std::string&) {
             return getNames(getNamedContours());
         }});
}

}  // namespace cli
}  // namespace simflex
