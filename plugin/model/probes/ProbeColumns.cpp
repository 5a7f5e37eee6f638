#include "simflex/model/probes/ProbeColumns.h"

#include <algorithm>

namespace simflex {
namespace model {

size_t chooseColumn(const ModelValue& formula, const std::string& word,
                    const std::vector<std::string>& columns) {
    const size_t dot = word.find('.');
    const std::string name = word.substr(0, dot);
    const bool isNamed = dot != std::string::npos;
    if (columns.size() == 1 && columns[0].empty()) {
        if (isNamed)
            formula.fail("probe '" + name + "' has one column: write " + name + " for " + word);
        return 0;
    }
    if (!isNamed)
        formula.fail("probe '" + name + "' has " + std::to_string(columns.size()) +
                     " columns; say which, as " + name + "." + columns[0]);
    const std::string wanted = word.substr(dot + 1);
    const auto column = std::find(columns.begin(), columns.end(), wanted);
    if (column == columns.end())
        formula.failUnknown("column of probe '" + name + "'", wanted, columns);
    return size_t(column - columns.begin());
}

}  // namespace model
}  // namespace simflex
