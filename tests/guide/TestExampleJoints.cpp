/** @file
Pictures of the example models: joints stay closed at any exaggeration. **/

#include <gtest/gtest.h>

#include <filesystem>

#include "simflex/model/Session.h"
#include "simflex/model/file/ModelReader.h"
#include "simflex/model/pictures/Pictures.h"

namespace simflex {
namespace {

TEST(ExampleModels, NoJointIsDrawnApartUpToAThousandTimes) {
    std::filesystem::create_directories(SIMFLEX_MODEL_WORK);
    std::filesystem::current_path(SIMFLEX_MODEL_WORK);
    setenv("SIMFLEX_CACHE", SIMFLEX_MODEL_WORK "/cache", 1);
    int numModels = 0;
    for (const auto& entry : std::filesystem::directory_iterator(SIMFLEX_MODELS)) {
        if (entry.path().extension() != ".yaml") continue;
        SCOPED_TRACE(entry.path().filename().string());
        ++numModels;
        Session session(loadModelText(entry.path().string()));
        const auto viz = model::makeVisualizer(session.getModel());
        for (const double time : {0.0, 0.01, 0.03, 0.06}) {
            if (time > 0) session.runTo(time, time);
            for (const double factor : {10.0, 100.0, 1000.0}) {
                viz->setDeformationFactor(factor);
                viz->drawFrame(session.getState());
                const auto [joint, gap] = viz->getLargestGap();
                EXPECT_LT(gap, 1e-6) << "at '" << joint << "', " << time << " s, times " << factor;
            }
        }
    }
    EXPECT_GE(numModels, 10);
}

}  // namespace
}  // namespace simflex
