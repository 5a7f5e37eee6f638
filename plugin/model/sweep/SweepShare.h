#pragma once
/** @file
Which part of a sweep this process has, when several share it. **/

#include <string>

namespace simflex {
namespace model {

/** Known from the environment that mpirun (Open MPI, MPICH), srun or a Slurm job array set; no MPI
library is needed, since processes claim cases by locks in the sweep's folder. **/
struct SweepShare {
    enum class Kind {
        Alone,     ///< does all cases; others that are started by hand may help
        Rank,      ///< of an MPI job: takes cases until there is none left
        ArrayTask  ///< of a job array: does every count-th case
    };
    Kind kind = Kind::Alone;
    int index = 0, count = 1;

    static SweepShare fromEnvironment();
    /** "rank 1 of 4"; empty if alone. **/
    std::string describe() const;
};

}  // namespace model
}  // namespace simflex
