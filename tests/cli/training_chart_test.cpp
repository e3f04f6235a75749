// SPDX-License-Identifier: Apache-2.0
// A trained network on a chart: beside plain methods that nobody named, with what data and training cost.
#include <algorithm>
#include <cmath>

#include "command_support.h"

namespace dpde::testing {
namespace {

const std::string scenes = R"(
model burgers { field u; param nu; param a; dt(u) = -u*dx(u) + nu*lap(u) }
scheme plain { time = rk2 }
scene fine : burgers with plain {
  grid x = 0 .. 2*pi, cells 64, periodic
  nu = 0.3; a = 1
  initial u = a*sin(x) + 0.3*cos(2*x)
  time 0 .. 2, step 1/64
}
scene coarse : burgers with plain {
  grid x = 0 .. 2*pi, cells 16, periodic
  nu = 0.3; a = 1
  initial u = a*sin(x) + 0.3*cos(2*x)
  time 0 .. 2, step 1/16
}
scene middle : burgers with plain {
  grid x = 0 .. 2*pi, cells 32, periodic
  nu = 0.3; a = 1
  initial u = a*sin(x) + 0.3*cos(2*x)
  time 0 .. 2, step 1/32
}
dataset train : fine { runs 4; seed 1; vary a in 0.5 .. 1.5; frames every 1/16; coarsen 4; file "train.nc" }
dataset unseen : fine { runs 3; seed 7; vary a in 0.5 .. 1.5; frames every 1/16; coarsen 4; file "unseen.nc" }
dataset unseen_32 : fine { runs 3; seed 7; vary a in 0.5 .. 1.5; frames every 1/16; coarsen 2; file "unseen_32.nc" }
network corrector(u) { initial he, seed 5; conv 4, 5; tanh; conv out, 5, gain = 0.01 }
scene hybrid : burgers with plain {
  grid x = 0 .. 2*pi, cells 16, periodic
  nu = 0.3; a = 1
  initial u = a*sin(x) + 0.3*cos(2*x)
  time 0 .. 2, step 1/16
  after step: u += corrector(u)
}
)";

std::string learn(const std::string& beside, const std::string& epochs = "4") {
  return scenes + "task learn : hybrid { data r = trajectories(\"train.nc\", u); learn corrector; minimise " +
         "mean((u - r)^2) over 4 steps\n  using adam(rate = 3e-3), batch 8, seed 3, epochs " + epochs +
         "\n  test err = mean(abs(u - r)) on trajectories(\"unseen.nc\") for 32 steps" + beside + " }\n";
}
const std::string both = " beside coarse, middle on trajectories(\"unseen_32.nc\")";

class TrainingChart : public Command {
 protected:
  void SetUp() override {
    Command::SetUp();
    write("f.dpde", learn(both));
    for (const char* set : {"train", "unseen", "unseen_32"})
      ASSERT_EQ(dpde(std::string("run f.dpde ") + set + " --out . --json").status, 0);
  }
  static Json point(const Json& chart, const std::string& scene) {
    for (const Json& each : chart["points"]) {
      if (each["scene"] == scene) return each;
    }
    ADD_FAILURE() << "no " << scene << " in " << chart["points"];
    return {};
  }
};

TEST_F(TrainingChart, HasPlainMethodsThatNobodyNamed) {
  const Outcome outcome = dpde("chart f.dpde learn --out o --json");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const Json chart = outcome.json();
  EXPECT_EQ(chart["points"].size(), 1U + 2 * (1 + 4)) << "differences of order 2 and 4, ssp_rk3 and rk4";
  EXPECT_EQ(point(chart, "hybrid")["network"], true);
  // By another way: a task of the plain scene that learns nothing, with the method in its scheme.
  write("p.dpde", scenes +
                      "task nothing : coarse {\n  data r = trajectories(\"unseen.nc\", u)\n  unknown nu from 0.3\n"
                      "  minimise mean((u - r)^2) over 1 steps\n  using adam(rate = 1e-300), epochs 1\n"
                      "  test err = mean(abs(u - r)) on trajectories(\"unseen.nc\") for 32 steps\n}\n");
  const Json nothing =
      dpde("optimize p.dpde nothing --json --set dx=central4 --set lap=central4 --set time=rk4").json();
  const Json better = point(chart, "coarse by dx=central4 lap=central4 time=rk4");
  EXPECT_EQ(better["error"], nothing["test"]["err"]["start"]["mean"]);
  EXPECT_LT(better["error"].get<double>(), 0.5 * point(chart, "coarse")["error"].get<double>());
  EXPECT_EQ(better["method"], point(chart, "middle by dx=central4 lap=central4 time=rk4")["method"]) << "one curve";
  double least = INFINITY;
  for (const Json& each : chart["points"]) {
    if (!each["network"].get<bool>()) least = std::min(least, each["error"].get<double>());
  }
  EXPECT_EQ(chart["best_plain"]["err"]["most_accurate"]["error"].get<double>(), least);
  const std::string table = content(path("o/err_chart.csv"));
  EXPECT_EQ(std::ranges::count(table, '\n'), 12);
}

/// Data and training over what a run saves; and never where a plain method has the error in less time.
TEST_F(TrainingChart, CountsDataAndTraining) {
  const Json chart = dpde("chart f.dpde learn --out o --json").json(), even = chart["test"]["err"]["break_even"];
  EXPECT_GT(even["data_s"].get<double>(), 0);
  EXPECT_GT(even["training_s"].get<double>(), 0);
  const Json at_error = chart["best_plain"]["err"]["at_equal_error"];
  ASSERT_FALSE(at_error.is_null());
  const double saved = at_error["wall_s"].get<double>() - point(chart, "hybrid")["wall_s"].get<double>();
  EXPECT_EQ(even["never"], saved <= 0);
  EXPECT_EQ(chart["best_plain"]["err"]["break_even"]["at_most"], false);
  EXPECT_EQ(chart["best_plain"]["err"]["break_even"]["runs"], even["runs"]);
  if (saved > 0) {
    const double spent = even["data_s"].get<double>() + even["training_s"].get<double>();
    EXPECT_EQ(even["runs"].get<double>(), std::ceil(spent / (2 * saved)));
  }
}

TEST_F(TrainingChart, TakesTheTrainingThatIsThere) {
  const Json trained = dpde("optimize f.dpde learn --out o --json").json(),
             chart = dpde("chart f.dpde learn --out o --json").json();
  EXPECT_EQ(chart["resumed_iterations"], trained["iterations"]);
  EXPECT_EQ(point(chart, "hybrid")["error"], trained["test"]["err"]["mean"]);
}

TEST_F(TrainingChart, WhatCannotBe) {
  write("alone.dpde", learn(""));
  const Outcome alone = dpde("chart alone.dpde learn --json");
  EXPECT_EQ(alone.codes(), std::vector<std::string>{"E0916"}) << alone.err;
  const Outcome varied = dpde("chart f.dpde learn --vary dx=central2,central4");
  EXPECT_EQ(varied.status, 2);
  EXPECT_NE(varied.err.find("task learn learns: its chart is of its tests"), std::string::npos) << varied.err;
}

}  // namespace
}  // namespace dpde::testing
