#pragma once
/** @file
Reads model files (YAML) and checks every key, kind and range against the schema (Schema.h) before
anything is built. Nothing in a file is executed. **/

#include <initializer_list>
#include <map>
#include <string>
#include <vector>

#include "simflex/model/file/ModelValue.h"
#include "simflex/model/formula/OwnFunction.h"

namespace simflex {

/** The text of a model, from a file or written by a program key by key:

    ModelText pendulum;
    pendulum.set("bodies.bob", "{shape: {sphere: 0.05}, density: 7800}");
    pendulum.set("gravity", {0, -9.81, 0});
    pendulum.set("solver.accuracy", 1e-6);  **/
struct ModelText {
    std::string path;                   ///< of the file; relative paths start at its folder
    std::string text = "simflex: 1\n";  ///< the file's bytes
    std::vector<std::string> settings;  ///< "solver.accuracy=1e-5", in order of application
    std::map<std::string, formula::OwnFunction> functions{};  ///< functions that formulas may call

    /** Sets the value at a path, in YAML; replaces an earlier setting of it. A single parameter can
    be changed, not added. **/
    void set(const std::string& key, const std::string& value);
    void set(const std::string& key, const char* value) { set(key, std::string(value)); }
    void set(const std::string& key, double value);
    void set(const std::string& key, std::initializer_list<double> values);
};

/** Parses the text, applies its settings and checks the result against the schema.
@throws ModelError with file, line and column, or naming the setting. **/
model::ModelValue readModel(const ModelText& text);

/** Reads the file's bytes.
@param settings  "PATH=VALUE" with VALUE in YAML: replaces or adds the value at PATH
        ("solver.accuracy=1e-5", "joints.bearing.axis=[0,0,1]", "analyses.run.duration=2")
@throws std::runtime_error if the file cannot be read. **/
ModelText loadModelText(const std::string& path, const std::vector<std::string>& settings = {});

}  // namespace simflex
