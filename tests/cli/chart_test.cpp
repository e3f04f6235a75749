// SPDX-License-Identifier: Apache-2.0
// Charts of speed against accuracy, and the choice of the cheapest that meets a tolerance. Errors are compared with
// closed forms; times are not tested but for being there.
#include <numbers>

#include "command_support.h"

namespace dpde::testing {
namespace {

/// Advection of a sine once around, and the decay of one by diffusion.
std::string wind(bool with_exact) {
  return std::string("model wind { field u; param c; dt(u) = -advect(c, u) }\n") +
         "scheme plain { advect = central(2); time = rk4 }\nscene ring : wind with plain {\n"
         "  grid x = 0 .. 2*pi, cells 32, periodic\n  c = 1\n  initial u = sin(x)\n" +
         (with_exact ? "  exact u = sin(x - c*t)\n" : "") + "  time 0 .. 1, step 1/32\n}\n";
}

class ChartCommand : public Command {
 protected:
  const std::string quick = " --samples 1 --sample-seconds 0 --json ";
};

/// The wave of wave number 1 goes at the speed sin(h)/h by central(2): the error after t = 1 is 1 - sin(h)/h of its
/// size, if steps are short. Relative root mean square: the same.
TEST_F(ChartCommand, ErrorsAreThoseOfClosedForms) {
  write("s.dpde", wind(true));
  const Outcome run = dpde("chart s.dpde --vary cells=16,32,64 --vary fraction=0.1 --vary advect=central2" + quick);
  ASSERT_EQ(run.status, 0) << run.err;
  const Json json = run.json();
  ASSERT_EQ(json["points"].size(), 3u);
  for (const Json& point : json["points"]) {
    const double h = 2 * std::numbers::pi / point["cells"][0].get<double>();
    EXPECT_NEAR(point["error"].get<double>(), 2 * std::sin(0.5 * (1 - std::sin(h) / h)), 1e-4) << point;
    EXPECT_GT(point["wall_s"].get<double>(), 0);
    EXPECT_TRUE(point["stable"].get<bool>());
    const double steps = 1 / point["step"].get<double>();
    EXPECT_NEAR(steps, std::round(steps), 1e-9);
  }
}

/// Without an exact solution a finer run by another scheme takes its place, and says how well it is known.
TEST_F(ChartCommand, AFinerRunTakesThePartOfAnExactSolution) {
  write("exact.dpde", wind(true));
  write("none.dpde", wind(false));
  const std::string rest = " --vary cells=16,32 --vary fraction=0.5 --vary advect=central2,upwind3" + quick;
  const Json exact = dpde("chart exact.dpde" + rest).json(), none = dpde("chart none.dpde" + rest).json();
  ASSERT_EQ(exact["points"].size(), 4u);
  ASSERT_EQ(none["points"].size(), 4u);
  for (std::size_t i = 0; i < 4; ++i) {
    const double error = exact["points"][i]["error"];
    EXPECT_NEAR(none["points"][i]["error"].get<double>(), error, 1e-3 * error + 1e-7);
  }
  EXPECT_EQ(exact["reference"]["uncertainty"], 0);
  EXPECT_LT(none["reference"]["uncertainty"].get<double>(), 1e-5);
  EXPECT_NE(none["reference"]["text"].get<std::string>().find("advect=central6"), std::string::npos);
}

TEST_F(ChartCommand, WhatIsUnstableIsNotRunAndWhatDoesNotFitIsLeftOut) {
  write("s.dpde", wind(true));
  const Outcome run = dpde("chart s.dpde --vary cells=32 --vary step=0.5,1/4" + quick);
  EXPECT_EQ(run.status, 2) << "1/4 is no number";
  const Json json =
      dpde("chart s.dpde --vary cells=64 --vary step=1,0.25 --vary advect=central2,weno77" + quick).json();
  ASSERT_EQ(json["points"].size(), 4u);
  EXPECT_FALSE(json["points"][0]["stable"].get<bool>());  // limit 2.83*0.098 = 0.278
  EXPECT_TRUE(json["points"][0]["error"].is_null());
  EXPECT_TRUE(json["points"][1]["stable"].get<bool>());
  EXPECT_TRUE(json["points"][1]["pareto"].get<bool>());
  EXPECT_FALSE(json["points"][2]["fits"].get<bool>());
  const Json euler = dpde("chart s.dpde --vary cells=32 --vary time=euler" + quick).json();
  EXPECT_EQ(euler["points"][0]["failure"], "unstable at every step");
}

TEST_F(ChartCommand, GoesOnFromWhatItsFolderHolds) {
  write("s.dpde", wind(true));
  const std::string command = "chart s.dpde --vary fraction=0.5 --vary advect=central2 --out o";
  const Json first = dpde(command + " --vary cells=16,32" + quick).json();
  for (const char* name : {"o/ring_chart.csv", "o/ring_chart.json", "o/ring_chart_points.json"})
    EXPECT_TRUE(fs::exists(path(name))) << name;
  const Json second = dpde(command + " --vary cells=16,32,64 --resume" + quick).json();
  ASSERT_EQ(second["points"].size(), 3u);
  for (int i = 0; i < 2; ++i) EXPECT_EQ(second["points"][i]["wall_s"], first["points"][i]["wall_s"]) << "timed once";
  // Other settings are other points: half the wind makes about half the error.
  const Json slow = dpde(command + " --vary cells=16,32 --set c=0.5 --resume" + quick).json();
  EXPECT_NEAR(slow["points"][1]["error"].get<double>() / first["points"][1]["error"].get<double>(), 0.5, 0.05);
  write("o/ring_chart_points.json", "{\"a\": {\"failure\": null}}");
  EXPECT_EQ(dpde(command + " --resume" + quick).codes(), std::vector<std::string>{"E0901"});
  write("o/ring_chart_points.json", "{");
  EXPECT_EQ(dpde(command + " --resume" + quick).codes(), std::vector<std::string>{"E0901"});
}

/// What is chosen has the error that is told, and that meets the tolerance.
TEST_F(ChartCommand, TuneProvesWhatItChooses) {
  write("s.dpde", wind(true));
  for (const double tolerance : {1e-2, 1e-4, 1e-6}) {
    const Outcome run = dpde(fmt::format("tune s.dpde --tolerance {}", tolerance) + quick);
    ASSERT_EQ(run.status, 0) << run.err;
    const Json json = run.json();
    EXPECT_LE(json["error"].get<double>(), tolerance);
    EXPECT_GT(json["tried"].get<int>(), 4);
    EXPECT_FALSE(json["runner_up"].empty());
    // The choice, run by itself, has that error.
    std::string set =
        " --set step=" + json["chosen"]["step"].dump() + " --set cells=" + json["chosen"]["cells"][0].dump();
    for (const char* key : {"advect", "time", "real"}) {
      if (json["chosen"].contains(key)) set += fmt::format(" --set {}={}", key, json["chosen"][key].get<std::string>());
    }
    const Outcome proof = dpde("run s.dpde --json" + set);
    ASSERT_EQ(proof.status, 0) << proof.err;
    EXPECT_NEAR(proof.json()["error"]["u"]["l2"].get<double>() * std::sqrt(2.0), json["error"].get<double>(),
                1e-6 * tolerance + 1e-9);
  }
  const Outcome none = dpde("tune s.dpde --tolerance 1e-14 --most-cells 1" + quick);
  EXPECT_EQ(none.status, 1);
  EXPECT_EQ(none.codes(), std::vector<std::string>{"E0810"});
  EXPECT_EQ(dpde("tune s.dpde --tolerance 0" + quick).status, 2);
  write("none.dpde", wind(false));
  EXPECT_EQ(dpde("tune none.dpde --tolerance 1e-13 --most-cells 1" + quick).codes(), std::vector<std::string>{"E0916"});
}

TEST_F(ChartCommand, StabilityMeasuresWhatItPredicts) {
  write("s.dpde", wind(true));
  const Json json = dpde("stability s.dpde --json --out o").json();
  EXPECT_NEAR(json["predicted"]["max_courant"].get<double>(), 2.8284, 0.01);
  EXPECT_NEAR(json["ratio"].get<double>(), 1, 0.02);
  EXPECT_TRUE(fs::exists(path("o/stability.csv")));
  for (const Json& point : json["points"]) {
    const double part = point["step"].get<double>() / json["predicted"]["max_step"].get<double>();
    if (std::abs(part - 1) > 5e-4) EXPECT_EQ(point["stable"], part < 1) << point;
    const double predicted = std::log(std::max(1.0, point["predicted_growth"].get<double>()));
    EXPECT_NEAR(std::log(point["growth"].get<double>()), predicted, 0.05 * predicted + 1e-3) << point;
  }
  const Json against = dpde("stability s.dpde --against c=0.5..2 --points 3 --json").json();
  ASSERT_EQ(against["against"]["rows"].size(), 3u);
  for (const Json& row : against["against"]["rows"]) {
    EXPECT_NEAR(row["predicted"].get<double>() * row["c"].get<double>(), 2.8284 * 2 * std::numbers::pi / 32, 2e-3);
    EXPECT_NEAR(row["ratio"].get<double>(), 1, 0.02);
  }
  EXPECT_EQ(dpde("stability s.dpde --against c=2..1 --json").codes(), std::vector<std::string>{"E0904"});
  const Json weak = dpde("stability s.dpde --set time=rk2 --json").json();
  EXPECT_TRUE(weak["predicted"]["weak"].get<bool>());
}

}  // namespace
}  // namespace dpde::testing
