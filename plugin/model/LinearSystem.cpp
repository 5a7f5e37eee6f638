#include "simflex/model/LinearSystem.h"

#include "simflex/part/ArrayFile.h"

namespace simflex {
namespace {

FileArray makeArrayOf(const char* name, const SimTK::Matrix& matrix) {
    std::vector<double> values;
    values.reserve(size_t(matrix.nrow()) * size_t(matrix.ncol()));
    for (int j = 0; j < matrix.ncol(); ++j)
        for (int i = 0; i < matrix.nrow(); ++i) values.push_back(matrix(i, j));
    return makeArray(name, matrix.nrow(), matrix.ncol(), std::move(values));
}

FileArray makeList(const char* name, const std::vector<LinearSystem::Port>& ports,
                   std::string LinearSystem::Port::*text) {
    FileArray list;
    list.name = name;
    for (const LinearSystem::Port& port : ports) list.texts.push_back(port.*text);
    return list;
}

}  // namespace

void LinearSystem::writeMat(const std::string& path) const {
    writeArrayFile(path, {makeArrayOf("A", A), makeArrayOf("B", B), makeArrayOf("C", C),
                          makeArrayOf("D", D), makeList("inputs", inputs, &Port::name),
                          makeList("input_units", inputs, &Port::unit),
                          makeList("outputs", outputs, &Port::name),
                          makeList("output_units", outputs, &Port::unit)});
}

}  // namespace simflex
