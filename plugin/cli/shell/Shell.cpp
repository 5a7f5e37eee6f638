#include "simflex/cli/shell/Shell.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <stdexcept>

#include "simflex/base/InputFile.h"
#include "simflex/base/Interruption.h"
#include "simflex/base/Progress.h"
#include "simflex/base/Utf8.h"
#include "simflex/cli/Format.h"
#include "simflex/cli/Messages.h"
#include "simflex/cli/ProgressBar.h"
#include "simflex/model/file/Formula.h"
#include "simflex/model/file/NearestName.h"

namespace simflex {
namespace cli {

namespace {

constexpr int DeepestSource = 16;

std::vector<std::string> keepBeginnings(const std::vector<std::string>& words,
                                        const std::string& begin) {
    std::vector<std::string> kept;
    for (const std::string& word : words)
        if (word.compare(0, begin.size(), begin) == 0) kept.push_back(word);
    return kept;
}

}  // namespace

Shell::Shell(const ShellOptions& options) : m_options(options) {}

Shell::~Shell() = default;

int Shell::runPrompt() {
    m_editor =
        std::make_unique<LineEditor>("simflex> ", LineEditor::findHistoryFile(),
                                     [this](const std::string& text) { return complete(text); });
    std::string line;
    while (!m_isOver) {
        const LineEditor::Outcome outcome = m_editor->readLine(line);
        if (outcome == LineEditor::Outcome::Interrupted) continue;
        if (outcome == LineEditor::Outcome::End) {
            std::puts("");
            break;
        }
        try {
            run(line);
        } catch (const Cancelled& stopped) {
            writeOut("%s\n", stopped.what());
        } catch (const std::exception& error) {
            std::fflush(stdout);
            std::fprintf(stderr, "%s\n",
                         wasInterrupted() ? "stopped" : makePrintable(error.what()).c_str());
        }
        std::fflush(stdout);
    }
    return 0;
}

int Shell::runScript(std::istream& script, const std::string& name) {
    int status = 0, number = 0;
    for (std::string line; !m_isOver && std::getline(script, line);) {
        ++number;
        const std::string place = name + ":" + std::to_string(number) + ": ";
        const auto attempt = [&](const auto& work) {
            try {
                work();
            } catch (const Cancelled& stopped) {
                throw Cancelled(place + stopped.getKept());
            } catch (const std::exception& error) {
                if (wasInterrupted()) throw;
                if (m_options.onError == ShellOptions::OnError::Stop)
                    throw std::runtime_error(place + error.what());
                std::fflush(stdout);
                std::fprintf(stderr, "simflex: %s\n", makePrintable(place + error.what()).c_str());
                status = 1;
            }
        };
        std::vector<Words> commands;
        attempt([&] { commands = takeLine(line); });
        for (const Words& words : commands)
            if (!m_isOver) attempt([&] { runCommand(words); });
        std::fflush(stdout);
    }
    if (script.bad()) throw std::runtime_error("'" + name + "' cannot be read");
    return status;
}

void Shell::runFile(const std::string& path) {
    if (m_depth >= DeepestSource)
        throw std::runtime_error(
            "'" + path +
            "' would be read again by a file that it reads: remove one of the 'source' commands");
    std::ifstream file = openInputFile(path);
    if (!file.is_open()) throw std::runtime_error("'" + path + "' cannot be read");
    ++m_depth;
    const struct Leave {
        int& depth;
        ~Leave() { --depth; }
    } leave{m_depth};
    if (runScript(file, path) != 0) throw std::runtime_error("errors in '" + path + "'");
}

std::vector<Words> Shell::takeLine(const std::string& line) {
    if (!m_editor && line.find_first_not_of(" \t\r") != std::string::npos) m_lines.push_back(line);
    return splitCommands(line);
}

void Shell::run(const std::string& line) {
    for (const Words& words : takeLine(line)) {
        runCommand(words);
        if (m_isOver) return;
    }
}

void Shell::runCommand(const Words& words) {
    const Command& command = findCommand(words.front());
    const Words arguments(words.begin() + 1, words.end());
    const int count = int(arguments.size());
    if (count < command.fewestArguments || count > command.mostArguments) {
        const bool isLess = count < command.fewestArguments;
        throw std::runtime_error(
            command.name +
            (isLess ? ": an argument is missing"
                    : ": '" + arguments[size_t(command.mostArguments)] + "' is too much") +
            "; write: " + command.name +
            (command.arguments.empty() ? "" : " " + command.arguments));
    }
    try {
        command.run(*this, arguments);
        ProgressBar::clearLine();
    } catch (const Cancelled&) {
        throw;
    } catch (const std::exception& error) {
        throw std::runtime_error(command.name + ": " + error.what());
    }
}

Completion Shell::complete(const std::string& text) const {
    const UnfinishedCommand typed = splitUnfinished(text);
    if (typed.isComment) return {};
    Completion completion;
    completion.word = typed.word;
    completion.quote = typed.quote;
    if (typed.words.empty()) {
        for (const Command& command : getCommands()) completion.candidates.push_back(command.name);
    } else {
        try {
            const Command& command = findCommand(typed.words.front());
            if (command.complete)
                completion.candidates = command.complete(
                    *this, Words(typed.words.begin() + 1, typed.words.end()), typed.word);
        } catch (const std::exception&) {  // no proposals
            return {};
        }
    }
    completion.candidates = keepBeginnings(completion.candidates, typed.word);
    std::sort(completion.candidates.begin(), completion.candidates.end());
    return completion;
}

Session& Shell::updSession() const {
    if (!m_session) throw std::runtime_error("there is no model yet: open MODEL.yaml");
    return *m_session;
}

void Shell::open(const ModelText& text) {
    ModelOptions options = m_options.model;
    options.listener = makeListener();
    m_session = std::make_unique<Session>(text, options);
}

std::unique_ptr<OffscreenVisualizer> Shell::makeVisualizer() {
    const Session& session = updSession();
    std::unique_ptr<OffscreenVisualizer> visualizer = model::makeVisualizer(session.getModel());
    const PictureSettings::Camera& camera = m_pictures.camera;
    if (camera.direction || camera.zoom || !camera.followedFrame.empty() || camera.projection) {
        CameraView view;
        if (camera.direction) view.setDirection((*camera.direction)[0], (*camera.direction)[1]);
        if (camera.zoom) view.setZoom(*camera.zoom);
        if (!camera.followedFrame.empty())
            view.setFollowedFrame(session.getModel().findFrame(camera.followedFrame),
                                  camera.followedSize);
        if (camera.projection) view.setProjection(*camera.projection);
        visualizer->setCamera(view);
    }
    const std::optional<double>& exaggeration = m_pictures.exaggeration;
    if (exaggeration && *exaggeration > 0) visualizer->setDeformationFactor(*exaggeration);
    if (exaggeration && *exaggeration == 0) visualizer->setAutomaticDeformationFactor();
    if (m_pictures.contour) visualizer->setContour(*m_pictures.contour);
    for (const auto& [name, isShown] : m_pictures.shown)
        ((*visualizer).*findNamed(getDrawings(), "drawing", name).show)(isShown);
    visualizer->fitToMotion(session.getPath());
    return visualizer;
}

void Shell::printSummary() {
    const Session& session = updSession();
    writeOut("%s: %s, %s, %s; t = %g s\n", session.getTitle().c_str(),
             formatCount(session.getModel().getBodies().size(), "body", "bodies").c_str(),
             formatCount(session.getModel().getJoints().size(), "joint", "joints").c_str(),
             formatCount(session.getProbes().size(), "probe", "probes").c_str(), session.getTime());
}

bool Shell::showsProgress() const {
    return !m_options.isQuiet && isatty(STDERR_FILENO);
}

Listener Shell::makeListener() const {
    Listener listener = cli::makeListener(m_options.isQuiet);
    if (!showsProgress()) listener.progress = cli::makeListener(true).progress;
    return listener;
}

std::vector<std::string> Shell::getHistory() const {
    return m_editor ? m_editor->getHistory() : m_lines;
}

double Shell::calcNumber(const std::string& text) const {
    double value = 0;
    try {
        value = m_session ? calcConstant(m_session->getModel().getFile(), text)
                          : calcConstant(text, formula::Scope());
    } catch (const std::exception& error) {
        throw std::runtime_error("'" + text + "' is not a number: " + error.what());
    }
    if (!std::isfinite(value)) throw std::runtime_error("'" + text + "' is not finite");
    return value;
}

std::vector<double> Shell::calcNumbers(const std::string& text) const {
    std::vector<double> numbers;
    for (const std::string& item : splitList(text)) numbers.push_back(calcNumber(item));
    return numbers;
}

int Shell::calcCount(const std::string& text, int largest) const {
    const double value = calcNumber(text);
    if (value < 1 || value > largest || value != std::floor(value))
        throw std::runtime_error("'" + text + "' is not a whole number from 1 to " +
                                 std::to_string(largest));
    return int(value);
}

}  // namespace cli
}  // namespace simflex
