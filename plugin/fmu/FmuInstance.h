#pragma once
/** @file
One instance of a model as an FMU: implements the fmi2… and fmi3… functions by a Session. Errors are
exceptions here. Internal. **/

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "simflex/fmu/FmuExport.h"

namespace simflex {

class Archive;

namespace fmu {

class FmuInstance {
public:
    enum class Level { Warning, Error };
    using Log = std::function<void(Level level, const std::string& message)>;

    /** @param resources  path of the resources folder
    @throws std::runtime_error if the resources do not match the token. **/
    FmuInstance(const std::string& resources, const std::string& token, Log log);

    void log(Level level, const std::string& message) const { m_log(level, message); }
    void setStartTime(double time);
    void enterInitialization();
    void exitInitialization();
    void reset();

    double get(unsigned reference);
    void set(unsigned reference, double value);
    /** Sets the rate of an input. **/
    void setRate(unsigned reference, double rate);

    /** Returns the derivatives of outputs at this time for inputs in the direction of the seeds, by
    fourth-order differences. The instance is unchanged afterwards. **/
    std::vector<double> calcDirectionalDerivative(const std::vector<unsigned>& outputs,
                                                  const std::vector<unsigned>& inputs,
                                                  const std::vector<double>& seeds);

    enum class Outcome { Done, Terminated };
    /** @throws also if the instance is not at `time`; after a failure the unit stays where it
    was. **/
    Outcome doStep(double time, double length);
    double getTime();
    bool isTerminated() const { return m_isTerminated; }

    /** The complete state of the instance. **/
    struct Kept {
        int phase;
        double startTime;
        bool isTerminated;
        std::vector<std::string> settings;
        std::vector<Session::Input> pending;
        std::optional<SavedState> state;
    };
    Kept keep();
    void restore(const Kept& kept);
    std::string pack(const Kept& kept);
    Kept unpack(const std::string& bytes);

private:
    enum Phase { Instantiated, Initialization, Stepping };

    /** Returns the session, created with the values that were set. **/
    Session& updSession();
    void visit(Archive& archive, Kept& kept, std::string& state) const;
    /** @throws std::runtime_error unless it is an input. **/
    const std::string& findInput(unsigned reference) const;

    std::string m_folder;
    Manifest m_manifest;
    Log m_log;
    Phase m_phase = Instantiated;
    double m_startTime = 0;
    bool m_isTerminated = false;
    std::vector<std::string> m_settings;  ///< parameters, and initial values of inputs
    std::vector<Session::Input> m_pending;
    std::unique_ptr<Session> m_session;
};

}  // namespace fmu
}  // namespace simflex
