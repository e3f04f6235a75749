// SPDX-License-Identifier: Apache-2.0
// Conditions mixed(a, b, c) that are none on the scene's grid: told for all values that are known before the run.
// Coefficients on walls.
#include "model_support.h"

namespace dpde::model {
namespace {

/// The spacing is 1/4: mixed(a, -1, ...) wants a < 8.
std::string told(const std::string& sides, const std::string& values = "a = 7", const std::string& task = "",
                 const std::string& time = "0 .. 1, step 1/64") {
  const Outcome outcome = outcome_of(
      "model m { field u; param a; dt(u) = a*lap(u) }\nscene s : m {\n grid x = 0 .. 1, cells 4\n boundary u: " +
      sides + "\n " + values + "\n initial u = 0\n time " + time + "\n}\n" + task);
  return outcome.diagnostics.empty()
             ? ""
             : std::string(outcome.diagnostics[0].kind->code) + " " +
                   outcome.diagnostics[0].message.substr(0, outcome.diagnostics[0].message.find(" has no image"));
}

TEST(WallWeights, OfTheScene) {
  EXPECT_EQ(told("x = mixed(a, -1, 0)"), "");
  EXPECT_EQ(told("x = mixed(a, -1, 0)", "a = 8"), "E0433 mixed(8, -1, ...) of u");
  EXPECT_EQ(told("x = mixed(a, 1, 0)", "a = 8"), "");
  EXPECT_EQ(told("x.low = 0, x.high = mixed(sqrt(a), -1/4, 0)", "a = 4"), "E0433 mixed(2, -0.25, ...) of u");
}

TEST(WallWeights, OverTime) {
  EXPECT_EQ(told("x = mixed(1 + 6*t, -1, 0)"), "");
  EXPECT_EQ(told("x = mixed(1 + 8*t, -1, 0)"), "E0433 mixed(8, -1, ...) of u at t = 0.875");
  EXPECT_EQ(told("x = mixed(a*sin(pi*t), -1, 0)", "a = 8"), "E0433 mixed(8, -1, ...) of u at t = 0.5");
  EXPECT_EQ(told("x = mixed(if(t > 0.4 and t < 0.41, 9, 1), -1, 0)"), "E0433 mixed(9, -1, ...) of u at t = 0.40625")
      << "in one step";
  EXPECT_EQ(told("x = mixed(if(t > 0.407 and t < 0.42, 9, 1), -1, 0)"), "E0433 mixed(9, -1, ...) of u at t = 0.414062")
      << "in the middle of one";
  EXPECT_EQ(told("x = mixed(if(t > 1, 9, 1), -1, 0)"), "") << "behind the end";
}

TEST(WallWeights, WhereATaskBegins) {
  EXPECT_EQ(told("x = mixed(a, -1, 0)", "a = 7", "task t : s { unknown a from 9; minimise mean(u^2) }"),
            "E0433 mixed(9, -1, ...) of u where task t begins");
  EXPECT_EQ(told("x = mixed(a, -1, 0)", "", "task t : s { unknown a from 9; minimise mean(u^2) }"),
            "E0433 mixed(9, -1, ...) of u where task t begins");
  EXPECT_EQ(told("x = mixed(a*t, -1, 0)", "a = 2", "task t : s { unknown a from 16; minimise mean(u^2) }"),
            "E0433 mixed(8, -1, ...) of u at t = 0.5 where task t begins");
  EXPECT_EQ(told("x = mixed(a, -1, 0)", "a = 7", "task t : s { unknown a from 3; minimise mean(u^2) }"), "");
}

/// Where both weights are 0 nothing is said about u: at one time of the run is enough.
TEST(WallWeights, ThatVanish) {
  const std::string nothing = "E0424 mixed(0, 0, ...) says nothing about u";
  EXPECT_EQ(told("x.low = mixed(sin(t), 0, 1), x.high = 0"), nothing + " at x.low at t = 0");
  EXPECT_EQ(told("x.low = 0, x.high = mixed(a*(t - 0.5), 0, 1)"), nothing + " at x.high at t = 0.5");
  EXPECT_EQ(told("x = mixed(t, a*t, 1)", "a = 2"), nothing + " at x at t = 0");
  EXPECT_EQ(told("x = mixed(t, 1 - t, 1)"), "");
  EXPECT_EQ(told("x = mixed(1 + t, 0, 1)"), "");
  const std::string from = "task t : s { unknown a from ";
  EXPECT_EQ(told("x.low = mixed(a, 0, 1), x.high = 0", "a = 1", from + "0; minimise mean(u^2) }"),
            nothing + " at x.low where task t begins");
  EXPECT_EQ(told("x = mixed(t - a, 0, 1)", "a = 2", from + "1/4; minimise mean(u^2) }"),
            nothing + " at x at t = 0.25 where task t begins");
  EXPECT_EQ(told("x = mixed(a, 0, 1)", "a = 1", from + "1/4; minimise mean(u^2) }"), "");
}

TEST(WallWeights, CoefficientsThatAreVectorsStandOnWallsOfVectors) {
  const auto printed = [](const std::string& unknown, const std::string& boundary) {
    const Outcome outcome = outcome_of("model m { " + unknown +
                                       " u; coefficient vector q; dt(u) = lap(u) }\nscene s : m {\n grid x = 0 .. 1, "
                                       "cells 4\n grid y = 0 .. 1, cells 4, periodic\n"
                                       " q = (y, 1 + y)\n boundary " +
                                       boundary + "\n initial u = 0*" + (unknown == "vector" ? "(1, 1)" : "1") +
                                       "\n time 0 .. 1, step 1\n}\n");
    if (!outcome.diagnostics.empty())
      return std::string(outcome.diagnostics[0].kind->code) + " " + outcome.diagnostics[0].message;
    const std::string text = print(*outcome.problem);
    return text.substr(text.find("boundary"), text.find("initial") - text.find("boundary"));
  };
  EXPECT_EQ(printed("vector", "u: x.low = q, x.high = 0"),
            "boundary u.x: x.low = q.x, x.high = 0\n  boundary u.y: x.low = q.y, x.high = 0\n  ");
  EXPECT_EQ(printed("vector", "u: x.low = (q.y, q.x), x.high = 0"),
            "boundary u.x: x.low = q.y, x.high = 0\n  boundary u.y: x.low = q.x, x.high = 0\n  ");
  EXPECT_EQ(printed("field", "u: x.low = q.y, x.high = 0"), "boundary u: x.low = q.y, x.high = 0\n  ");
  EXPECT_EQ(printed("field", "u: x.low = q, x.high = 0"),
            "E0307 expected a number but this is a vector of 2 components");
}

}  // namespace
}  // namespace dpde::model
