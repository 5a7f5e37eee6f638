#pragma once
/** @file
Cache of reduced parts. The key of a part's inputs gives the name of its file.

Entries are written to a temporary file and renamed, so any number of processes may share a folder.
An unreadable entry is replaced; an unwritable folder is reported and not used. The modification
time of an entry is that of its last use.

    const PartCache cache("", note);
    std::optional<ReducedBody> part = cache.find(key);
    if (!part) ... reduce, cache.keep(key, ...)  **/

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "simflex/model/parts/PartKey.h"
#include "simflex/part/ReducedBody.h"

namespace simflex {
namespace model {

class PartCache {
public:
    using Note = std::function<void(const std::string&)>;

    /** @param folder  empty: $SIMFLEX_CACHE, else $XDG_CACHE_HOME/simflex, else ~/.cache/simflex
    @param note  called with information for the user; may be empty **/
    PartCache(const std::string& folder, Note note);

    /** Empty if there is none. **/
    const std::string& getFolder() const { return m_folder; }

    struct Kept {
        ReducedBody part;
        std::vector<std::string> warnings;
    };
    std::optional<Kept> find(const PartKey& key) const;
    void keep(const PartKey& key, const Kept& kept) const;

    /** Path of the lock file for the process that makes this entry; creates its folder if possible.
    Empty if there is no folder. **/
    std::string prepareLock(const PartKey& key) const;

    struct Entry {
        std::string key;          ///< 32 hexadecimal digits
        std::string part;         ///< name of the part it was made for; empty if unreadable
        std::uintmax_t size = 0;  ///< [bytes]
        std::filesystem::file_time_type used;
    };
    /** All entries, the most recently used first. **/
    std::vector<Entry> list() const;

    /** Removes an entry and any files that a killed run left of it.
    @returns false, without removing anything, if a process is making the entry
    @throws std::runtime_error. **/
    bool remove(const std::string& key) const;

    /** Removes files that killed runs left of entries that do not exist. **/
    void removeLeftovers() const;

private:
    std::string m_folder;  ///< empty: none
    Note m_note;
};

}  // namespace model
}  // namespace simflex
