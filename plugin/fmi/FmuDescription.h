#pragma once
/** @file
modelDescription.xml of an FMU for co-simulation, FMI 2.0 or 3.0. Internal. **/

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace simflex {

struct FmuVariable {
    enum class Type { Real, Integer, Boolean, Other };  ///< Real includes Float64, Integer Int32
    enum class Causality { Parameter, Input, Output, Independent, Other };

    std::string name;
    unsigned reference = 0;
    Type type = Type::Real;
    std::string typeText;  ///< as in the file: "Float32"
    Causality causality = Causality::Other;
    std::string unit, description;
    std::optional<double> start;
    bool isArray = false;
    /** For outputs: names of inputs with direct influence; nothing: all of them. **/
    std::optional<std::vector<std::string>> dependencies;
};

struct FmuDescription {
    int version = 2;         ///< 2 or 3
    std::string name, text;  ///< of the model
    std::string token;       ///< identifies this content
    std::string identifier;  ///< name of the binary: IDENTIFIER.so
    std::string tool;
    bool canKeepState = false, canSerializeState = false;
    bool hasDerivatives = false;  ///< directional derivatives
    bool isOncePerProcess = false, canInterpolateInputs = false, needsTool = false;
    std::optional<double> stopTime, stepSize;
    std::vector<FmuVariable> variables;

    /** Returns null if there is none. **/
    const FmuVariable* find(const std::string& variable) const;
};

/** @returns the file's text; known units are replaced by the standard's **/
std::string writeFmuDescription(const FmuDescription& description);

/** @throws std::runtime_error with the reason why the file does not describe an FMU for
co-simulation by FMI 2.0 or 3.0. **/
FmuDescription readFmuDescription(const std::filesystem::path& path);

}  // namespace simflex
