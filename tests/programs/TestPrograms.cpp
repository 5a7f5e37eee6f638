// Simbody programs run by SimTK::RungeKuttaMersonIntegrator at 1e-9 and by our integrators, with
// and without the authors' handles.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "programs/Program.h"
#include "simflex/solver/BdfIntegrator.h"
#include "simflex/solver/TimeStepper.h"

namespace simflex::test {

std::ostream& operator<<(std::ostream& out, const Program& program) {
    return out << program.name;
}

namespace {

using namespace SimTK;

/** The results of a run at the start and at evenly spaced times. **/
struct Record {
    struct Sample {
        Real time;
        Vector q, u, z, observed;
    };
    std::vector<Sample> samples;
    std::vector<Call> calls;

    void take(const Model& model, const State& state) {
        samples.push_back({state.getTime(), state.getQ(), state.getU(), state.getZ(),
                           model.observe ? model.observe(state) : Vector()});
    }
};

constexpr int numSamples = 7;

Real getSampleTime(const Model& model, int i) {
    return model.duration * i / numSamples;
}

enum class Handles { Kept, Dropped };

template <class Integrator, class Stepper>
Record run(const Program& program, Real accuracy, Handles handles) {
    const auto model = program.build();
    if (handles == Handles::Dropped) model->handles.reset();
    Integrator integrator(model->system);
    integrator.setAccuracy(accuracy);
    if (!isNaN(model->longestStep)) integrator.setMaximumStepSize(model->longestStep);
    Stepper stepper(model->system, integrator);
    stepper.initialize(model->state);
    Record record;
    record.take(*model, stepper.getState());
    for (int i = 1; i <= numSamples && !integrator.isSimulationOver(); ++i) {
        stepper.stepTo(getSampleTime(*model, i));
        record.take(*model, stepper.getState());
    }
    record.calls = model->calls;
    return record;
}

/** Computed once for all tests of a program. **/
const Record& getReference(const Program& program) {
    static std::map<std::string, Record> records;
    auto found = records.find(program.name);
    if (found == records.end())
        found =
            records
                .emplace(program.name, run<RungeKuttaMersonIntegrator, SimTK::TimeStepper>(
                                           program, program.referenceAccuracy, Handles::Dropped))
                .first;
    return found->second;
}

Real compare(const Vector& a, const Vector& b) {
    if (a.size() != b.size()) return Infinity;
    Real error = 0;
    for (int i = 0; i < a.size(); ++i)
        error = std::max(error, std::abs(a[i] - b[i]) / (1 + std::abs(b[i])));
    return error;
}

Real compare(const Record::Sample& a, const Record::Sample& b) {
    return std::max({compare(a.q, b.q), compare(a.u, b.u), compare(a.z, b.z),
                     compare(a.observed, b.observed), std::abs(a.time - b.time)});
}

class Programs : public testing::TestWithParam<Program> {
protected:
    /** @return the largest error of states and call times after the start. **/
    Real expectSame(Real accuracy, Handles handles) const {
        SCOPED_TRACE("accuracy " + String(accuracy));
        const Record& reference = getReference(GetParam());
        const Record ours = run<BdfIntegrator, simflex::TimeStepper>(GetParam(), accuracy, handles);
        EXPECT_LT(compare(ours.samples[0], reference.samples[0]), 1e-8) << "the start differs";
        EXPECT_EQ(ours.samples.size(), reference.samples.size()) << "another end";
        Real error = 0;
        for (size_t i = 1; i < std::min(ours.samples.size(), reference.samples.size()); ++i)
            error = std::max(error, compare(ours.samples[i], reference.samples[i]));
        EXPECT_EQ(ours.calls.size(), reference.calls.size());
        for (size_t i = 0; i < std::min(ours.calls.size(), reference.calls.size()); ++i) {
            EXPECT_EQ(ours.calls[i].who, reference.calls[i].who) << "call " << i;
            error = std::max(error, std::abs(ours.calls[i].time - reference.calls[i].time));
        }
        return error;
    }

    // 2 % at 1e-5; at 1e-7 less by the factor of order two, or a quarter of that.
    void expectSameMotion(Handles handles) const {
        const Real coarse = expectSame(1e-5, handles), fine = expectSame(1e-7, handles);
        EXPECT_LT(coarse, 0.02);
        // A less accurate reference has errors of its own.
        const Real floor = GetParam().referenceAccuracy > 1e-9 ? 1e-3 : 2e-6;
        EXPECT_LT(fine, std::max(coarse * std::pow(1e-2, 2.0 / 3) * 4, floor));
    }
};

TEST_P(Programs, MoveAsWithSimbodysIntegrator) {
    expectSameMotion(Handles::Kept);
}

TEST_P(Programs, DoSoWhenTheirHandlesAreGone) {
    expectSameMotion(Handles::Dropped);
}

// Cable trackers store the previous path as a start value: this memory does not limit steps to a
// low order.
TEST(Cables, TakeLittleMoreStepsThanWithSimbodysIntegrator) {
    constexpr Real accuracy = 1e-7;
    for (const Program& program : getMechanismPrograms()) {
        if (String(program.name) != "CableOverADrum" && String(program.name) != "Wrapping")
            continue;
        SCOPED_TRACE(program.name);
        const auto count = [&](auto&& integrator, const Model& model) {
            integrator.setAccuracy(accuracy);
            integrator.initialize(model.state);
            while (integrator.stepTo(model.duration, Infinity) !=
                   SimTK::Integrator::ReachedReportTime) {
            }
            return integrator.getNumStepsTaken();
        };
        const auto ours = program.build(), theirs = program.build();
        EXPECT_LE(count(BdfIntegrator(ours->system), *ours),
                  4 * count(RungeKuttaMersonIntegrator(theirs->system), *theirs));
    }
}

const auto getName = [](const testing::TestParamInfo<Program>& info) {
    return std::string(info.param.name);
};
INSTANTIATE_TEST_SUITE_P(Memory, Programs, testing::ValuesIn(getMemoryPrograms()), getName);
INSTANTIATE_TEST_SUITE_P(Events, Programs, testing::ValuesIn(getEventPrograms()), getName);
INSTANTIATE_TEST_SUITE_P(Mechanisms, Programs, testing::ValuesIn(getMechanismPrograms()), getName);

}  // namespace
}  // namespace simflex::test
