#pragma once
/** @file
Quantities of a model that are recorded: positions, speeds, deformations, stress, reactions,
energies, and formulas of other probes. **/

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "simflex/forces/Signal.h"
#include "simflex/model/Model.h"

namespace simflex {
namespace model {

/** What is known at one moment of a run, or of an equilibrium. **/
struct Moment {
    const SimTK::State& state;         ///< realized to Stage::Velocity
    const SimTK::Vector& uDot;         ///< in Simbody's numbering; empty: at rest
    const SimTK::Vector& multipliers;  ///< see ImplicitIntegrator::getMultipliers()
    double work = 0;                   ///< of loads and dampers since the start [J]

    /** Of the whole system, found when they are first asked for; see calcEnergy(). **/
    mutable std::optional<double> kineticEnergy = {}, potentialEnergy = {};
    /** Values of formulas, which others may be made of. **/
    mutable std::unordered_map<const void*, double> formulas = {};
};

/** One probe: `columns.size()` numbers. **/
struct Probe {
    std::string name;
    std::string unit;                  ///< "m", "N m", "" for none
    std::vector<std::string> columns;  ///< "x", "y", "z"; "" for a single number
    std::function<void(const Moment&, double* values)> calc;
    /** Of each column, where it is a signal of the motion; else none. **/
    std::vector<Signal> signals = {};
};

class Probes {
public:
    /** Those of the model's `probes`, in the file's order; with no such key, a sensible set: of
    each joint its coordinates, of each flexible body its largest displacement, the energies.
    @throws ModelError. **/
    static Probes make(const std::shared_ptr<const Model>& model);

    const std::vector<Probe>& getProbes() const { return m_probes; }
    /** Number of all columns together. **/
    int getNumColumns() const;
    /** All values, probe after probe. **/
    std::vector<double> calc(const Moment& moment) const;

private:
    std::vector<Probe> m_probes;
};

}  // namespace model
}  // namespace simflex
