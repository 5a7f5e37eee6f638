#pragma once
/** @file
Opens files whose names stand in models, decks and commands. All readers open them here, since a
name may stand for what no reader can use: a pipe waits for a writer, a device has no end, and what
the kernel shows of itself in /proc and /sys waits for events or is as long as all memory. **/

#include <filesystem>
#include <fstream>
#include <string>

namespace simflex {

/** Whether a name, or what it links to, is a regular file on a disk. **/
bool isInputFile(const std::filesystem::path& path);

/** Opens a file to read its bytes.
@return a stream that is not open if this is no isInputFile(), or may not be read **/
std::ifstream openInputFile(const std::filesystem::path& path);

/** All bytes of a file. @throws std::runtime_error "cannot read 'PATH': CAUSE" **/
std::string readInputFile(const std::filesystem::path& path);

}  // namespace simflex
