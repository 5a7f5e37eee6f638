/** @file
simflex cache: manages cached parts reduced for model files. **/

#include <chrono>
#include <cstdio>
#include <ctime>
#include <memory>
#include <stdexcept>
#include <string>

#include "simflex/base/NumberText.h"
#include "simflex/cli/Commands.h"
#include "simflex/cli/Format.h"
#include "simflex/cli/Messages.h"
#include "simflex/model/parts/PartCache.h"

namespace simflex {
namespace cli {

using namespace model;

namespace {

using FileTime = std::filesystem::file_time_type;

struct CacheArguments {
    bool clears = false;
    double oldest = 0;  ///< [days]
};

/** "2024-05-31 14:05", local time. **/
std::string formatTime(FileTime time) {
    using std::chrono::system_clock;
    const auto age =
        std::chrono::duration_cast<system_clock::duration>(FileTime::clock::now() - time);
    const std::time_t seconds = system_clock::to_time_t(system_clock::now() - age);
    std::tm date{};
    localtime_r(&seconds, &date);
    char text[32];
    std::strftime(text, sizeof text, "%Y-%m-%d %H:%M", &date);
    return text;
}

std::string count(size_t number) {
    return formatCount(number, "part", "parts");
}

void list(const PartCache& cache) {
    const std::vector<PartCache::Entry> entries = cache.list();
    double size = 0;
    TextTable table({"key", "size", "last used", "part"});
    for (const PartCache::Entry& entry : entries) {
        size += double(entry.size);
        table.add({entry.key, writeFileSize(double(entry.size)), formatTime(entry.used),
                   entry.part.empty() ? "(not readable)" : entry.part});
    }
    if (!table.isEmpty()) writeOut("%s", table.format().c_str());
    writeOut("%s: %s, %s\n", cache.getFolder().c_str(), count(entries.size()).c_str(),
             writeFileSize(size).c_str());
}

void clear(const PartCache& cache, double oldest) {
    const auto age = std::chrono::duration<double>(86400 * oldest);
    size_t numRemoved = 0, numBusy = 0;
    double size = 0;
    for (const PartCache::Entry& entry : cache.list()) {
        if (FileTime::clock::now() - entry.used < age) continue;
        const bool isRemoved = cache.remove(entry.key);
        numRemoved += isRemoved;
        numBusy += !isRemoved;
        if (isRemoved) size += double(entry.size);
    }
    cache.removeLeftovers();
    writeOut("%s: %s removed, %s", cache.getFolder().c_str(), count(numRemoved).c_str(),
             writeFileSize(size).c_str());
    if (numBusy > 0) writeOut("; %s being made by other runs", count(numBusy).c_str());
    writeOut("\n");
}

void perform(const CacheArguments& arguments) {
    const PartCache cache("", {});
    if (cache.getFolder().empty())
        throw std::runtime_error("there is no cache: set SIMFLEX_CACHE to a folder");
    if (arguments.clears)
        clear(cache, arguments.oldest);
    else
        list(cache);
}

}  // namespace

void addCacheCommand(CLI::App& app) {
    const auto arguments = std::make_shared<CacheArguments>();
    CLI::App* command =
        app.add_subcommand("cache", "List or remove the reduced parts kept for model files");
    command->footer(
        "A part that a model file gives by its deck, geometry or matrices is reduced once and kept "
        "in the\n"
        "folder SIMFLEX_CACHE (or ~/.cache/simflex). A part that is removed is reduced again when "
        "a "
        "model\n"
        "needs it.\n\n"
        "  simflex cache --clear --older-than 30");
    CLI::Option* clear =
        command->add_flag("--clear", arguments->clears, "Remove the parts instead of listing them");
    command
        ->add_option("--older-than", arguments->oldest,
                     "Remove only parts that no run has used for this many days")
        ->check(CLI::Range(0.0, 1e5))
        ->type_name("DAYS")
        ->needs(clear);
    command->callback([arguments] { perform(*arguments); });
}

}  // namespace cli
}  // namespace simflex
