#include "support/Csv.h"

#include <limits>
#include <stdexcept>

namespace simflex::examples {

Csv::Csv(const std::string& path, const std::vector<std::string>& columns)
    : m_path(path), m_numColumns(columns.size()), m_file(path) {
    m_file.precision(std::numeric_limits<double>::max_digits10);
    for (size_t i = 0; i < columns.size(); ++i) m_file << (i ? "," : "") << columns[i];
    m_file << std::endl;
    if (!m_file) throw std::runtime_error("cannot write " + path);
}

void Csv::write(const std::vector<double>& row) {
    if (row.size() != m_numColumns)
        throw std::invalid_argument(m_path + ": " + std::to_string(row.size()) + " numbers for " +
                                    std::to_string(m_numColumns) + " columns");
    for (size_t i = 0; i < row.size(); ++i) m_file << (i ? "," : "") << row[i];
    m_file << std::endl;
    if (!m_file) throw std::runtime_error("cannot write " + m_path);
}

}  // namespace simflex::examples
