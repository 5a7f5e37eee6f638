#pragma once
/** @file
A checksum after the last byte of an HDF5 file. HDF5 does not read beyond its own end of file, and a
program that modifies the file drops these bytes. Internal. **/

#include <string>

namespace simflex {

/** Appends a mark and the checksum of all preceding bytes. O(bytes). @throws
std::runtime_error. **/
void appendChecksum(const std::string& path);

/** Refuses a damaged file before HDF5 parses it. A file without checksum was modified by another
program and is left to HDF5's own checks.
@throws std::runtime_error. **/
void checkChecksum(const std::string& path);

}  // namespace simflex
