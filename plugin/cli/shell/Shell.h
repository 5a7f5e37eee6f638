#pragma once
/** @file
The prompt: commands typed or read, run one after the other on a model. **/

#include <iosfwd>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "simflex/cli/shell/CommandTable.h"
#include "simflex/cli/shell/LineEditor.h"
#include "simflex/cli/shell/Terminal.h"
#include "simflex/model/Session.h"
#include "simflex/model/pictures/Pictures.h"

namespace simflex {
namespace cli {

using namespace model;

struct ShellOptions {
    ModelOptions model;
    enum class OnError { Stop, GoOn };  ///< of scripts
    OnError onError = OnError::Stop;
    bool isQuiet = false;  ///< no notes and progress on standard error
};

/** What the prompt's commands change of the model's pictures. **/
struct PictureSettings {
    /** As soon as something is given, it replaces the cameras of the model file. **/
    struct Camera {
        std::optional<SimTK::Vec2> direction;  ///< azimuth and elevation [rad]
        std::optional<double> zoom;
        std::string followedFrame;
        double followedSize = 0;  ///< [m]; 0: all of the scene
        std::optional<CameraView::Projection> projection;
    };
    Camera camera;
    std::optional<double> exaggeration;  ///< 0: automatic
    std::optional<Contour> contour;
    std::map<std::string, bool> shown;  ///< what `draw` has changed, by names of getDrawings()
};

class Shell {
public:
    /** Prints to standard output. **/
    explicit Shell(const ShellOptions& options);
    ~Shell();

    /** @name Running
    Both return an exit status: 0, 1 after an error, 130 after Ctrl-C. **/
    /**@{**/
    /** With a prompt; errors are printed and it goes on. **/
    int runPrompt();
    /** @param name  for messages: a file's name **/
    int runScript(std::istream& script, const std::string& name);
    /**@}**/
    /** The commands of one line. @throws std::runtime_error beginning with the command's name;
    Cancelled. **/
    void run(const std::string& line);
    /** @throws as run(), with the script's name and line before it. **/
    void runFile(const std::string& path);
    Completion complete(const std::string& text) const;

    /** @name For commands **/
    /**@{**/
    void quit() { m_isOver = true; }
    bool isOver() const { return m_isOver; }
    bool hasSession() const { return m_session != nullptr; }
    /** @throws std::runtime_error if there is none. **/
    Session& updSession() const;
    /** Reads a model; the one before stays if that fails. **/
    void open(const ModelText& text);
    /** The visualizer of the model, with the settings made here. **/
    std::unique_ptr<OffscreenVisualizer> makeVisualizer();
    PictureSettings& updPictureSettings() { return m_pictures; }

    /** Which model it is and what it has, in a line. **/
    void printSummary();
    bool showsProgress() const;
    /** Bars belong to terminals only. **/
    Listener makeListener() const;
    std::vector<std::string> getHistory() const;

    /** Constants with the model's parameters: `30*deg`, `[0, 0, L/2]`. **/
    double calcNumber(const std::string& text) const;
    std::vector<double> calcNumbers(const std::string& text) const;
    int calcCount(const std::string& text, int largest) const;
    /**@}**/

private:
    /** Notes a line of input; returns its commands. **/
    std::vector<Words> takeLine(const std::string& line);
    void runCommand(const Words& words);

    ShellOptions m_options;
    std::unique_ptr<Session> m_session;
    PictureSettings m_pictures;
    std::unique_ptr<LineEditor> m_editor;
    std::vector<std::string> m_lines;  ///< of scripts, for `history`
    int m_depth = 0;                   ///< of `source`
    bool m_isOver = false;
};

}  // namespace cli
}  // namespace simflex
