#pragma once
/** @file
The States of a run as rows of named numbers, so that probes and pictures can be evaluated later.

    const StateRows rows(model);
    writer.beginTransient("swing", columns, rows.getColumns());
    writer.addRow(time, values, rows.pack(moment));
    …
    const KeptMoment kept = rows.unpack(results.findAnalysis("swing"), row);  // exact to the bit

Internal. **/

#include <map>
#include <string>
#include <vector>

#include "simflex/model/Model.h"
#include "simflex/model/Results.h"
#include "simflex/model/probes/Probe.h"

namespace simflex {
namespace model {

/** A Moment that owns its data. **/
struct KeptMoment {
    SimTK::State state;  ///< realized to Stage::Velocity
    SimTK::Vector uDot, multipliers;
    double work = 0;

    Moment get() const { return {state, uDot, multipliers, work}; }
};

class StateRows {
public:
    explicit StateRows(const Model& model);

    /** Column names, by the names of the arrays in the group `states` of Results. **/
    const std::map<std::string, std::vector<std::string>>& getColumns() const { return m_columns; }

    /** One row: all arrays in the order of ResultStates. **/
    std::vector<double> pack(const Moment& moment) const;

    /** Stores a State in an analysis without time as its only row, or adds a row with accelerations
    and multipliers. **/
    void keepState(const SimTK::State& state, Results::Analysis& analysis) const;
    void keepMoment(const Moment& moment, Results::Analysis& analysis) const;

    /** @throws std::runtime_error if the States are of another model, or the file is of an older
    simflex that kept only q of an analysis without time. **/
    SimTK::State unpackState(const Results::Analysis& analysis, std::size_t row) const;
    /** @throws std::runtime_error also if the file is of an older simflex without accelerations and
    multipliers. **/
    KeptMoment unpack(const Results::Analysis& analysis, std::size_t row) const;

private:
    /** Indices of the State's active multipliers among all possible ones. **/
    std::vector<int> findPlaces(const SimTK::State& state) const;

    struct Rows {
        int constraint;  ///< −1: always present
        int number;
    };
    const Model& m_model;
    SimTK::State m_start;
    std::vector<Rows> m_multipliers;  ///< in the integrators' order
    std::map<std::string, std::vector<std::string>> m_columns;
};

}  // namespace model
}  // namespace simflex
