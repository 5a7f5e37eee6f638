// simflex_mpi: `mpirun -n 4 simflex_mpi reduce …` is simflex with its stiffness matrix distributed
// over MPI processes on one or several machines. Rank 0 reads the model and writes the part.

#include "simflex/cli/Program.h"
#include "simflex/reduction/SlepcSolver.h"

int main(int argc, char** argv) {
    return simflex::runWithSlepc(argc, argv, [&] {
        return simflex::cli::runProgram(argc, argv, std::make_shared<simflex::SlepcSolver>());
    });
}
