#pragma once
/** @file
Results of long phases kept in a folder, so that interrupted work can be resumed.

Each result is a file of its own, written under another name and renamed when it is whole, with a
key (a hash of all that the result depends on) and a checksum. A file with another key, or a damaged
one, counts as none.

    ReductionCheckpoint checkpoint("crank.h5.resume");
    if (!checkpoint.load("modes", key, [&](CheckpointReader& in) { in.get(modes); })) {
        modes = calcModes();
        checkpoint.save("modes", key, seconds, [&](CheckpointWriter& out) { out.put(modes); });
    }
    checkpoint.remove();   // all is done
**/

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "simflex/base/Hash.h"

namespace simflex {

class CheckpointWriter {
public:
    /** @throws std::runtime_error if the disk is full. **/
    void put(const void* bytes, size_t size);
    template <class T>
    void put(const std::vector<T>& values) {
        const std::uint64_t count = values.size();
        put(&count, sizeof count);
        put(values.data(), values.size() * sizeof(T));
    }

private:
    friend class ReductionCheckpoint;
    std::FILE* _file = nullptr;
    Hash _hash;
};

class CheckpointReader {
public:
    /** @throws std::runtime_error if the file ends early. **/
    void get(void* bytes, size_t size);
    template <class T>
    void get(std::vector<T>& values) {
        std::uint64_t count = 0;
        get(&count, sizeof count);
        checkLeft(count, sizeof(T));
        values.resize(size_t(count));
        get(values.data(), values.size() * sizeof(T));
    }

    /** @throws std::runtime_error if there are not as many bytes left. **/
    void checkLeft(std::uint64_t count, size_t elementSize) const;

private:
    friend class ReductionCheckpoint;
    std::FILE* _file = nullptr;
    std::uint64_t _left = 0;
    Hash _hash;
};

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
              const std::function<void(CheckpointReader&)>& read) const;

    /** Keeps a result that took so long, in place of one of the same name. That it cannot be
    written is noted, but is no error. **/
    void save(const std::string& name, std::uint64_t key, double seconds,
              const std::function<void(CheckpointWriter&)>& write) const;

    double worthSeconds() const { return _worthSeconds; }

    /** Removes the folder with the results in it. **/
    void remove() const;

private:
    std::string pathOf(const std::string& name) const { return _folder + "/" + name; }

    std::string _folder;
    double _worthSeconds;
    std::function<void(const std::string&)> _note;
};

}  // namespace simflex
