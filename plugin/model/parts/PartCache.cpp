#include "simflex/model/parts/PartCache.h"

#include <algorithm>
#include <cstdlib>
#include <set>
#include <stdexcept>

#include "simflex/model/parts/FileLock.h"
#include "simflex/part/Hdf5.h"
#include "simflex/part/PartWarnings.h"
#include "simflex/part/ReducedBodyFile.h"

namespace simflex {
namespace model {

namespace fs = std::filesystem;

namespace {

constexpr size_t KeySize = 32;
const char* const Ending = ".h5";
const char* const LockEnding = ".lock";

/** The key at the start of a file's name; empty if none. **/
std::string findKey(const fs::path& path) {
    const std::string name = path.filename().string();
    const size_t end = name.find_first_not_of("0123456789abcdef");
    return end == KeySize && name[end] == '.' ? name.substr(0, KeySize) : "";
}

std::string readName(const fs::path& path) {
    try {
        const hdf5::Quiet quiet;
        return hdf5::readText(hdf5::openFile(path.string()), "name");
    } catch (const std::runtime_error&) {
        return "";
    }
}

/** The files of a folder; none if it cannot be read. **/
std::vector<fs::path> listFiles(const std::string& folder) {
    std::vector<fs::path> files;
    std::error_code error;
    fs::directory_iterator file(folder, error);
    for (; !error && file != fs::directory_iterator(); file.increment(error))
        files.push_back(file->path());
    return files;
}

}  // namespace

PartCache::PartCache(const std::string& folder, Note note) : m_folder(folder), m_note(note) {
    if (!m_folder.empty()) return;
    const auto get = [](const char* name) {
        const char* value = std::getenv(name);
        return std::string(value ? value : "");
    };
    if (!get("SIMFLEX_CACHE").empty())
        m_folder = get("SIMFLEX_CACHE");
    else if (!get("XDG_CACHE_HOME").empty())
        m_folder = get("XDG_CACHE_HOME") + "/simflex";
    else if (!get("HOME").empty())
        m_folder = get("HOME") + "/.cache/simflex";
}

std::optional<PartCache::Kept> PartCache::find(const PartKey& key) const {
    if (m_folder.empty()) return {};
    const fs::path path = fs::path(m_folder) / (key.getText() + Ending);
    std::error_code ignored;
    if (!fs::is_regular_file(path, ignored)) return {};
    try {
        Kept kept{readReducedBody(path.string()), readPartWarnings(path.string())};
        fs::last_write_time(path, fs::file_time_type::clock::now(), ignored);
        return kept;
    } catch (const std::exception& error) {
        if (m_note) m_note(std::string("a part in the cache is made anew: ") + error.what());
        return {};
    }
}

void PartCache::keep(const PartKey& key, const Kept& kept) const {
    try {
        if (m_folder.empty())
            throw std::runtime_error("there is no folder for it: set SIMFLEX_CACHE");
        fs::create_directories(m_folder);
        const fs::path path = fs::path(m_folder) / (key.getText() + Ending);
        fs::remove(path);  // writing refuses to replace a file that is not a part
        writeReducedBody(path.string(), kept.part, kept.warnings);
    } catch (const std::exception& error) {
        if (m_note)
            m_note("part '" + kept.part.name +
                   "' is not kept in the cache and will be reduced again: " + error.what());
    }
}

std::string PartCache::prepareLock(const PartKey& key) const {
    if (m_folder.empty()) return "";
    std::error_code ignored;
    fs::create_directories(m_folder, ignored);
    return (fs::path(m_folder) / (key.getText() + LockEnding)).string();
}

std::vector<PartCache::Entry> PartCache::list() const {
    std::vector<Entry> entries;
    for (const fs::path& path : listFiles(m_folder)) {
        const std::string key = findKey(path);
        if (key.empty() || path.filename() != key + Ending) continue;
        std::error_code error;
        Entry entry;
        entry.key = key;
        entry.size = fs::file_size(path, error);
        if (!error) entry.used = fs::last_write_time(path, error);
        if (error) continue;  // removed in the meantime
        entry.part = readName(path);
        entries.push_back(entry);
    }
    std::sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) {
        return a.used != b.used ? a.used > b.used : a.key < b.key;
    });
    return entries;
}

bool PartCache::remove(const std::string& key) const {
    FileLock lock((fs::path(m_folder) / (key + LockEnding)).string());
    if (lock.tryToHold() == FileLock::State::Busy) return false;
    for (const fs::path& path : listFiles(m_folder))
        if (findKey(path) == key && path.extension() != LockEnding) {
            std::error_code error;
            fs::remove(path, error);
            if (error)
                throw std::runtime_error("cannot remove '" + path.string() +
                                         "' from the cache: " + error.message());
        }
    return true;
}

void PartCache::removeLeftovers() const {
    std::set<std::string> keys;
    for (const fs::path& path : listFiles(m_folder)) keys.insert(findKey(path));
    keys.erase("");
    for (const Entry& entry : list()) keys.erase(entry.key);
    for (const std::string& key : keys) remove(key);
}

}  // namespace model
}  // namespace simflex
