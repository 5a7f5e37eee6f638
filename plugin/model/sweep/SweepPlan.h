#pragma once
/** @file
The cases of a sweep: one run of a model for each choice of values. **/

#include <string>
#include <vector>

#include "simflex/model/analyses/Provenance.h"
#include "simflex/model/file/ModelReader.h"

namespace simflex {
namespace model {

/** What a key of the model takes, as YAML texts. **/
struct SweptKey {
    std::string name;  ///< "speed", or a path: "solver.accuracy"
    std::vector<std::string> values;
    std::string path;  ///< in the model: "parameters.speed"; known after findSweptPaths()
};

struct SweepCase {
    std::vector<std::string> values;  ///< of the keys, in their order
    std::string folder;               ///< name of its own folder: "speed=50_length=0.1"
    std::string error = {};           ///< why it cannot be run; empty: it can
};

struct SweepPlan {
    ModelText model;   ///< with the settings that all cases share; its path is absolute
    std::string name;  ///< of the analysis of type sweep, where the model has several
    std::vector<std::string> only;  ///< analyses that are done; none: all
    std::vector<SweptKey> keys;
    std::vector<SweepCase> cases;
    std::vector<std::string> of;  ///< columns of the table; none: all
    bool hasPictures = false;     ///< cases draw the pictures of the model
    InputChecksums inputs;        ///< of files and program that all cases depend on

    /** "parameters.speed=50" for each key, behind those of all cases. **/
    std::vector<std::string> getSettings(const SweepCase& one) const;
    /** What the results of a case depend on. **/
    InputChecksums calcInputs(const SweepCase& one) const;
};

enum class SweepOrder { Grid, List };

/** "speed=50,100" or "speed=50:150:5" (from, to, count). @throws std::runtime_error. **/
SweptKey parseSweptKey(const std::string& text);

/** The cases of a CSV file: names in its first line, then one line for each case.
@throws std::invalid_argument with file and line; std::runtime_error. **/
std::vector<SweptKey> readSweptKeys(const std::string& path);

/** Finds the path of each key: a name is that of a parameter of the model, else of one of its
chapters. @throws ModelError proposing the nearest parameter. **/
void findSweptPaths(SweepPlan& plan);

/** Fills `cases`. Grid: all combinations, the last key varies fastest; List: first values, second
values … @throws std::runtime_error if there are none, or more than 100 000, or lists differ in
length. **/
void makeSweepCases(SweepPlan& plan, SweepOrder order);

/** Takes keys, analysis and columns of the model's own analysis of type sweep: the one of that
name, or the only one if `name` is empty. @throws ModelError, std::runtime_error. **/
void takeModelSweep(SweepPlan& plan, const std::string& name);

/** Checks the settings that all cases share. @throws ModelError; of several values it says how to
vary them. **/
void checkSweepSettings(const ModelText& model);

/** maximum, minimum, mean, rms, final, range. **/
const std::vector<std::string>& getSweepStatistics();

/** Checks that the columns wanted are of probes that the model names, if it names any, and their
statistics. @throws std::runtime_error proposing the nearest. **/
void checkSweepColumns(const SweepPlan& plan);

/** Checks each case's model, notes its error, and finds `inputs`. @throws std::runtime_error that
names the first case, if all of them have errors. **/
void checkSweepCases(SweepPlan& plan);

}  // namespace model
}  // namespace simflex
