#pragma once
/** @file
Inputs and outputs of a linearised model: how its equations and probes change with numbers of its
file. **/

#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "simflex/model/LinearSystem.h"
#include "simflex/model/probes/Probe.h"
#include "simflex/solver/FrequencyResponse.h"

namespace simflex {
namespace model {

/** What becomes of an effective stress of von Mises at a node. Of random motion it has an effective
value, but no response: its square is a quadratic form of the six components, which have. **/
enum class EffectiveStress { AsItIs, ByComponents };

/** Outputs that are the size of something that is zero, or otherwise have a kink where they are.
 * **/
struct OutputKinks : std::runtime_error {
    OutputKinks(std::vector<std::string> kinks, std::vector<std::string> others);
    std::vector<std::string> names;
    std::vector<std::string> rest;  ///< the others
};

/** Columns of probes by name. **/
class LinearOutputPorts {
public:
    /** @param names  "tip", "tip.y"; none: all probes
    @throws ModelError that proposes the nearest name. **/
    LinearOutputPorts(std::shared_ptr<const Model> model, const Probes& probes,
                      const std::vector<std::string>& names,
                      EffectiveStress effectiveStress = EffectiveStress::AsItIs);

    /** Others, as by the constructor. **/
    void choose(const std::vector<std::string>& names);
    const std::vector<LinearSystem::Port>& getPorts() const { return m_ports; }
    EffectiveStress getEffectiveStress() const { return m_effectiveStress; }
    /** Of stresses by components: name and first of six ports, xx, yy, zz, xy, yz, zx. **/
    const std::vector<std::pair<std::string, int>>& getStresses() const { return m_stresses; }
    /** @param state  realized to Stage::Velocity **/
    std::vector<double> calc(const SimTK::State& state, const SimTK::Vector& uDot,
                             const SimTK::Vector& multipliers) const;
    /** Slopes of signals are exact at rest; all others are differences, see differentiateOutputs().
    @throws OutputKinks. **/
    LinearOutputs differentiate(const OperatingPoint& point,
                                const std::function<void()>& observer) const;

private:
    struct Choice {
        Probe probe;
        std::vector<int> columns;
    };
    static std::vector<double> calcChoices(const std::vector<Choice>& choices,
                                           const Moment& moment);
    std::shared_ptr<const Model> m_model;
    Probes m_probes;
    std::vector<Choice> m_choices;
    std::vector<LinearSystem::Port> m_ports;
    std::vector<std::string> m_names;  ///< by which each port is chosen
    EffectiveStress m_effectiveStress;
    std::vector<std::pair<std::string, int>> m_stresses;
};

/** Numbers of a model's file by path. **/
class LinearInputPorts {
public:
    /** @param paths  "loads.push.force.y", "loads.push": all of it; "push": an input of the model
    @throws ModelError that names what there is, and for one that is given twice. **/
    LinearInputPorts(const ModelText& text, const ModelOptions& options, const Model& model,
                     const std::vector<std::string>& paths);

    const std::vector<LinearSystem::Port>& getPorts() const { return m_ports; }
    /** Builds the model with other numbers, some times for each input.
    @param observed, outputs  what is observed, and its names as LinearOutputPorts takes them
    @param observer  called before each of them
    @throws std::runtime_error for an input that changes parts or the structure of the model, the
        speed of a motion, or nothing. **/
    LinearInputs differentiate(const OperatingPoint& point, const LinearOutputPorts& observed,
                               const std::vector<std::string>& outputs,
                               const std::function<void()>& observer) const;

private:
    struct Source {
        std::string setting;  ///< path as settings have it, items of lists by number
        std::string text;     ///< the number as written
        double value;         ///< now; NaN: a law
        int input = -1;       ///< number of its state; then there is no setting
    };
    /** The model's own inputs that a path means: "push", "inputs.push", "inputs". **/
    bool addInputs(const std::vector<std::string>& path);
    void refuseTwin(size_t port) const;
    void add(const ModelValue& value, const std::string& path, const std::string& setting,
             double time);

    ModelText m_text;
    ModelOptions m_options;
    const Model& m_model;
    std::vector<LinearSystem::Port> m_ports;
    std::vector<Source> m_sources;
};

/** A force moment·ω² that turns about an axis of Ground, at the frequency of the response. **/
struct Unbalance {
    std::string on;     ///< frame, as a model file has it
    double moment = 0;  ///< mass times distance from the axis [kg m]
    int axis = 0;       ///< 0 x, 1 y, 2 z: it turns from the next one to the one after
};

/** Inputs and outputs of a model about a State, ready for any frequency: at rest by block
elimination, along a steady motion or with states of the model's own by matrices of first order. **/
class ModelResponse {
public:
    /** As linearizeModel(). @param unbalance  the last input, "unbalance" **/
    ModelResponse(const ModelText& text, const ModelOptions& options,
                  const std::shared_ptr<const Model>& model, const Probes& probes,
                  const SimTK::State& about, const std::vector<std::string>& inputs,
                  const std::vector<std::string>& outputs,
                  const std::optional<Unbalance>& unbalance, EffectiveStress effectiveStress,
                  const std::function<void()>& observer);

    /** See LinearOutputPorts. **/
    const std::vector<std::pair<std::string, int>>& getStresses() const { return m_stresses; }
    const std::vector<LinearSystem::Port>& getInputs() const { return m_inputs; }
    const std::vector<LinearSystem::Port>& getOutputs() const { return m_outputs; }
    /** By which the same outputs are chosen again. **/
    const std::vector<std::string>& getOutputNames() const { return m_outputNames; }
    /** See LinearSystem. **/
    const std::vector<std::string>& getLeftOut() const { return m_leftOut; }
    /** At frequencies [Hz]. @param observer  told how many are done **/
    std::vector<SimTK::Matrix_<SimTK::Complex>> calcTransfers(
        const std::vector<double>& frequencies,
        const std::function<void(size_t done)>& observer) const;
    /** At a frequency, what outputs would be if all that moves, moved along what they see: a
    response that is next to nothing beside this is round-off. Nothing
    where only joints' forces are observed. **/
    SimTK::Matrix calcBounds(double frequency) const;
    /** Displacements in Simbody's numbering of u, a column for each input.
    @throws std::runtime_error for what is not at rest. **/
    SimTK::Matrix_<SimTK::Complex> calcMotions(double frequency) const;
    const SimTK::State& getState() const { return m_state; }
    /** Independent motions that grow by themselves. **/
    int countUnstable() const {
        return m_blocks ? m_blocks->countUnstable() : m_space->countUnstable();
    }

private:
    SimTK::Matrix_<SimTK::Complex> combine(const SimTK::Matrix_<SimTK::Complex>& responses,
                                           double omega) const;

    std::shared_ptr<const Model> m_model;  ///< with a load where the unbalance is
    SimTK::State m_state;
    std::optional<Unbalance> m_unbalance;
    std::vector<LinearSystem::Port> m_inputs, m_outputs;
    std::vector<std::string> m_outputNames, m_leftOut;
    std::vector<std::pair<std::string, int>> m_stresses;
    LinearInputs m_inputEffects;
    LinearOutputs m_outputEffects;
    std::optional<FrequencyResponse> m_blocks;
    std::optional<StateSpace> m_space, m_motions;  ///< of outputs; of displacements
};

/** Responses at frequencies [Hz]; the observer is told how many are done. **/
using TransferFunction = std::function<std::vector<SimTK::Matrix_<SimTK::Complex>>(
    const std::vector<double>& frequencies, const std::function<void(size_t done)>& observer)>;
/** Which responses are no more than round-off, for each output and input: those that are so at all
frequencies. @param bounds  see ModelResponse::calcBounds() **/
std::vector<std::vector<bool>> findRoundOff(
    const std::vector<SimTK::Matrix_<SimTK::Complex>>& transfers,
    const std::vector<SimTK::Matrix>& bounds);
/** Whether frequencies are added between the wanted ones where responses turn: enough to see them,
or to integrate their squares. **/
enum class Refinement { None, AtResonances, ForIntegrals };
/** Fills frequencies and transfers. @param frequencies  [Hz], in any order; each counts once **/
void calcHarmonicResponse(const TransferFunction& calcTransfers,
                          const std::vector<double>& frequencies, Refinement refinement,
                          const std::function<void(double fraction)>& observer,
                          HarmonicResponse& response);

/** A one-sided power spectral density over frequency, by straight lines in logarithms; zero
 * outside.
 * **/
struct Spectrum {
    std::vector<double> frequencies;  ///< ascending [Hz]; none: everywhere the first density
    std::vector<double> densities;    ///< [unit²/Hz]

    double calcDensity(double frequency) const;
};
/** Of densities at ascending frequencies, by the same lines. **/
double integrateSpectrum(const std::vector<double>& frequencies,
                         const std::vector<double>& densities);

/** The whole model. @param about  assembled
@param form  of its states
@throws std::runtime_error if the State is no equilibrium and no steady motion, or what is observed
    follows the speed of an input, with the cure. **/
LinearSystem linearizeModel(const ModelText& text, const ModelOptions& options,
                            const std::shared_ptr<const Model>& model, const Probes& probes,
                            const SimTK::State& about, const std::vector<std::string>& inputs,
                            const std::vector<std::string>& outputs, const ModalForm& form,
                            const std::function<void()>& observer);

}  // namespace model
}  // namespace simflex
