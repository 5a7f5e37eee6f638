#include <pybind11/complex.h>
#include <pybind11/stl/filesystem.h>

#include <algorithm>
#include <cmath>

#include "simflex/model/Results.h"
#include "simflex/python/Values.h"

namespace simflex {
namespace python {

namespace {

using Analysis = Results::Analysis;

template <class Items>
std::vector<std::string> listNames(const Items& items) {
    std::vector<std::string> names;
    for (const auto& item : items) names.push_back(item.name);
    return names;
}

const Results::Series* findSeries(const Analysis& analysis, const std::string& name) {
    try {
        return &analysis.findProbe(name);
    } catch (const std::out_of_range& error) {
        throw py::key_error(error.what());
    }
}

py::array_t<double> getProbe(const Analysis& analysis, const std::string& name) {
    const Results::Series& series = *findSeries(analysis, name);
    return toArray(series.rows, 0, series.column.columns.size());
}

std::vector<std::string> listProbes(const Analysis& analysis) {
    std::vector<std::string> names;
    for (const Results::Series& series : analysis.probes) names.push_back(series.column.name);
    return names;
}

bool contains(const std::vector<std::string>& names, const std::string& name) {
    return std::find(names.begin(), names.end(), name) != names.end();
}

py::object toPandas(const Analysis& analysis) {
    py::dict columns;
    for (const Results::Series& series : analysis.probes)
        for (size_t k = 0; k < series.column.columns.size(); ++k)
            columns[py::str(nameColumn(series.column.name, series.column.columns[k]))] =
                toArray(series.rows, k, 1);
    return makeDataFrame(columns, analysis.time);
}

/** Plots probes over time with matplotlib. **/
py::object plot(const Analysis& analysis, const py::args& probes, py::object axes) {
    if (axes.is_none()) axes = py::module_::import("matplotlib.pyplot").attr("gca")();
    std::vector<std::string> names;
    for (const auto& probe : probes) names.push_back(py::cast<std::string>(probe));
    if (names.empty()) names = listProbes(analysis);
    for (const std::string& name : names) {
        const Results::Series& series = *findSeries(analysis, name);
        for (size_t k = 0; k < series.column.columns.size(); ++k)
            axes.attr("plot")(toArray(analysis.time), toArray(series.rows, k, 1),
                              py::arg("label") = nameColumn(name, series.column.columns[k]) + " [" +
                                                 series.column.unit + "]");
    }
    axes.attr("set_xlabel")("t [s]");
    axes.attr("legend")();
    return axes;
}

py::array_t<double> toMatrix(const std::vector<std::vector<double>>& rows) {
    if (rows.empty()) return toArray({});
    py::array_t<double> matrix({rows.size(), rows[0].size()});
    double* next = matrix.mutable_data();
    for (const std::vector<double>& row : rows) next = std::copy(row.begin(), row.end(), next);
    return matrix;
}

/** Returns amplitude and phase as complex numbers. **/
py::array_t<std::complex<double>> calcResponse(const Analysis& analysis) {
    const auto find = [&](const char* name) -> const std::vector<std::vector<double>>& {
        const auto found = analysis.matrices.find(name);
        if (found == analysis.matrices.end())
            throw py::attribute_error("an analysis of type " + analysis.type + " has no response");
        return found->second;
    };
    const auto &magnitude = find("magnitude"), &phase = find("phase");
    const size_t outputs = analysis.outputs.size(), inputs = analysis.inputs.size();
    py::array_t<std::complex<double>> response({magnitude.size(), outputs, inputs});
    std::complex<double>* next = response.mutable_data();
    for (size_t i = 0; i < magnitude.size(); ++i)
        for (size_t k = 0; k < outputs * inputs; ++k)
            *next++ = std::polar(magnitude[i].at(k), phase[i].at(k) * M_PI / 180);
    return response;
}

template <class Member>
auto makeGetter(Member member) {
    return [member](const Analysis& analysis) { return toArray(analysis.*member); };
}
/** Getter of modes: one row per speed of a Campbell diagram, else a single row. **/
template <class Member>
auto makeModeGetter(Member member) {
    return [member](const Analysis& analysis) -> py::array_t<double> {
        const auto& rows = analysis.*member;
        if (analysis.type != "campbell" && rows.size() == 1) return toArray(rows[0]);
        return toMatrix(rows);
    };
}
template <class Member>
auto makeMatrixGetter(Member member) {
    return [member](const Analysis& analysis) { return toMatrix(analysis.*member); };
}

}  // namespace

void addResults(py::module_& module) {
    py::class_<Analysis>(module, "Analysis", "Results of one analysis; analysis['tip'] is a probe.")
        .def_readonly("name", &Analysis::name)
        .def_readonly("type", &Analysis::type, "transient, static, eigen, campbell …")
        .def_readonly("is_complete", &Analysis::isComplete)
        .def_readonly("statistics", &Analysis::statistics)
        .def_readonly("warnings", &Analysis::warnings)
        .def_property_readonly("time", makeGetter(&Analysis::time),
                               "The n times of rows [s], of transient analyses.")
        .def_property_readonly("probes", &listProbes)
        .def("__iter__",
             [](const Analysis& analysis) { return py::iter(py::cast(listProbes(analysis))); })
        .def(
            "__contains__",
            [](const Analysis& analysis, const std::string& probe) {
                return contains(listProbes(analysis), probe);
            },
            py::arg("probe"))
        .def("__getitem__", &getProbe, py::arg("probe"),
             "n numbers of a probe, or n×k of one with columns; SI units, see unit().")
        .def(
            "unit",
            [](const Analysis& analysis, const std::string& probe) {
                return findSeries(analysis, probe)->column.unit;
            },
            py::arg("probe"), "Unit of a probe: m, rad/s …")
        .def(
            "columns",
            [](const Analysis& analysis, const std::string& probe) {
                return findSeries(analysis, probe)->column.columns;
            },
            py::arg("probe"),
            "Names of a probe's columns: x, y, z; one without name if it has one.")
        .def_property_readonly("q", makeMatrixGetter(&Analysis::q), "Coordinates, n×nq.")
        .def_property_readonly("u", makeMatrixGetter(&Analysis::u), "Speeds, n×nu.")
        .def_property_readonly("speeds", makeGetter(&Analysis::speeds),
                               "Speeds of a Campbell diagram [rad/s].")
        .def_property_readonly("frequency", makeModeGetter(&Analysis::frequency),
                               "Frequencies [Hz]: modes of eigen, speeds × modes of campbell.")
        .def_property_readonly("damping_ratio", makeModeGetter(&Analysis::dampingRatio))
        .def_readonly("inputs", &Analysis::inputs, "Of linear and frequency_response.")
        .def_readonly("outputs", &Analysis::outputs, "Likewise.")
        .def_readonly("input_units", &Analysis::inputUnits)
        .def_readonly("output_units", &Analysis::outputUnits)
        .def_property_readonly(
            "matrices",
            [](const Analysis& analysis) {
                py::dict all;
                for (const auto& [name, rows] : analysis.matrices)
                    all[py::str(name)] = toMatrix(rows);
                return all;
            },
            "A, B, C, D of linear, shapes of eigen; path of static: the loads' factor, unstable\n"
            "motions, 1 at a limit point and 2 at a bifurcation.")
        .def_property_readonly("response", &calcResponse,
                               "Of frequency_response: complex, frequencies×outputs×inputs.")
        .def_property_readonly(
            "events",
            [](const Analysis& analysis) {
                std::vector<std::pair<std::string, double>> events;
                for (const Analysis::Event& event : analysis.events)
                    events.emplace_back(event.name, event.time);
                return events;
            },
            "What has happened: (name, time [s]), in its order.")
        .def("plot", &plot, py::kw_only(), py::arg("axes") = py::none(),
             "Draws probes over the time, all or those named, into matplotlib's axes (the current\n"
             "ones); returns the axes. Needs matplotlib.")
        .def("to_pandas", &toPandas, "All probes as columns of a pandas.DataFrame.")
        .def("__repr__", [](const Analysis& analysis) {
            return "<simflex.Analysis '" + analysis.name + "', " + analysis.type + ">";
        });

    py::class_<Results>(module, "Results", "What a run leaves; results['run'] is an analysis.")
        .def_property_readonly("title", [](const Results& results) { return results.header.title; })
        .def_readonly("warnings", &Results::warnings)
        .def_property_readonly("analyses",
                               [](const Results& results) { return listNames(results.analyses); })
        .def(
            "__getitem__",
            [](const Results& results, const std::string& name) {
                try {
                    return results.findAnalysis(name);
                } catch (const std::out_of_range& error) {
                    throw py::key_error(error.what());
                }
            },
            py::arg("analysis"))
        .def("__iter__",
             [](const Results& results) { return py::iter(py::cast(listNames(results.analyses))); })
        .def(
            "__contains__",
            [](const Results& results, const std::string& name) {
                return contains(listNames(results.analyses), name);
            },
            py::arg("analysis"))
        .def("__len__", [](const Results& results) { return results.analyses.size(); })
        .def("__repr__", [](const Results& results) {
            return "<simflex.Results '" + results.header.title + "'>";
        });

    module.def(
        "read_results",
        [](const std::filesystem::path& path, bool states) {
            const py::gil_scoped_release unlocked;
            return readResults(path.string(), states ? ReadStates::Yes : ReadStates::No);
        },
        py::arg("path"), py::arg("states") = true,
        "Reads a file of results; without states q and u it takes less.");
}

}  // namespace python
}  // namespace simflex
