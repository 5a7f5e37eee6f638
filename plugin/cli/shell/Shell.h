#pragma once
/** @file
The interactive prompt: runs typed commands and scripts on a model. **/

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
    enum class OnError { Stop, GoOn };  ///< in scripts
    OnError onError = OnError::Stop;
    bool isQuiet = false;  ///< no notes and progress on standard error
};

/** Changes of the model's picture settings by commands. **/
struct PictureSettings {
    /** If any member is set, replaces the cameras of the model file. **/
    struct Camera {
        std::optional<SimTK::Vec2> direction;  ///< azimuth and elevation [rad]
        std::optional<double> zoom;
        std::string followedFrame;
        double followedSize = 0;  ///< [m]; 0: the whole scene
        std::optional<CameraView::Projection> projection;
    };
    Camera camera;
    std::optional<double> exaggeration;  ///< 0: automatic
    std::optional<Contour> contour;
    std::map<std::string, bool> shown;  ///< items changed by `draw`, by names of getDrawings()
};

class Shell {
public:
    /** Prints to standard output. **/
    explicit Shell(const ShellOptions& options);
    ~Shell();

    /** @name Running
    Both return an exit status: 0, 1 after an error, 130 after Ctrl-C. **/
    /**@{**/
    /** Runs interactively; errors are printed and do not end it. **/
    int runPrompt();
    /** @param name  name of the script for messages **/
    int runScript(std::istream& script, const std::string& name);
    /**@}**/
    /** Runs the commands of a line. @throws std::runtime_error beginning with the command's name;
    Cancelled. **/
    void run(const std::string& line);
    /** Runs a script. @throws as run(), prefixed by the script's name and line. **/
    void runFile(const std::string& path);
    Completion complete(const std::string& text) const;

    /** @name For commands **/
    /**@{**/
    void quit() { m_isOver = true; }
    bool isOver() const { return m_isOver; }
    bool hasSession() const { return m_session != nullptr; }
    /** @throws std::runtime_error if there is none. **/
    Session& updSession() const;
    /** Opens a model; on failure the previous one remains. **/
    void open(const ModelText& text);
    /** Makes a visualizer of the model with the current picture settings. **/
    std::unique_ptr<OffscreenVisualizer> makeVisualizer();
    PictureSettings& updPictureSettings() { return m_pictures; }

    /** Prints a line with the model's name and contents. **/
    void printSummary();
    bool showsProgress() const;
    /** Progress bars are shown on terminals only. **/
    Listener makeListener() const;
    std::vector<std::string> getHistory() const;

    /** Evaluate constants and the model's parameters: `30*deg`, `[0, 0, L/2]`. **/
    double calcNumber(const std::string& text) const;
    std::vector<double> calcNumbers(const std::string& text) const;
    int calcCount(const std::string& text, int largest) const;
    /**@}**/

private:
    /** Records a line of input and returns its commands. **/
    std::vector<Words> takeLine(const std::string& line);
    void runCommand(const Words& words);

    ShellOptions m_options;
    std::unique_ptr<Session> m_session;
    PictureSettings m_pictures;
    std::unique_ptr<LineEditor> m_editor;
    std::vector<std::string> m_lines;  ///< of scripts, for `history`
    int m_depth = 0;                   ///< nesting of `source`
    bool m_isOver = false;
};

}  // namespace cli
}  // namespace simflex
