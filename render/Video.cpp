#include "simflex/render/Video.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <vector>

extern char** environ;

namespace simflex {

namespace {

bool isOnPath(const std::string& program) {
    const char* path = std::getenv("PATH");
    std::istringstream folders(path ? path : "");
    std::string folder;
    while (std::getline(folders, folder, ':'))
        if (access((folder + "/" + program).c_str(), X_OK) == 0) return true;
    return false;
}

bool hasSuffix(const std::string& text, const std::string& suffix) {
    return text.size() >= suffix.size() &&
           text.compare(text.size() - suffix.size(), suffix.size(), suffix) == 0;
}

// Runs a program with its messages in a file; returns its exit status.
int runProgram(const std::vector<std::string>& arguments, const std::string& logFile) {
    std::vector<char*> argv;
    for (const std::string& argument : arguments)
        argv.push_back(const_cast<char*>(argument.c_str()));
    argv.push_back(nullptr);

    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, logFile.c_str(),
                                     O_WRONLY | O_CREAT | O_TRUNC, 0600);
    posix_spawn_file_actions_adddup2(&actions, STDERR_FILENO, STDOUT_FILENO);
    pid_t child = 0;
    const int failure = posix_spawnp(&child, argv[0], &actions, nullptr, argv.data(), environ);
    posix_spawn_file_actions_destroy(&actions);
    if (failure != 0)
        throw std::runtime_error("cannot run " + arguments[0] + ": " + std::strerror(failure));
    int status = 0;
    while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
    }
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128;
}

}  // namespace

bool isVideoAvailable() {
    return isOnPath("ffmpeg");
}

bool writeVideo(const std::string& folder, const std::string& videoFile, double framesPerSecond) {
    if (!(framesPerSecond > 0))
        throw std::runtime_error("writeVideo: frames per second must be positive, not " +
                                 std::to_string(framesPerSecond));
    if (!std::ifstream(folder + "/frame_00000.png"))
        throw std::runtime_error("writeVideo: no frame_00000.png in '" + folder + "'");
    if (!isVideoAvailable()) return false;

    const bool isGif = hasSuffix(videoFile, ".gif");
    const std::string stem = videoFile + "." + std::to_string(getpid());
    const std::string partial = stem + (isGif ? ".part.gif" : ".part.mp4"), log = stem + ".log";
    std::ostringstream rate;
    rate << framesPerSecond;
    std::vector<std::string> arguments = {
        "ffmpeg",     "-y",       "-loglevel", "error",
        "-framerate", rate.str(), "-i",        folder + "/frame_%05d.png"};
    const std::vector<std::string> coding =
        isGif ? std::vector<std::string>{"-filter_complex",
                                         "[0:v]split[a][b];[a]palettegen=stats_mode=full[p];"
                                         "[b][p]paletteuse=dither=bayer:bayer_scale=3",
                                         "-loop", "0"}
              : std::vector<std::string>{"-vf",       "pad=ceil(iw/2)*2:ceil(ih/2)*2",
                                         "-c:v",      "libx264",
                                         "-crf",      "16",
                                         "-preset",   "medium",
                                         "-pix_fmt",  "yuv420p",
                                         "-movflags", "+faststart"};
    arguments.insert(arguments.end(), coding.begin(), coding.end());
    arguments.push_back(partial);
    const int status = runProgram(arguments, log);

    std::ostringstream messages;
    messages << std::ifstream(log).rdbuf();
    std::remove(log.c_str());
    const bool ok = status == 0 && std::rename(partial.c_str(), videoFile.c_str()) == 0;
    if (!ok) {
        std::remove(partial.c_str());
        throw std::runtime_error("ffmpeg could not write '" + videoFile + "': " + messages.str());
    }
    return true;
}

}  // namespace simflex
