#pragma once
/** @file
This process' share of a sweep that several processes run. **/

#include <string>

namespace simflex {
namespace model {

/** Read from the environment of mpirun (Open MPI, MPICH), srun or a Slurm job array. No MPI library
is needed, since processes claim cases by locks in the sweep's folder. **/
struct SweepShare {
    enum class Kind {
        Alone,     ///< runs all cases; others started by hand may help
        Rank,      ///< of an MPI job: takes cases until there are none left
        ArrayTask  ///< of a job array: runs every count-th case
    };
    Kind kind = Kind::Alone;
    int index = 0, count = 1;

    static SweepShare fromEnvironment();
    /** "rank 1 of 4"; empty if alone. **/
    std::string describe() const;
};

}  // namespace model
}  // namespace simflex
