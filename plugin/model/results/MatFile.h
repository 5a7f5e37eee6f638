#pragma once
/** @file
Files of MATLAB's format 5, which Octave and scipy.io.loadmat read, too: matrices and lists of
texts by name, not compressed. **/

#include <string>
#include <vector>

#include "Simbody.h"

namespace simflex {
namespace model {

class MatFile {
public:
    /** @throws std::length_error for 4 GB or more. **/
    void add(const std::string& name, const SimTK::Matrix& matrix);
    void add(const std::string& name, const SimTK::Matrix_<SimTK::Complex>& matrix);
    /** A cell array, n×1. **/
    void add(const std::string& name, const std::vector<std::string>& texts);

    /** @throws std::runtime_error if the file cannot be written. **/
    void write(const std::string& path) const;

private:
    std::string m_bytes;
};

}  // namespace model
}  // namespace simflex
