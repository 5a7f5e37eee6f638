/** @file
simflex modes: animated pictures of a part's mode shapes and a contact sheet of all of them. **/

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>

#include "simflex/base/AsciiText.h"
#include "simflex/base/Interruption.h"
#include "simflex/base/NumberText.h"
#include "simflex/base/Progress.h"
#include "simflex/body/StateCopy.h"
#include "simflex/cli/Commands.h"
#include "simflex/cli/Messages.h"
#include "simflex/cli/Options.h"
#include "simflex/cli/ProgressBar.h"
#include "simflex/cli/part/PartView.h"
#include "simflex/part/Frequency.h"
#include "simflex/part/ReducedBodyFile.h"
#include "simflex/render/ContactSheet.h"
#include "simflex/render/SurfaceMesh.h"
#include "simflex/render/Video.h"

namespace simflex {
namespace cli {
namespace {

namespace fs = std::filesystem;

constexpr int FramesPerPeriod = 24, PeriodsOfVideo = 3;  // videos do not loop
constexpr double FramesPerSecond = 20;
constexpr int SheetColumns = 4;
constexpr double UsualScale = 0.06;      // largest drawn displacement relative to the part's size
constexpr double SteepestDrawing = 0.5;  // difference of displacements along an edge, relative to
                                         // its length

struct ModesArguments {
    std::string part, folder, modes = "1-12", size = "960x640";
    double scale = 0;
    bool gif = false, mp4 = false, quiet = false;
};

/** Parses mode numbers (from 1), in the given order, from "1-6,9" or "all".
@throws CLI::ValidationError if the form is wrong.
@throws std::runtime_error if a mode does not exist. **/
std::vector<int> parseModes(const std::string& text, const ReducedBody& part, bool isDefault) {
    std::vector<int> modes;
    if (text == "all" || isDefault) {
        const int last = isDefault ? std::min(12, part.numModes) : part.numModes;
        for (int mode = 1; mode <= last; ++mode) modes.push_back(mode);
        if (modes.empty()) throw std::runtime_error("part '" + part.name + "' has no modes");
        return modes;
    }
    const std::string usage = "'" + text + "' is not a list of modes such as 1-6,9 or all";
    for (const std::string& item : splitAt(text, ',')) {
        const std::vector<std::string> ends = splitAt(item, '-');
        int first = 0, last = 0;
        if (ends.size() > 2 || !readInteger(ends.front(), first) ||
            !readInteger(ends.back(), last) || first > last || first < 1)
            throw CLI::ValidationError("--modes", usage);
        if (last > part.numModes)
            throw std::runtime_error("part '" + part.name + "' has no mode " +
                                     std::to_string(last) + "; it has modes 1 to " +
                                     std::to_string(part.numModes));
        for (int mode = first; mode <= last; ++mode)
            if (std::find(modes.begin(), modes.end(), mode) == modes.end()) modes.push_back(mode);
    }
    return modes;
}

/** Largest displacement of a mode and its steepest change along an edge of the skin, for ξ = 1. **/
struct ModeSize {
    double displacement = 0, slope = 0;
};

ModeSize measureMode(const ReducedBody& part, const SurfaceMesh& skin, int mode) {
    const double* Phi = part.Phi.data() + 3 * size_t(part.mesh.numNodes()) * size_t(mode - 1);
    const auto vectorAt = [](const double* all, int node) {
        return SimTK::Vec3(all[3 * node], all[3 * node + 1], all[3 * node + 2]);
    };
    ModeSize size;
    for (int node = 0; node < part.mesh.numNodes(); ++node)
        size.displacement = std::max(size.displacement, vectorAt(Phi, node).norm());
    std::vector<double> slopes;
    for (const auto& [a, b] : skin.elementEdges) {
        const int i = skin.nodes[size_t(a)], j = skin.nodes[size_t(b)];
        const double* s = part.mesh.positions.data();
        const double length = (vectorAt(s, i) - vectorAt(s, j)).norm();
        if (length > 0) slopes.push_back((vectorAt(Phi, i) - vectorAt(Phi, j)).norm() / length);
    }
    if (slopes.empty()) return size;
    // Allow a few sharp corners to be steeper.
    const auto steep = slopes.begin() + std::ptrdiff_t(0.98 * double(slopes.size() - 1));
    std::nth_element(slopes.begin(), steep, slopes.end());
    size.slope = *steep;
    return size;
}

/** Returns the ξ with which a mode is drawn. **/
double chooseAmplitude(const ReducedBody& part, const ModeSize& size, double scale) {
    const double wanted = (scale > 0 ? scale : UsualScale) * 2 * part.calcRadius();
    const double amplitude = size.displacement > 0 ? wanted / size.displacement : 0;
    if (scale > 0 || !(size.slope > 0)) return amplitude;
    return std::min(amplitude, SteepestDrawing / size.slope);
}

/** Crops all pictures to a common rectangle that contains everything non-white in any of them. **/
void cropTogether(std::vector<Image>& pictures) {
    const int width = pictures[0].getWidth(), height = pictures[0].getHeight();
    int left = width, right = -1, top = height, bottom = -1;
    for (const Image& picture : pictures)
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x) {
                const std::uint8_t* pixel =
                    picture.getData() + 4 * (size_t(y) * size_t(width) + size_t(x));
                if (pixel[0] == 255 && pixel[1] == 255 && pixel[2] == 255) continue;
                left = std::min(left, x);
                right = std::max(right, x);
                top = std::min(top, y);
                bottom = std::max(bottom, y);
            }
    if (right < left) return;
    constexpr int gap = 16;
    for (Image& picture : pictures) {
        Image cut(right - left + 1 + 2 * gap, bottom - top + 1 + 2 * gap);
        cut.paste(picture, gap - left, gap - top);
        picture = std::move(cut);
    }
}

class ModePainter {
public:
    ModePainter(std::shared_ptr<const ReducedBody> part, std::vector<int> modes,
                std::pair<int, int> size, double scale)
        : m_part(std::move(part)),
          m_modes(std::move(modes)),
          m_hertz(calcFrequencies(*m_part)),
          m_visualizer(m_empty.system, size.first, size.second) {
        const SurfaceMesh skin = extractSurface(m_part->mesh);
        for (const int mode : m_modes) {
            m_sizes.push_back(measureMode(*m_part, skin, mode));
            m_amplitudes.push_back(chooseAmplitude(*m_part, m_sizes.back(), scale));
        }
        choosePartView(m_visualizer, *m_part);
        m_visualizer.setShowSimTime(false)
            .setShowColorBar(false)
            .setShowDeformationFactor(false)
            .setDeformationFactor(1)
            .setShowUndeformed(false)
            .setBackgroundType(SimTK::Visualizer::SolidColor)
            .addDeformableMesh({m_part, m_part->name,
                                [](const SimTK::State&) { return SimTK::Transform(); },
                                [this](const SimTK::State& state) { return calcXi(state); }});
        std::vector<SimTK::State> extremes;
        for (size_t k = 0; k < m_modes.size(); ++k)
            for (const int frame : {FramesPerPeriod / 4, 3 * FramesPerPeriod / 4})
                extremes.push_back(makeState(k, frame));
        m_visualizer.setWindowTitle(" ");  // reserves room for a title
        m_visualizer.fitToMotion(extremes);
    }

    std::string describe(size_t k) const {
        return "mode " + std::to_string(m_modes[k]) + "   " +
               formatFrequency(m_hertz[size_t(m_modes[k] - 1)]);
    }

    Image draw(size_t k, int frame, const std::string& title) {
        const double largest = m_amplitudes[k] * m_sizes[k].displacement;
        if (largest > 0) m_visualizer.setContourRange(0, largest);
        m_visualizer.setWindowTitle(title).setShowAxes(!title.empty());
        return m_visualizer.drawFrame(makeState(k, frame));
    }

private:
    /** A frame is identified by its time: index of the mode, then frame of its period. **/
    SimTK::State makeState(size_t k, int frame) const {
        SimTK::State state = copyState(m_empty.state);
        state.setTime(double(k * FramesPerPeriod + size_t(frame % FramesPerPeriod)));
        return state;
    }

    SimTK::Vector calcXi(const SimTK::State& state) const {
        const size_t number = size_t(std::lround(state.getTime()));
        const size_t k = number / FramesPerPeriod;
        SimTK::Vector xi(m_part->numModes, 0.0);
        xi[m_modes[k] - 1] =
            m_amplitudes[k] *
            std::sin(2 * SimTK::Pi * double(number % FramesPerPeriod) / FramesPerPeriod);
        return xi;
    }

    std::shared_ptr<const ReducedBody> m_part;
    std::vector<int> m_modes;
    std::vector<double> m_hertz;
    std::vector<ModeSize> m_sizes;
    std::vector<double> m_amplitudes;
    EmptySystem m_empty;
    OffscreenVisualizer m_visualizer;
};

/** Returns the first identical frame of a period: sin(π − x) = sin x. **/
int findTwin(int frame) {
    constexpr int quarter = FramesPerPeriod / 4;
    if (frame > quarter && frame <= 2 * quarter) return 2 * quarter - frame;
    if (frame > 3 * quarter) return 6 * quarter - frame;
    return frame;
}

void runModes(const ModesArguments& arguments, bool areModesDefault) {
    auto part = std::make_shared<const ReducedBody>(readReducedBody(arguments.part));
    const std::vector<int> modes = parseModes(arguments.modes, *part, areModesDefault);
    const std::pair<int, int> size = readSize(arguments.size, {64, 64}, 8192);
    const bool isVideoWanted = arguments.gif || arguments.mp4;
    if (isVideoWanted && !isVideoAvailable())
        throw std::runtime_error("--gif and --mp4 need the program ffmpeg (apt install ffmpeg)");
    std::vector<std::string> suffixes;
    if (arguments.gif) suffixes.push_back(".gif");
    if (arguments.mp4 || (!isVideoWanted && isVideoAvailable())) suffixes.push_back(".mp4");
    if (part->mesh.elements.empty())
        throw std::runtime_error("part '" + part->name +
                                 "' has no elements in its mesh, so there is nothing to draw");

    const fs::path folder = arguments.folder.empty()
                                ? fs::path(arguments.part).stem().string() + "_modes"
                                : arguments.folder;
    std::error_code error;
    fs::create_directories(folder, error);
    if (error || !fs::is_directory(folder) || access(folder.c_str(), W_OK) != 0)
        throw std::runtime_error("cannot write to the folder '" + folder.string() + "'" +
                                 (error ? ": " + error.message() : ""));

    ModePainter painter(part, modes, size, arguments.scale);
    std::vector<std::pair<std::string, double>> phases;
    for (size_t k = 0; k < modes.size(); ++k) phases.emplace_back(painter.describe(k), 1);
    ProgressBar bar(arguments.quiet, phases);
    std::vector<Image> pictures;
    std::vector<std::string> captions;
    const auto finishSheet = [&] {
        bar.clear();
        if (pictures.empty()) return;
        cropTogether(pictures);
        makeContactSheet(pictures, captions, SheetColumns)
            .writePng((folder / "contact_sheet.png").string());
    };
    try {
        for (size_t k = 0; k < modes.size(); ++k) {
            const std::string stem = "mode_" + formatModeNumber(modes[k], part->numModes);
            if (!suffixes.empty()) {
                VideoOptions options;
                options.framesPerSecond = FramesPerSecond;
                std::vector<std::unique_ptr<VideoWriter>> videos;
                for (const std::string& suffix : suffixes)
                    videos.push_back(std::make_unique<VideoWriter>(
                        (folder / (stem + suffix)).string(), options));
                std::vector<Image> period(FramesPerPeriod);
                for (int frame = 0; frame < FramesPerPeriod; ++frame) {
                    if (!bar.show(painter.describe(k), double(frame) / (FramesPerPeriod + 6)))
                        throw Cancelled();
                    const int twin = findTwin(frame);
                    Image& image = period[size_t(frame)];
                    image = twin < frame ? period[size_t(twin)]
                                         : painter.draw(k, frame, painter.describe(k));
                    for (const auto& video : videos) video->write(image);
                }
                for (size_t v = 0; v < videos.size(); ++v) {
                    if (suffixes[v] == ".mp4")
                        for (int again = 1; again < PeriodsOfVideo; ++again)
                            for (const Image& image : period) videos[v]->write(image);
                    videos[v]->finish();
                }
            }
            if (!bar.show(painter.describe(k), 1)) throw Cancelled();
            pictures.push_back(painter.draw(k, FramesPerPeriod / 4, ""));
            captions.push_back(painter.describe(k));
        }
    } catch (const std::exception&) {
        if (!wasInterrupted()) throw;
        finishSheet();
        throw Cancelled(std::to_string(pictures.size()) + " of " + std::to_string(modes.size()) +
                        " modes are in '" + folder.string() + "'");
    }
    finishSheet();
    if (arguments.quiet) return;
    if (suffixes.empty())
        makeListener(false).tellNote("no program ffmpeg here: a contact sheet only");
    writeOut("%s: %zu modes -> %s\n", part->name.c_str(), modes.size(),
             (folder / "contact_sheet.png").c_str());
}

}  // namespace

void addModesCommand(CLI::App& app) {
    auto arguments = std::make_shared<ModesArguments>();
    CLI::App* command = app.add_subcommand(
        "modes", "Draw the mode shapes of a part: a short video of each and a contact sheet");
    command->add_option("PART", arguments->part, "Part file (.h5)")->required();
    command
        ->add_option("-o,--output", arguments->folder,
                     "Folder to write (default: PART_modes in the current folder)")
        ->type_name("FOLDER");
    const CLI::Option* modes =
        command
            ->add_option("-m,--modes", arguments->modes,
                         "Modes to draw, counted from 1: 1-6,9 or all (default: the lowest 12)")
            ->type_name("LIST");
    command
        ->add_option("--scale", arguments->scale,
                     "Largest displacement drawn, as a fraction of the part's size (default: 0.06, "
                     "less where a mode bends sharply)")
        ->check(CLI::Range(1e-6, 10.0));
    command->add_option("--size", arguments->size, "Width and height of a picture [pixels]")
        ->type_name("WxH")
        ->capture_default_str();
    command->add_flag("--mp4", arguments->mp4, "Write videos as MP4 (the default)");
    command->add_flag("--gif", arguments->gif,
                      "Write videos as animated GIF, which repeat endlessly");
    addQuietFlag(*command, arguments->quiet, "warnings");
    command->callback([arguments, modes] { runModes(*arguments, modes->count() == 0); });
}

}  // namespace cli
}  // namespace simflex
