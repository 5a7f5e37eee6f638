#pragma once
/** @file
Stores results of long phases in a folder, so that interrupted work can be resumed.

Each result is a separate file, written under a temporary name and renamed when complete, with a key
(a hash of everything the result depends on) and a checksum. A file with another key or damage is
ignored.

    ReductionCheckpoint checkpoint("crank.h5.resume");
    const auto visit = [&](Archive& archive) { archive.visit(modes); };
    if (!checkpoint.load("modes", key, visit)) {
        modes = calcModes();
        checkpoint.save("modes", key, seconds, visit);
    }
    checkpoint.remove();   // all is done  **/

#include <cstdint>
#include <functional>
#include <string>

namespace simflex {

class Archive;

class ReductionCheckpoint {
public:
    /** @param folder  created with the first result.
    @param worthSeconds  results that took less time are not stored.
    @param note  receives messages about resumed and unusable results. **/
    explicit ReductionCheckpoint(std::string folder, double worthSeconds = 5,
                                 std::function<void(const std::string&)> note = {});

    /** @returns false if there is no usable result. Values set by `read` must then be
    recomputed. **/
    bool load(const std::string& name, std::uint64_t key,
              const std::function<void(Archive&)>& read) const;

    /** Stores a result that took `seconds`, replacing one of the same name. A failure to write is
    noted but is no error. **/
    void save(const std::string& name, std::uint64_t key, double seconds,
              const std::function<void(Archive&)>& write) const;

    double worthSeconds() const { return m_worthSeconds; }

    /** Removes the folder and all results. **/
    void remove() const;

private:
    std::string pathOf(const std::string& name) const { return m_folder + "/" + name; }

    std::string m_folder;
    double m_worthSeconds;
    std::function<void(const std::string&)> m_note;
};

}  // namespace simflex
