#include "simflex/model/sweep/SweepShare.h"

#include <algorithm>
#include <cstdlib>
#include <optional>
#include <utility>

#include "simflex/base/NumberText.h"

namespace simflex {
namespace model {
namespace {

std::optional<int> readVariable(const char* name) {
    const char* text = std::getenv(name);
    int value = 0;
    if (!text || !readInteger(text, value) || value < 0 || value > 1000000) return {};
    return value;
}

}  // namespace

SweepShare SweepShare::fromEnvironment() {
    for (const auto& [rank, size] :
         {std::pair<const char*, const char*>{"OMPI_COMM_WORLD_RANK", "OMPI_COMM_WORLD_SIZE"},
          {"PMI_RANK", "PMI_SIZE"}}) {
        const auto index = readVariable(rank), count = readVariable(size);
        if (index && count && *index < *count) return {Kind::Rank, *index, *count};
    }
    const auto task = readVariable("SLURM_ARRAY_TASK_ID"),
               count = readVariable("SLURM_ARRAY_TASK_COUNT"),
               first = readVariable("SLURM_ARRAY_TASK_MIN"),
               step = readVariable("SLURM_ARRAY_TASK_STEP");
    if (task && count && *count > 0 && *task >= first.value_or(0)) {
        const int index = (*task - first.value_or(0)) / std::max(1, step.value_or(1));
        if (index < *count) return {Kind::ArrayTask, index, *count};
    }
    const auto process = readVariable("SLURM_PROCID"), tasks = readVariable("SLURM_STEP_NUM_TASKS");
    if (process && tasks && *process<*tasks&& * tasks> 1) return {Kind::Rank, *process, *tasks};
    return {};
}

std::string SweepShare::describe() const {
    if (kind == Kind::Alone) return "";
    return (kind == Kind::Rank ? "rank " : "array task ") + std::to_string(index) + " of " +
           std::to_string(count);
}

}  // namespace model
}  // namespace simflex
