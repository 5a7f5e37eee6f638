#pragma once
/** @file
modelDescription.xml of an FMU for co-simulation, FMI 2.0 or 3.0: what it tells of the unit and its
variables. Internal. **/

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace simflex {

struct FmuVariable {
    enum class Type { Real, Integer, Boolean, Other };  ///< Real: Float64, too; Integer: Int32
    enum class Causality { Parameter, Input, Output, Independent, Other };

    std::string name;
    unsigned reference = 0;
    Type type = Type::Real;
    std::string typeText;  ///< as the file has it: "Float32"
    Causality causality = Causality::Other;
    std::string unit, description;
    std::optional<double> start;
    bool isArray = false;
    /** Of an output: names of inputs that it depends on at once; nothing: all of them. **/
    std::optional<std::vector<std::string>> dependencies;
};

struct FmuDescription {
    int version = 2;         ///< 2 or 3
    std::string name, text;  ///< of the model
    std::string token;       ///< of this very content
    std::string identifier;  ///< of the binary: IDENTIFIER.so
    std::string tool;
    bool canKeepState = false, canSerializeState = false;
    bool hasDerivatives = false;  ///< directional ones
    bool isOncePerProcess = false, canInterpolateInputs = false, needsTool = false;
    std::optional<double> stopTime, stepSize;
    std::vector<FmuVariable> variables;

    /** Null: there is none. **/
    const FmuVariable* find(const std::string& variable) const;
};

/** @returns the file's text: units become those of the standard where they are known **/
std::string writeFmuDescription(const FmuDescription& description);

/** @throws std::runtime_error that says why it is none for co-simulation by FMI 2.0 or 3.0. **/
FmuDescription readFmuDescription(const std::filesystem::path& path);

}  // namespace simflex
