#pragma once
/** @file
Errors in model files, with their places. **/

#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace simflex {

/** A place in the model file or in a setting; line and column count from 1. **/
struct ModelPlace {
    std::string file;  ///< or "setting 'solver.accuracy=1e-5'"
    int line = 0;      ///< 0: no place within the file
    int column = 0;

    /** "crank.yaml:12:9". **/
    std::string getText() const;
};

/** An error whose text begins with file, line and column: "crank.yaml:12:9: joints.bearing: …". **/
class ModelError : public std::runtime_error {
public:
    struct Mistake {
        ModelPlace place;
        std::string key;      ///< "joints.bearing.axis"; may be empty
        std::string message;  ///< without place and key
    };
    explicit ModelError(const std::string& message, std::vector<Mistake> mistakes = {})
        : std::runtime_error(message), m_mistakes(std::move(mistakes)) {}
    ModelError(const ModelPlace& place, const std::string& key, const std::string& message)
        : ModelError(place.getText() + ": " + (key.empty() ? "" : key + ": ") + message,
                     {{place, key, message}}) {}

    /** One for each line of the text that reports a mistake; empty if they have no place. **/
    const std::vector<Mistake>& getMistakes() const { return m_mistakes; }

private:
    std::vector<Mistake> m_mistakes;
};

}  // namespace simflex
