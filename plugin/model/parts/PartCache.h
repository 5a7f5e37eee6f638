#pragma once
/** @file
Reduced parts by content: the key of what a part is made from gives the name of its file.

Entries are written beside their place and renamed, so any number of processes may share a folder.
An entry that cannot be read is made anew; a folder that cannot be written is noted and done
without. Time of change of an entry: when it was last used.

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
    @param note  told what the user should know; may be empty **/
    PartCache(const std::string& folder, Note note);

    /** Empty: there is none. **/
    const std::string& getFolder() const { return m_folder; }

    /** A part with the warnings of its reduction. **/
    struct Kept {
        ReducedBody part;
        std::vector<std::string> warnings;
    };
    std::optional<Kept> find(const PartKey& key) const;
    void keep(const PartKey& key, const Kept& kept) const;

    /** Path of the file whose lock belongs to the process that makes this entry; its folder is
    there, if it can be. Empty if there is no folder. **/
    std::string prepareLock(const PartKey& key) const;

    struct Entry {
        std::string key;          ///< 32 hexadecimal digits
        std::string part;         ///< name of the part it was made for; empty if it cannot be read
        std::uintmax_t size = 0;  ///< [bytes]
        std::filesystem::file_time_type used;
    };
    /** What is in the folder, last used first. **/
    std::vector<Entry> list() const;

    /** Removes an entry and what a killed run left of it. @returns false if a process is making it:
    then nothing is removed. @throws std::runtime_error. **/
    bool remove(const std::string& key) const;

    /** Removes what killed runs left of entries that do not exist. **/
    void removeLeftovers() const;

private:
    std::string m_folder;  ///< empty: none
    Note m_note;
};

}  // namespace model
}  // namespace simflex
