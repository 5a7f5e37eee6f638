#pragma once
/** @file
Opens files named in models, decks and commands. All readers open files here, because a name may
refer to something that cannot be read to an end: a pipe waits for a writer, a device has no end,
and entries of /proc and /sys may block or be as long as all memory. **/

#include <filesystem>
#include <fstream>
#include <string>

namespace simflex {

/** Returns whether a path is, or links to, a regular file on a disk. **/
bool isInputFile(const std::filesystem::path& path);

/** Opens a file in binary mode.
@return a stream that is not open if the path is no isInputFile() or cannot be read **/
std::ifstream openInputFile(const std::filesystem::path& path);

/** Reads a whole file. @throws std::runtime_error "cannot read 'PATH': CAUSE" **/
std::string readInputFile(const std::filesystem::path& path);

}  // namespace simflex
