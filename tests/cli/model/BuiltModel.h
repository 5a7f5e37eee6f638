#pragma once
/** @file
Models built from text, in a folder with a few parts of point masses. **/

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "fe/TestDecks.h"
#include "simflex/model/Model.h"
#include "simflex/model/file/ModelReader.h"

namespace simflex::test {

/** Parts: bar.h5 and stiffened.h5, of point masses, with interfaces A and B and a node set END. **/
class BuiltModelTest : public ::testing::Test {
protected:
    static std::shared_ptr<const ReducedBody> makeBar();
    static std::shared_ptr<const ReducedBody> makeStiffenedBar();

    void SetUp() override;

    /** `simflex: 1`, the parts bar and stiffened, and `text`. **/
    std::unique_ptr<Model> build(const std::string& text);
    /** The message of the error that building it gives; "" if there is none. **/
    std::string messageOf(const std::string& text);

    testing::TestFolder folder;
    ModelOptions options;
    std::vector<std::string> notes, warnings;
};

/** Largest difference of u̇ at the same random speeds, relative to the largest u̇. **/
double compareAccelerations(const SimTK::MultibodySystem& a, SimTK::State stateA,
                            const SimTK::MultibodySystem& b, SimTK::State stateB);

}  // namespace simflex::test
