#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "simflex/base/Json.h"

namespace simflex {
namespace {

TEST(Json, IsIndentedByLevelWithListsOfPlainValuesOnOneLine) {
    Json json = Json::object();
    json.add("name", "crank").add("modes", 7).add("isRigid", false);
    json.add("position", std::array<double, 3>{0, 0.5, -1e-30});
    json.add("interfaces", Json::list().add(Json::object().add("name", std::string("A"))));
    json.add("none", Json::list()).add("empty", Json::object());
    EXPECT_EQ(json.write(2), R"({
  "name": "crank",
  "modes": 7,
  "isRigid": false,
  "position": [0, 0.5, -1.0000000000000001e-30],
  "interfaces": [
    {
      "name": "A"
    }
  ],
  "none": [],
  "empty": {}
})");
}

TEST(Json, NumbersReadBackToTheSameBits) {
    for (const double value : {0.1, 1.0 / 3, 6.02214076e23, -1e-300})
        EXPECT_EQ(std::stod(Json(value).write(2)), value);
    EXPECT_EQ(Json(0.1, 9).write(2), "0.1");
    EXPECT_EQ(Json(std::vector<double>{NAN, INFINITY}).write(2), "[null, null]");
}

TEST(Json, WhatWouldEndATextIsEscaped) {
    EXPECT_EQ(Json("a \"b\" \\ µ").write(2), R"("a \"b\" \\ µ")");
    EXPECT_EQ(Json("\n\t\x1f").write(2), R"("\n\u0009\u001f")");
}

}  // namespace
}  // namespace simflex
