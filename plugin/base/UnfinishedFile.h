#pragma once
/** @file A file that is written under another name until it is whole. Internal. **/

#include <filesystem>

namespace simflex {

/** Removes the unfinished file unless it was renamed, and `path` emptied. **/
struct UnfinishedFile {
    std::filesystem::path path;
    ~UnfinishedFile() {
        std::error_code ignored;
        if (!path.empty()) std::filesystem::remove(path, ignored);
    }
};

}  // namespace simflex
