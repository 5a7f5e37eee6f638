#pragma once
/** @file
Inputs and outputs of a linearised model: derivatives of its equations and probes with respect to
numbers in its file. **/

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

/** Treatment of a von Mises stress at a node. Under random motion it has an effective value but no
response: its square is a quadratic form of the six components, which have responses. **/
enum class EffectiveStress { AsItIs, ByComponents };

/** Outputs that have a kink at the State, such as the magnitude of a vector that is zero. **/
struct OutputKinks : std::runtime_error {
    OutputKinks(std::vector<std::string> kinks, std::vector<std::string> others);
    std::vector<std::string> names;
    std::vector<std::string> rest;  ///< the others
};

/** Columns of probes by name. **/
class LinearOutputPorts {
public:
    /** @param names  such as "tip" or "tip.y"; all probes if empty
    @throws ModelError that proposes the nearest name. **/
    LinearOutputPorts(std::shared_ptr<const Model> model, const Probes& probes,
                      const std::vector<std::string>& names,
                      EffectiveStress effectiveStress = EffectiveStress::AsItIs);

    /** Chooses other columns, as the constructor does. **/
    void choose(const std::vector<std::string>& names);
    const std::vector<LinearSystem::Port>& getPorts() const { return m_ports; }
    EffectiveStress getEffectiveStress() const { return m_effectiveStress; }
    /** Stresses given by components: the name, and the first of six ports xx, yy, zz, xy, yz,
    zx. **/
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
    std::vector<std::string> m_names;  ///< by which the ports are chosen
    EffectiveStress m_effectiveStress;
    std::vector<std::pair<std::string, int>> m_stresses;
};

/** Numbers in a model's file, by path. **/
class LinearInputPorts {
public:
    /** @param paths  such as "loads.push.force.y"; "loads.push" for all numbers of the load; "push"
        for an input of the model
    @throws ModelError for an unknown path, with the known ones, and for a path given twice. **/
    LinearInputPorts(const ModelText& text, const ModelOptions& options, const Model& model,
                     const std::vector<std::string>& paths);

    const std::vector<LinearSystem::Port>& getPorts() const { return m_ports; }
    /** Builds the model with other numbers, several times for each input.
    @param observed, outputs  the ports observed, and their names as LinearOutputPorts takes them
    @param observer  called before each build
    @throws std::runtime_error for an input that changes parts or the structure of the model, the
        speed of a motion, or nothing. **/
    LinearInputs differentiate(const OperatingPoint& point, const LinearOutputPorts& observed,
                               const std::vector<std::string>& outputs,
                               const std::function<void()>& observer) const;

private:
    struct Source {
        std::string setting;  ///< path as in settings, with items of lists by number
        std::string text;     ///< the number as written
        double value;         ///< present value; NaN for a law
        int input = -1;       ///< number of the input's state; if >= 0 there is no setting
    };
    /** Adds the model's own inputs if a path means them: "push", "inputs.push", "inputs". **/
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

/** A force moment·ω² that rotates about an axis of Ground at the frequency of the response. **/
struct Unbalance {
    std::string on;     ///< frame, as in a model file
    double moment = 0;  ///< mass times distance from the axis [kg m]
    int axis = 0;       ///< 0 x, 1 y, 2 z; the force rotates from the next axis to the one after
};

/** Response of a model's outputs to its inputs about a State, at any frequency. It uses block
elimination at rest, and first-order matrices along a steady motion or if the model has states of
its own. **/
class ModelResponse {
public:
    /** Takes the arguments of linearizeModel(). @param unbalance  becomes the last input,
    "unbalance" **/
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
    /** Names that choose the same outputs again. **/
    const std::vector<std::string>& getOutputNames() const { return m_outputNames; }
    /** See LinearSystem. **/
    const std::vector<std::string>& getLeftOut() const { return m_leftOut; }
    /** Responses at frequencies [Hz]. @param observer  called with the number of those done **/
    std::vector<SimTK::Matrix_<SimTK::Complex>> calcTransfers(
        const std::vector<double>& frequencies,
        const std::function<void(size_t done)>& observer) const;
    /** Largest values that outputs could have at a frequency, if all motion were along their
    gradients: a response that is tiny compared with its bound is round-off. Zero for outputs that
    observe only forces of joints. **/
    SimTK::Matrix calcBounds(double frequency) const;
    /** Displacements in Simbody's numbering of u, with a column for each input.
    @throws std::runtime_error if the system is not at rest. **/
    SimTK::Matrix_<SimTK::Complex> calcMotions(double frequency) const;
    const SimTK::State& getState() const { return m_state; }
    /** Number of independent motions that grow without excitation. **/
    int countUnstable() const {
        return m_blocks ? m_blocks->countUnstable() : m_space->countUnstable();
    }

private:
    SimTK::Matrix_<SimTK::Complex> combine(const SimTK::Matrix_<SimTK::Complex>& responses,
                                           double omega) const;

    std::shared_ptr<const Model> m_model;  ///< with a load at the place of the unbalance
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

/** Returns responses at frequencies [Hz]; the observer is called with the number of those done. **/
using TransferFunction = std::function<std::vector<SimTK::Matrix_<SimTK::Complex>>(
    const std::vector<double>& frequencies, const std::function<void(size_t done)>& observer)>;
/** Finds, for each output and input, whether the response is round-off at all frequencies.
@param bounds  see ModelResponse::calcBounds() **/
std::vector<std::vector<bool>> findRoundOff(
    const std::vector<SimTK::Matrix_<SimTK::Complex>>& transfers,
    const std::vector<SimTK::Matrix>& bounds);
/** Whether frequencies are added between the given ones where responses change quickly: enough to
show the responses, or to integrate their squares. **/
enum class Refinement { None, AtResonances, ForIntegrals };
/** Fills frequencies and transfers of `response`.
@param frequencies  [Hz], in any order; duplicates are dropped **/
void calcHarmonicResponse(const TransferFunction& calcTransfers,
                          const std::vector<double>& frequencies, Refinement refinement,
                          const std::function<void(double fraction)>& observer,
                          HarmonicResponse& response);

/** A one-sided power spectral density over frequency: straight lines between points on logarithmic
axes, zero outside them. **/
struct Spectrum {
    std::vector<double> frequencies;  ///< ascending [Hz]; if empty: the first density, everywhere
    std::vector<double> densities;    ///< [unit²/Hz]

    double calcDensity(double frequency) const;
};
/** Integrates densities at ascending frequencies, with the same lines between them. **/
double integrateSpectrum(const std::vector<double>& frequencies,
                         const std::vector<double>& densities);

/** Linearises the whole model. @param about  an assembled State
@param form  of the model's states
@throws std::runtime_error, with the cure, if the State is neither an equilibrium nor a steady
    motion, or if an output follows the speed of an input. **/
LinearSystem linearizeModel(const ModelText& text, const ModelOptions& options,
                            const std::shared_ptr<const Model>& model, const Probes& probes,
                            const SimTK::State& about, const std::vector<std::string>& inputs,
                            const std::vector<std::string>& outputs, const ModalForm& form,
                            const std::function<void()>& observer);

}  // namespace model
}  // namespace simflex
