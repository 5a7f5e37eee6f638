#pragma once
/** @file
Time histories of stress and displacement at selected nodes, in a CSV or HDF5 file for rain-flow
counting: one column per channel, even time steps.

    auto* history = new StressHistory("crank.h5", 1e-4);
    history->addChannels(crank, StressHistory::Quantity::SignedVonMises, {118, 119});
    history->addChannels(crank, StressHistory::Quantity::Stress, {118});
    system.addEventReporter(history);            // the system owns it

Channels are named BODY.NODE.QUANTITY: crank.118.signed_von_mises, crank.118.stress_xx. Rows already
written survive an interrupted run; TableFile.h describes buffering and format. **/

#include <memory>
#include <string>
#include <vector>

#include "simflex/body/StressRecovery.h"
#include "simflex/part/TableFile.h"

namespace simflex {

class StressHistory : public SimTK::PeriodicEventReporter {
public:
    enum class Quantity {
        Stress,           ///< xx yy zz xy xz yz in B [Pa]
        StressInGround,   ///< as Stress, in Ground's axes [Pa]
        Strain,           ///< tensor components in B
        VonMises,         ///< [Pa]
        SignedVonMises,   ///< see calcSignedVonMises() [Pa]
        PrincipalStress,  ///< three, largest first [Pa]
        Displacement      ///< Φξ in B, x y z [m]
    };

    /** The file is created, replacing one of that name, at the first report.
    @param interval  between reports, at t = k·interval [s]
    @throws std::invalid_argument if the interval is not positive. **/
    StressHistory(const std::string& path, SimTK::Real interval);
    ~StressHistory() override;

    /** Adds the channels of a quantity at nodes with these deck numbers.
    @throws std::out_of_range for a node that the mesh does not have.
    @throws std::invalid_argument if a node has no stress, saying what to do.
    @throws std::logic_error once the run has begun. **/
    void addChannels(const FlexibleBody& body, Quantity quantity,
                     const std::vector<int>& nodeNumbers);

    const std::vector<TableColumn>& getChannels() const { return m_columns; }

    /** Writes buffered rows, for readers of the file while the system exists. **/
    void flush() const;

    /** Ignores a repeated time.
    @throws std::runtime_error if time went back (use one history per run), or the file cannot be
    written. **/
    void handleEvent(const SimTK::State& state) const override;

private:
    struct Source {
        Quantity quantity;
        StressRecovery nodes;
    };

    void takeRow(const SimTK::State& state, Source& source) const;

    std::string m_path;
    std::vector<TableColumn> m_columns;
    mutable std::vector<Source> m_sources;
    mutable std::unique_ptr<TableFile> m_file;
    mutable SimTK::Real m_lastTime = -SimTK::Infinity;
    mutable std::vector<double> m_row;
    mutable SimTK::Array_<SimTK::SymMat33> m_tensors;
    mutable SimTK::Array_<SimTK::Vec3> m_vectors;
    mutable SimTK::Vector m_numbers;
};

}  // namespace simflex
