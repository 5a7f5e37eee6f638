#include "simflex/base/Memory.h"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <limits>

namespace simflex {
namespace {

constexpr std::int64_t UnknownMemory = std::numeric_limits<std::int64_t>::max();

/** Returns the number after `key` in a file of "key number" lines, or the first number if key is
empty. **/
std::int64_t readNumber(const std::string& path, const std::string& key = "") {
    std::ifstream in(path);
    std::string word;
    std::int64_t number = 0;
    if (!key.empty())
        while (in >> word && word != key) {
        }
    return in >> number ? number : UnknownMemory;
}

/** Returns what the control groups of this process still allow. **/
std::int64_t calcGroupMemory() {
    std::ifstream in("/proc/self/cgroup");
    std::int64_t least = UnknownMemory;
    for (std::string line; std::getline(in, line);) {
        const size_t first = line.find(':'), second = line.find(':', first + 1);
        if (second == std::string::npos) continue;
        const std::string controllers = line.substr(first + 1, second - first - 1);
        const bool unified = controllers.empty();
        if (!unified && controllers != "memory") continue;
        const std::string root = unified ? "/sys/fs/cgroup" : "/sys/fs/cgroup/memory";
        for (std::string group = line.substr(second + 1);; group.erase(group.rfind('/'))) {
            const std::string folder = root + (group == "/" ? "" : group);
            const std::int64_t limit =
                readNumber(folder + (unified ? "/memory.max" : "/memory.limit_in_bytes"));
            const std::int64_t used =
                readNumber(folder + (unified ? "/memory.current" : "/memory.usage_in_bytes"));
            if (limit != UnknownMemory && used != UnknownMemory) {
                const std::int64_t cached = readNumber(
                    folder + "/memory.stat", unified ? "inactive_file" : "total_inactive_file");
                least = std::min(least, limit - used + (cached == UnknownMemory ? 0 : cached));
            }
            if (group.empty() || group.rfind('/') == std::string::npos) break;
        }
    }
    return std::max<std::int64_t>(least, 0);
}

/** Returns what the limit of this process's address space still allows. **/
std::int64_t calcProcessMemory() {
    rlimit limit{};
    if (getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return UnknownMemory;
    const std::int64_t pages = readNumber("/proc/self/statm");
    const std::int64_t used = pages == UnknownMemory ? 0 : pages * sysconf(_SC_PAGESIZE);
    return std::max<std::int64_t>(std::int64_t(limit.rlim_cur) - used, 0);
}

}  // namespace

std::int64_t calcAvailableMemory() {
    const std::int64_t kilobytes = readNumber("/proc/meminfo", "MemAvailable:");
    return std::min({kilobytes == UnknownMemory ? UnknownMemory : 1024 * kilobytes,
                     calcGroupMemory(), calcProcessMemory()});
}

std::string formatMemory(double bytes) {
    char text[40];
    const double mebibytes = bytes / 1048576;
    if (mebibytes < 1000)
        std::snprintf(text, sizeof text, "%.0f MiB", mebibytes);
    else
        std::snprintf(text, sizeof text, "%.1f GiB", mebibytes / 1024);
    return text;
}

}  // namespace simflex
