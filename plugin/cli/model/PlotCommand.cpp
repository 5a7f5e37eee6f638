/** @file
simflex plot: plots probes over time, natural frequencies and Campbell diagrams. **/

#include <cstdio>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <tuple>

#include "simflex/base/Utf8.h"
#include "simflex/cli/Commands.h"
#include "simflex/cli/Messages.h"
#include "simflex/cli/Options.h"
#include "simflex/model/results/ProbeChoice.h"
#include "simflex/model/results/ResultFigure.h"
#include "simflex/model/sweep/SweepResults.h"

namespace simflex {
namespace cli {

using namespace model;
namespace {

namespace fs = std::filesystem;

struct PlotArguments {
    std::vector<std::string> names;  ///< result files, then probes
    std::string output, analysis, title, size;
    FigureWishes wishes;
    std::string csv;
    bool together = false, stacked = false, hasTitle = false;
    bool spectrum = false, waterfall = false, map = false;
};

/** Arguments with a result file's extension or naming an existing file are result files; the others
are probes. **/
bool isResultFile(const std::string& name) {
    const std::string extension = fs::path(name).extension().string();
    return extension == ".h5" || extension == ".hdf5" || fs::is_regular_file(name);
}

/** Replaces results by the curves of a sweep's table. **/
void takeSweep(const std::vector<std::string>& paths, PlotArguments& arguments,
               std::vector<std::string>& labels, std::vector<Results>& results) {
    if (paths.size() > 1)
        throw std::runtime_error("'" + paths[0] + "' is the table of a sweep: it is drawn alone");
    SweepResults sweep = readSweepTable(paths[0], arguments.wishes.xProbe);
    arguments.wishes.xProbe = sweep.key;
    arguments.wishes.hasPoints = true;
    labels = std::move(sweep.labels);
    results = std::move(sweep.results);
}

/** Replaces a sweep's table by the results of its cases. **/
void takeCases(std::vector<std::string>& paths, PlotArguments& arguments,
               std::vector<FigureSource>& sources, std::vector<Results>& results) {
    if (paths.size() != 1 || !isSweepTable(paths[0]))
        throw std::runtime_error("--map is of one sweep: name its folder or its sweep.h5");
    const SweepCases cases = listSweepCases(paths[0], arguments.wishes.xProbe);
    arguments.wishes.mapOver = cases.key;
    arguments.wishes.xProbe.clear();
    for (const std::string& path : cases.paths)
        results.push_back(readResults(path, ReadStates::No));
    for (size_t k = 0; k < results.size(); ++k) {
        std::string analysis = arguments.analysis;
        for (const Results::Analysis& other : results[k].analyses)
            if (analysis.empty() && other.type == "frequency_response") analysis = other.name;
        sources.push_back(
            {"", &chooseAnalysis(results[k], cases.paths[k], analysis), cases.values[k]});
    }
}

void runPlot(PlotArguments& arguments) {
    std::vector<std::string> paths;
    for (const std::string& name : arguments.names) {
        const fs::path table = fs::path(name) / "sweep.h5";
        if (isResultFile(name)) {
            paths.push_back(name);
        } else if (fs::is_regular_file(table)) {  // the folder of a sweep
            paths.push_back(table.string());
        } else {
            arguments.wishes.probes.push_back(name);
        }
    }
    if (paths.empty())
        throw std::runtime_error("no result file is named (RESULTS.h5, as 'simflex run' makes it)");
    if (arguments.together && arguments.stacked)
        throw std::runtime_error("--together and --stacked exclude each other");
    if (arguments.together) arguments.wishes.panels = FigureWishes::Panels::Together;
    if (arguments.stacked) arguments.wishes.panels = FigureWishes::Panels::Stacked;

    if (arguments.spectrum && arguments.waterfall)
        throw std::runtime_error("--spectrum and --waterfall exclude each other");
    if (arguments.spectrum) arguments.wishes.vibration = FigureWishes::Vibration::Spectrum;
    if (arguments.waterfall) arguments.wishes.vibration = FigureWishes::Vibration::Waterfall;

    std::vector<std::string> labels = makeFileLabels(paths);
    std::vector<Results> results;
    std::vector<FigureSource> sources;
    if (arguments.map) {
        takeCases(paths, arguments, sources, results);
    } else if (isSweepTable(paths[0])) {
        takeSweep(paths, arguments, labels, results);
    } else {
        for (const std::string& path : paths) results.push_back(readResults(path, ReadStates::No));
    }
    for (size_t k = 0; k < results.size() && !arguments.map; ++k)
        sources.push_back(
            {labels[k],
             &chooseAnalysis(results[k], paths.at(paths.size() > 1 ? k : 0), arguments.analysis)});
    Figure figure = makeResultFigure(sources, arguments.wishes);
    figure.title = arguments.hasTitle ? arguments.title : results[0].header.title;
    if (!arguments.size.empty())
        std::tie(figure.width, figure.height) = readSize(arguments.size, {200, 150}, 10000);
    const std::string output =
        arguments.output.empty() ? fs::path(paths[0]).stem().string() + ".png" : arguments.output;
    for (const std::string& warning : arguments.wishes.warnings)
        std::fprintf(stderr, "warning: %s\n", makePrintable(warning).c_str());
    drawFigure(output, figure);
    writeOut("%s\n", output.c_str());
    if (arguments.csv.empty()) return;
    writeFigureCsv(arguments.csv, figure);
    writeOut("%s\n", arguments.csv.c_str());
}

}  // namespace

void addPlotCommand(CLI::App& app) {
    const auto arguments = std::make_shared<PlotArguments>();
    CLI::App* plot =
        app.add_subcommand("plot", "Plot probes, spectra and natural frequencies of result files");
    plot->footer(
        "Probes share a panel with those of the same unit and size. A result that is still being "
        "written "
        "can be\n"
        "drawn. Times may not be evenly spaced; long runs are thinned to their extremes.\n\n"
        "  simflex plot run.h5 'slider*' tip.x -o slider.pdf\n"
        "  simflex plot flexible.h5 rigid.h5 slider.x --from 0.05 --title 'Slider'\n"
        "  simflex plot run.h5 --analysis campbell --orders 1,2\n"
        "  simflex plot run.h5 bearing.y --spectrum --from 0.5 --highest 400\n"
        "  simflex plot run_up.h5 bearing.y --waterfall --speed spin --orders 1,2\n"
        "  simflex plot run_up.h5 bearing.y --speed spin --orders 1,2   (their amplitudes)\n"
        "  simflex plot run.h5 tip.y --analysis response          (Bode diagram of an output)\n"
        "  simflex plot run.h5 tip.y --analysis response --nyquist\n"
        "  simflex plot rotor.sweep tip.y --map --orders 1          (over the swept speed)\n"
        "  simflex plot crank.sweep/sweep.h5 tip.x.maximum --x speed   (columns of a sweep over "
        "a parameter)");
    plot->add_option("RESULTS.h5", arguments->names,
                     "Result files (several are overlaid), then probes: names or patterns such as\n"
                     "'slider*' (default: all)")
        ->required();
    plot->add_option(
        "-o,--output", arguments->output,
        "Figure to write, .png, .svg or .pdf (default: RESULTS.png in the current folder)");
    plot->add_option("--analysis", arguments->analysis,
                     "Analysis to plot (default: the first transient one)");
    plot->add_option("--from", arguments->wishes.from, "First time [s] or frequency [Hz] shown");
    plot->add_option("--to", arguments->wishes.to, "Last time [s] or frequency [Hz] shown");
    plot->add_option(
        "--x", arguments->wishes.xProbe,
        "Probe along the horizontal axis instead of time; a parameter, for the table of a sweep");
    plot->add_option("--orders", arguments->wishes.orders,
                     "Orders 1,2,… of a speed: lines in a Campbell diagram or waterfall;\n"
                     "with --speed alone the amplitudes of the probes at these orders")
        ->delimiter(',');
    plot->add_flag("--spectrum", arguments->spectrum,
                   "Plot amplitudes over frequency (Hann window)");
    plot->add_flag("--waterfall", arguments->waterfall,
                   "Plot spectra of pieces of the motion, over a speed or over time");
    plot->add_option("--speed", arguments->wishes.speedProbe,
                     "Probe that measures the speed [rad/s], such as {rate: JOINT}");
    plot->add_option("--highest", arguments->wishes.highest, "Highest frequency shown [Hz]")
        ->check(CLI::PositiveNumber);
    plot->add_option("--pieces", arguments->wishes.numPieces, "Number of pieces of a waterfall")
        ->check(CLI::Range(2, 2000))
        ->capture_default_str();
    plot->add_option("--revolutions", arguments->wishes.revolutions,
                     "Revolutions in a piece from which amplitudes of orders are found")
        ->check(CLI::PositiveNumber)
        ->capture_default_str();
    plot->add_flag("--nyquist", arguments->wishes.isNyquist,
                   "Plot imaginary over real parts of responses");
    plot->add_flag(
        "--map", arguments->map,
        "Plot magnitude and phase of a sweep's responses over frequency and the parameter");
    plot->add_option("--csv", arguments->csv, "Write the figure's numbers to this file as well")
        ->type_name("FILE.csv");
    plot->add_option("--size", arguments->size,
                     "Size of the figure [pixels], WIDTHxHEIGHT, 96 pixels an inch");
    plot->add_option("--title", arguments->title, "Title (default: that of the model; '' for none)")
        ->each([arguments](const std::string&) { arguments->hasTitle = true; });
    plot->add_flag("--together", arguments->together, "Put all curves into one panel");
    plot->add_flag("--stacked", arguments->stacked, "Give each probe a panel of its own");
    plot->callback([arguments] { runPlot(*arguments); });
}

}  // namespace cli
}  // namespace simflex
