#pragma once
/** @file
What a run keeps of its States, so that results are a place to go back to: all that probes and
pictures can ask for, as numbers with names.

    const StateRows rows(model);
    writer.beginTransient("swing", columns, rows.getColumns());
    writer.addRow(time, values, rows.pack(moment));
    …
    const KeptMoment kept = rows.unpack(results.findAnalysis("swing"), row);  // the same to the bit

Internal. **/

#include <map>
#include <string>
#include <vector>

#include "simflex/model/Model.h"
#include "simflex/model/Results.h"
#include "simflex/model/probes/Probe.h"

namespace simflex {
namespace model {

/** A Moment that stands for itself. **/
struct KeptMoment {
    SimTK::State state;  ///< realized to Stage::Velocity
    SimTK::Vector uDot, multipliers;
    double work = 0;

    Moment get() const { return {state, uDot, multipliers, work}; }
};

class StateRows {
public:
    explicit StateRows(const Model& model);

    /** Names of columns, by Results' names of what stands in `states`. **/
    const std::map<std::string, std::vector<std::string>>& getColumns() const { return m_columns; }

    /** In the order of ResultStates, one behind the other. **/
    std::vector<double> pack(const Moment& moment) const;

    /** A row of an analysis without time: of a State alone, the only one, or with what forces
    follow from, one more. **/
    void keepState(const SimTK::State& state, Results::Analysis& analysis) const;
    void keepMoment(const Moment& moment, Results::Analysis& analysis) const;

    /** @throws std::runtime_error if the States are of another model, or the file of an older
    simflex that kept only q of an analysis without time. **/
    SimTK::State unpackState(const Results::Analysis& analysis, std::size_t row) const;
    /** @throws std::runtime_error also if the file is of an older simflex, which did not keep
    what forces follow from. **/
    KeptMoment unpack(const Results::Analysis& analysis, std::size_t row) const;

private:
    /** Where the multipliers of what the State holds stand among all there can be. **/
    std::vector<int> findPlaces(const SimTK::State& state) const;

    struct Rows {
        int constraint;  ///< −1: always there
        int number;
    };
    const Model& m_model;
    SimTK::State m_start;
    std::vector<Rows> m_multipliers;  ///< in the integrators' order
    std::map<std::string, std::vector<std::string>> m_columns;
};

}  // namespace model
}  // namespace simflex
