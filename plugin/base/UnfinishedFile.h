#pragma once
/** @file
Files that appear under their final name only when they are complete: each is written next to its
destination, under a name of this process that nothing else has, and renamed at the end. A symbolic
link is kept and its target replaced. Devices, pipes and write-protected files are refused.
Internal.

    UnfinishedFile file("crank.h5");
    write(file.getPath());   // crank.h5.part-4711
    file.finish();           // crank.h5; without this, what was written is removed

    replaceFile("case.txt", text);   // all at once  **/

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace simflex {

/** The failure that a finished file survives. **/
enum class Durability {
    ProcessEnd,   ///< any end of this process
    PowerFailure  ///< also a power failure; waits for the disk, milliseconds
};

class UnfinishedFile {
public:
    /** Creates the empty file, never through a link. @param path  the final name
    @throws std::runtime_error "cannot write 'PATH': CAUSE". **/
    explicit UnfinishedFile(const std::filesystem::path& path);
    /** Removes the file unless it is finished. **/
    ~UnfinishedFile();
    UnfinishedFile(const UnfinishedFile&) = delete;
    UnfinishedFile& operator=(const UnfinishedFile&) = delete;

    /** Returns the path to write to. **/
    std::string getPath() const { return m_unfinished.string(); }

    /** Renames the file to its final name, replacing an existing file, and removes unfinished files
    of the same name left by processes killed before this one began. @pre the file is written and
    closed
    @throws std::runtime_error naming the file and the cause; the unfinished file is removed then,
    and the old one kept. **/
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

/** Truncates a file, which is no link, to its first `size` bytes, creating it if necessary, appends
`bytes` and waits for the disk. @throws std::runtime_error "cannot write 'PATH': CAUSE". **/
void appendToFile(const std::filesystem::path& path, std::uint64_t size, std::string_view bytes);

/** Checks that a file can be created at this path, before there are results to lose.
@throws std::runtime_error naming the path and the cause. **/
void checkWritable(const std::filesystem::path& path);
/** As checkWritable(), for files that start with `begin`: an existing file that does not is of
another kind, perhaps an input, and is not replaced. @param kind  the new file's kind, such as "part
file" **/
void checkReplaceable(const std::filesystem::path& path, std::string_view begin,
                      const std::string& kind);
/** @throws std::runtime_error that the existing file is not replaced **/
[[noreturn]] void refuseReplacing(const std::filesystem::path& path, const std::string& kind);

/** Refuses a folder of this program's own choice that is a link: files of another place would be
replaced or removed. @throws std::runtime_error naming the link **/
void refuseLinkedFolder(const std::filesystem::path& folder);

/** Removes unfinished files that ended processes have left in a folder, if their names start with
`begin`. **/
void removeUnfinishedFiles(const std::filesystem::path& folder, const std::string& begin);

}  // namespace simflex
