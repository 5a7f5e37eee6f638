#pragma once
/** @file
Files that appear under their name only when they are whole: each is written beside its place, under
a name of this process's own, and renamed at the end. A symbolic link stays, and its target is
replaced; a device, a pipe and a write-protected file are refused. Internal.

    UnfinishedFile file("crank.h5");
    write(file.getPath());   // crank.h5.part-4711
    file.finish();           // crank.h5; without this, what was written is removed

    replaceFile("case.txt", text);   // all at once **/

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace simflex {

/** What a finished file outlives. **/
enum class Durability {
    ProcessEnd,   ///< the end of this process, whatever ends it
    PowerFailure  ///< that of the machine, too: it waits for the disk, milliseconds
};

class UnfinishedFile {
public:
    /** Nothing is opened yet. @param path  the name it will have **/
    explicit UnfinishedFile(const std::filesystem::path& path);
    /** Removes the file unless it is finished. **/
    ~UnfinishedFile();
    UnfinishedFile(const UnfinishedFile&) = delete;
    UnfinishedFile& operator=(const UnfinishedFile&) = delete;

    /** Where it is to be written. **/
    std::string getPath() const { return m_unfinished.string(); }

    /** Gives it its name, in place of a file that had it, and removes what killed processes had
    left of it when this process began. @pre it is written, and closed
    @throws std::runtime_error naming it and the cause; it is removed then, and the old one stays.
    **/
    void finish(Durability durability = Durability::PowerFailure);

private:
    std::filesystem::path m_path, m_unfinished;
    bool m_isFinished = false;
};

/** @throws std::runtime_error "cannot write 'PATH': CAUSE". **/
void replaceFile(const std::filesystem::path& path, std::string_view bytes,
                 Durability durability = Durability::PowerFailure);

inline void replaceFile(const std::filesystem::path& path, const std::vector<std::uint8_t>& bytes,
                        Durability durability = Durability::PowerFailure) {
    replaceFile(path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()}, durability);
}

/** Appends to the first `size` bytes of a file, which is made if need be, drops what stood behind
them, and waits for the disk. @throws std::runtime_error "cannot write 'PATH': CAUSE". **/
void appendToFile(const std::filesystem::path& path, std::uint64_t size, std::string_view bytes);

/** Refuses a place where no file can be made, before there is work to lose.
@throws std::runtime_error naming it and the cause. **/
void checkWritable(const std::filesystem::path& path);
/** The same of files that begin so: one that is there and does not is of another kind, an input
perhaps, and stays. @param kind  what it would be, "part file" **/
void checkReplaceable(const std::filesystem::path& path, std::string_view begin,
                      const std::string& kind);
/** Says that one stays. @throws std::runtime_error **/
[[noreturn]] void refuseReplacing(const std::filesystem::path& path, const std::string& kind);

/** Removes what processes that are no more have left unfinished in a folder, of files whose names
begin so. **/
void removeUnfinishedFiles(const std::filesystem::path& folder, const std::string& begin);

}  // namespace simflex
