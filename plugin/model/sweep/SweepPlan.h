#pragma once
/** @file
The cases of a sweep: one run of a model for each combination of values. **/

#include <string>
#include <vector>

#include "simflex/model/analyses/Provenance.h"
#include "simflex/model/file/ModelReader.h"

namespace simflex {
namespace model {

/** Values of a key of the model, as YAML texts. **/
struct SweptKey {
    std::string name;  ///< "speed", or a path: "solver.accuracy"
    std::vector<std::string> values;
    std::string path;  ///< in the model: "parameters.speed"; set by findSweptPaths()
};

struct SweepCase {
    std::vector<std::string> values;  ///< of the keys, in their order
    std::string folder;               ///< name of its own folder: "speed=50_length=0.1"
    std::string error = {};           ///< why it cannot be run; empty if it can
};

struct SweepPlan {
    ModelText model;                ///< with the settings common to all cases; its path is absolute
    std::string name;               ///< of the analysis of type sweep, if the model has several
    std::vector<std::string> only;  ///< analyses to run; empty: all
    std::vector<SweptKey> keys;
    std::vector<SweepCase> cases;
    std::vector<std::string> of;  ///< columns of the table; empty: all
    bool hasPictures = false;     ///< cases draw the model's pictures
    InputChecksums inputs;        ///< of files and programs that all cases depend on

    /** Settings of a case: the common ones, then "parameters.speed=50" for each key. **/
    std::vector<std::string> getSettings(const SweepCase& one) const;
    /** Checksums of all inputs of a case. **/
    InputChecksums calcInputs(const SweepCase& one) const;
};

enum class SweepOrder { Grid, List };

/** Parses "speed=50,100" or "speed=50:150:5" (from, to, count).
@throws std::runtime_error. **/
SweptKey parseSweptKey(const std::string& text);

/** Reads cases from a CSV file: names in its first line, then one line for each case.
@throws std::invalid_argument with file and line; std::runtime_error. **/
std::vector<SweptKey> readSweptKeys(const std::string& path);

/** Finds the path of each key: a name denotes a parameter of the model, else one of its sections.
@throws ModelError suggesting the nearest parameter. **/
void findSweptPaths(SweepPlan& plan);

/** Fills `cases`. Grid: all combinations, the last key varying fastest; List: all first values, all
second values …
@throws std::runtime_error if there are none, or more than 100 000, or lists differ in length. **/
void makeSweepCases(SweepPlan& plan, SweepOrder order);

/** Takes keys, analysis and columns from the model's own analysis of type sweep: the one of that
name, or the only one if `name` is empty.
@throws ModelError, std::runtime_error. **/
void takeModelSweep(SweepPlan& plan, const std::string& name);

/** Checks the settings common to all cases.
@throws ModelError; for a list of values it says how to vary them. **/
void checkSweepSettings(const ModelText& model);

/** maximum, minimum, mean, rms, final, range. **/
const std::vector<std::string>& getSweepStatistics();

/** Checks that requested columns name existing statistics and, if the model names any probes,
existing probes.
@throws std::runtime_error suggesting the nearest name. **/
void checkSweepColumns(const SweepPlan& plan);

/** Checks each case's model, stores its error, and sets `inputs`.
@throws std::runtime_error for the first case if all of them have errors. **/
void checkSweepCases(SweepPlan& plan);

}  // namespace model
}  // namespace simflex
