#pragma once
/** @file
Reads model files (YAML) and checks every key, kind and range against the schema (Schema.h) before
anything is built. Nothing in a file is executed. **/

#include <string>
#include <vector>

#include "simflex/model/file/ModelValue.h"

namespace simflex {
namespace model {

/** A model as read. **/
struct ModelText {
    std::string path;                   ///< of the file; its folder is where relative paths begin
    std::string text;                   ///< the file's bytes
    std::vector<std::string> settings;  ///< "solver.accuracy=1e-5", in order of application
};

/** @param settings  "PATH=VALUE", VALUE in YAML: replaces or adds what stands at PATH
        ("solver.accuracy=1e-5", "joints.bearing.axis=[0,0,1]", "analyses.run.duration=2")
@throws ModelError with file, line and column, or naming the setting; std::runtime_error if the file
    cannot be read. **/
ModelValue readModel(const ModelText& text);

/** Reads the file's bytes. @throws std::runtime_error. **/
ModelText loadModelText(const std::string& path, const std::vector<std::string>& settings = {});

}  // namespace model
}  // namespace simflex
