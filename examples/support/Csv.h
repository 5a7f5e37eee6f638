#pragma once
/** @file
A table of numbers as comma-separated values, written row by row: what is written survives an
interruption. **/

#include <fstream>
#include <string>
#include <vector>

namespace simflex::examples {

class Csv {
public:
    /** @throws std::runtime_error if the file cannot be written. **/
    Csv(const std::string& path, const std::vector<std::string>& columns);

    /** Numbers are written so that reading them back gives the same double.
    @throws std::runtime_error if the file cannot be written; std::invalid_argument on a wrong
    number of them. **/
    void write(const std::vector<double>& row);

private:
    std::string m_path;
    size_t m_numColumns;
    std::ofstream m_file;
};

}  // namespace simflex::examples
