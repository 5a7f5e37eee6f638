/** @file
simflex_fmu_host: the process of one FMU instance. It answers calls through the socket that is its
standard input, see FmuProcess. **/

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <exception>

#include "simflex/fmi/FmuLibrary.h"

namespace {

using namespace simflex;

constexpr int LeastChannel = 200;  // above descriptors that a library may use or close by mistake

/** @returns false at the end **/
bool receive(int channel, void* data, std::size_t size) {
    for (char* at = static_cast<char*>(data); size > 0;) {
        const ssize_t got = read(channel, at, size);
        if (got < 0 && errno == EINTR) continue;
        if (got <= 0) return false;
        at += got;
        size -= std::size_t(got);
    }
    return true;
}

bool receiveFrame(int channel, std::string& bytes) {
    std::uint64_t size = 0;
    if (!receive(channel, &size, sizeof size)) return false;
    bytes.resize(size);
    return receive(channel, bytes.data(), bytes.size());
}

void sendReply(int channel, FmuReply reply) {
    Archive archive;
    reply.visit(archive);
    std::string frame(sizeof(std::uint64_t), '\0');
    const std::uint64_t size = archive.getBytes().size();
    std::memcpy(frame.data(), &size, sizeof size);
    frame += archive.getBytes();
    for (std::size_t done = 0; done < frame.size();) {
        const ssize_t written = write(channel, frame.data() + done, frame.size() - done);
        if (written < 0 && errno == EINTR) continue;
        if (written <= 0) _exit(1);
        done += std::size_t(written);
    }
}

void serve(int channel) {
    std::string bytes;
    if (!receiveFrame(channel, bytes)) return;
    Archive first(bytes);
    FmuInstanceSetup setup;
    setup.visit(first);
    std::unique_ptr<FmuLibrary> library;
    FmuReply made;
    try {
        library = std::make_unique<FmuLibrary>(setup);
    } catch (const std::exception& error) {
        made.error = error.what();
    }
    sendReply(channel, made);
    while (library && receiveFrame(channel, bytes)) {
        Archive archive(bytes);
        std::vector<FmuCall> calls;
        visitItems(archive, calls);
        sendReply(channel, library->ask(calls));
    }
}

}  // namespace

int main() {
    const int channel = fcntl(STDIN_FILENO, F_DUPFD_CLOEXEC, LeastChannel),
              nothing = open("/dev/null", O_RDONLY);
    if (channel < 0 || nothing < 0 || dup2(nothing, STDIN_FILENO) < 0) return 1;
    close(nothing);
    try {
        serve(channel);
    } catch (const std::exception&) {
        return 1;
    }
    return 0;
}
