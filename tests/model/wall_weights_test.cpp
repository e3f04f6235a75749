// SPDX-License-Identifier: Apache-2.0
// Conditions mixed(a, b, c) that are none on the scene's grid: told for all values that are known before the run.
// Coefficients on walls.
#include "model_support.h"

namespace dpde::model {
namespace {

TEST(WallWeights, CoefficientsThatAreVectorsStandOnWallsOfVectors) {
  const auto printed = [](const std::string& unknown, const std::string& boundary) {
    const Problem problem = problem_of("model m { " + unknown +
                                       " u; coefficient vector q; dt(u) = lap(u) }\nscene s : m {\n grid x = 0 .. 1, "
                                       "cells 4\n grid y = 0 .. 1, cells 4, periodic\n"
                                       " q = (y, 1 + y)\n boundary " +
                                       boundary + "\n initial u = 0*" + (unknown == "vector" ? "(1, 1)" : "1") +
                                       "\n time 0 .. 1, step 1\n}\n");
    const std::string text = print(problem);
    return text.substr(text.find("boundary"), text.find("initial") - text.find("boundary"));
  };
  EXPECT_EQ(printed("vector", "u: x.low = q, x.high = 0"),
            "boundary u.x: x.low = q.x, x.high = 0\n  boundary u.y: x.low = q.y, x.high = 0\n  ");
  EXPECT_EQ(printed("vector", "u: x.low = (q.y, q.x), x.high = 0"),
            "boundary u.x: x.low = q.y, x.high = 0\n  boundary u.y: x.low = q.x, x.high = 0\n  ");
  EXPECT_EQ(printed("field", "u: x.low = q.y, x.high = 0"), "boundary u: x.low = q.y, x.high = 0\n  ");
}

}  // namespace
}  // namespace dpde::model
