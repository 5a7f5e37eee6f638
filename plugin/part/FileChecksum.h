#pragma once
/** @file
A checksum behind the last byte of an HDF5 file. HDF5 reads no further than its own end of file, and
drops these bytes when another program changes the file. Internal. **/

#include <string>

namespace simflex {

/** Appends a mark and the checksum of all bytes before it. O(bytes). @throws std::runtime_error.
 * **/
void appendChecksum(const std::string& path);

/** Refuses a file whose bytes are not those that were written, before HDF5 follows them. A file
without checksum was changed by another program and is left to HDF5's own checks.
@throws std::runtime_error. **/
void checkChecksum(const std::string& path);

}  // namespace simflex
