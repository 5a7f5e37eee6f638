#pragma once
/** @file
One instance of a model that is an FMU: what fmi2… and fmi3… functions ask a Session for. Errors are
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

    /** @param resources  path of that folder
    @throws std::runtime_error if they are not those of the token. **/
    FmuInstance(const std::string& resources, const std::string& token, Log log);

    void log(Level level, const std::string& message) const { m_log(level, message); }
    void setStartTime(double time);
    void enterInitialization();
    void exitInitialization();
    void reset();

    double get(unsigned reference);
    void set(unsigned reference, double value);
    /** Of an input. **/
    void setRate(unsigned reference, double rate);

    /** How fast outputs change at this time with inputs in the direction of the seeds, all else as
    it is: by differences of the fourth order, after which nothing has changed. **/
    std::vector<double> calcDirectionalDerivative(const std::vector<unsigned>& outputs,
                                                  const std::vector<unsigned>& inputs,
                                                  const std::vector<double>& seeds);

    enum class Outcome { Done, Terminated };
    /** @throws also if it is not at `time`; a unit that has failed stays where it was. **/
    Outcome doStep(double time, double length);
    /** Where it is. **/
    double getTime();
    bool isTerminated() const { return m_isTerminated; }

    /** All that decides on what it does from now on. **/
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

    /** With what has been set. **/
    Session& updSession();
    void visit(Archive& archive, Kept& kept, std::string& state) const;
    /** @throws std::runtime_error unless it is of an input. **/
    const std::string& findInput(unsigned reference) const;

    std::string m_folder;
    Manifest m_manifest;
    Log m_log;
    Phase m_phase = Instantiated;
    double m_startTime = 0;
    bool m_isTerminated = false;
    std::vector<std::string> m_settings;  ///< of parameters and of inputs at the start
    std::vector<Session::Input> m_pending;
    std::unique_ptr<Session> m_session;
};

}  // namespace fmu
}  // namespace simflex
