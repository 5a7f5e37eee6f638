#pragma once
/** @file
Results of long phases kept in a folder, so that interrupted work can be resumed.

Each result is a file of its own, written under another name and renamed when it is whole, with a
key (a hash of all that the result depends on) and a checksum. A file with another key, or a damaged
one, counts as none.

    ReductionCheckpoint checkpoint("crank.h5.resume");
    const auto visit = [&](Archive& archive) { archive.visit(modes); };
    if (!checkpoint.load("modes", key, visit)) {
        modes = calcModes();
        checkpoint.save("modes", key, seconds, visit);
    }
    checkpoint.remove();   // all is done
**/

#include <cstdint>
#include <functional>
#include <string>

namespace simflex {

class Archive;

class ReductionCheckpoint {
public:
    /** @param folder  made with the first result.
    @param worthSeconds  a result that took less is not kept.
    @param note  is told what was resumed and what could not be. **/
    explicit ReductionCheckpoint(std::string folder, double worthSeconds = 5,
                                 std::function<void(const std::string&)> note = {});

    /** @returns false if there is no such result. What `read` has set by then must be made anew.
     * **/
    bool load(const std::string& name, std::uint64_t key,
              const std::function<void(Archive&)>& read) const;

    /** Keeps a result that took so long, in place of one of the same name. That it cannot be
    written is noted, but is no error. **/
    void save(const std::string& name, std::uint64_t key, double seconds,
              const std::function<void(Archive&)>& write) const;

    double worthSeconds() const { return m_worthSeconds; }

    /** Removes the folder with the results in it. **/
    void remove() const;

private:
    std::string pathOf(const std::string& name) const { return m_folder + "/" + name; }

    std::string m_folder;
    double m_worthSeconds;
    std::function<void(const std::string&)> m_note;
};

}  // namespace simflex
