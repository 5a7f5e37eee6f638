#pragma once
/** @file
Reduced parts by content: what a part is made from, byte by byte, gives the name of its file.

Entries are written beside their place and renamed, so any number of processes may share a folder.
An entry that cannot be read is made anew; a folder that cannot be written is noted and done
without. **/

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "simflex/fe/Checkpoint.h"
#include "simflex/part/ReducedBody.h"

namespace simflex {
namespace cli {

/** 128 bits over everything that a reduction depends on. **/
class PartKey {
public:
    /** Begins with the version of simflex. **/
    PartKey();
    void add(const std::string& text);
    void add(double number);
    /** The bytes of a file and of those that it includes: *INCLUDE of decks, Include and Merge of
    Gmsh's scripts. A file that does not exist counts as such.
    @throws std::invalid_argument for a Gmsh script that starts programs. **/
    void addFile(const std::string& path);
    /** 32 hexadecimal digits. **/
    std::string getText() const;

private:
    void addFile(const std::string& path, int depth);
    ContentHash _first, _second;
};

class PartCache {
public:
    using Note = std::function<void(const std::string&)>;

    /** @param folder  empty: $SIMFLEX_CACHE, else $XDG_CACHE_HOME/simflex, else ~/.cache/simflex
     * **/
    PartCache(const std::string& folder, Note note);

    std::optional<ReducedBody> find(const PartKey& key) const;
    void keep(const PartKey& key, const ReducedBody& part) const;

private:
    std::string pathOf(const PartKey& key) const;
    std::string _folder;  ///< empty: none
    Note _note;
};

}  // namespace cli
}  // namespace simflex
