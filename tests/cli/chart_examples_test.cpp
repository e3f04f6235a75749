// SPDX-License-Identifier: Apache-2.0
// The charts of the examples on small grids: the orders in their pictures, and which method is best where. Times are
// not tested.
#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "command_support.h"
#include "support/setting.h"

namespace dpde::testing {
namespace {

class ChartExamples : public Command {
 protected:
  /// The chart of dsl-examples/FILE.dpde.
  Json chart(const std::string& file, const std::string& name, const std::string& vary) const {
    const Outcome run = dpde("chart " DPDE_SOURCE_DIR "/dsl-examples/" + file + ".dpde " + name + " " + vary +
                             " --samples 1 --sample-seconds 0 --json");
    EXPECT_EQ(run.status, 0) << run.err;
    return run.json();
  }
  /// The error on `cells` cells along the first axis for the method with `key` = `value`, at its first step.
  static double error(const Json& chart, int cells, const std::string& key, const std::string& value) {
    for (const Json& point : chart["points"]) {
      if (point["cells"][0] == cells && point["variant"][key] == value && point["error"].is_number())
        return point["error"];
    }
    ADD_FAILURE() << "no point on " << cells << " cells with " << key << " = " << value;
    return 0;
  }
  static double order(const Json& chart, int cells, const std::string& key, const std::string& value) {
    return std::log2(error(chart, cells, key, value) / error(chart, 2 * cells, key, value));
  }
};

TEST_F(ChartExamples, FrontOfBurgersByColeAndHopf) {
  const Json json =
      chart("burgers_1d/burgers", "accuracy_of_front", "--vary cells=64,128 --vary time=rk4 --vary fraction=0.45");
  EXPECT_EQ(json["reference"]["uncertainty"], 0) << "a closed form";
  EXPECT_NEAR(order(json, 64, "advect", "central(2)"), 2, 0.15);
  EXPECT_NEAR(order(json, 64, "advect", "central(4)"), 4, 0.15);
  EXPECT_NEAR(order(json, 64, "advect", "upwind(3)"), 3, 0.15);
}

/// A smooth profile: orders of the differences; time steps are short, or of order 4 as well.
TEST_F(ChartExamples, RingByUpwindAndCentralDifferences) {
  const Json json =
      chart("advection/advection", "accuracy_of_ring", "--vary cells=64,128 --vary time=rk4 --vary fraction=0.45");
  EXPECT_EQ(json["reference"]["uncertainty"], 0) << "a closed form";
  EXPECT_NEAR(order(json, 64, "advect", "upwind(1)"), 1, 0.15);
  EXPECT_NEAR(order(json, 64, "advect", "central(2)"), 2, 0.15);
  EXPECT_NEAR(order(json, 64, "advect", "upwind(3)"), 3, 0.15);
  EXPECT_NEAR(order(json, 64, "advect", "central(4)"), 4, 0.15);
}

/// Before chaos grows: errors of differences fall with the fourth power, those of Fourier series with etdrk4 faster,
/// whose step is not limited by the fourth derivative.
TEST_F(ChartExamples, StartOfKuramotoAndSivashinsky) {
  const Json json = chart("kuramoto_sivashinsky/kuramoto_sivashinsky", "accuracy_of_start",
                          "--vary cells=128,256 --vary fraction=0.3");
  EXPECT_LT(json["reference"]["uncertainty"].get<double>(), 1e-4);
  EXPECT_NEAR(order(json, 128, "scheme", "plain"), 4, 0.15);
  EXPECT_GT(order(json, 128, "scheme", "waves"), 6);
  for (const Json& point : json["points"]) {
    if (point["cells"][0] == 128) EXPECT_EQ(point["step"].get<double>() > 0.05, point["variant"]["scheme"] == "waves");
  }
}

/// At a jump a linear scheme of order p has a mean error of order p/(p + 1) (A. Harten and others: Uniformly high order
/// schemes, J. Comput. Phys. 71 (1987); S. Serdjukova for odd orders). Limiters have half the error of central
/// differences, which ring.
TEST_F(ChartExamples, SquareByLimitersAndLinearSchemes) {
  const Json json = chart("advection/advection", "accuracy_of_square", "--vary cells=128,256");
  EXPECT_EQ(json["reference"]["uncertainty"], 0) << "a closed form";
  EXPECT_NEAR(order(json, 128, "advect", "upwind(1)"), 1.0 / 2, 0.1);
  EXPECT_NEAR(order(json, 128, "advect", "upwind(3)"), 3.0 / 4, 0.1);
  EXPECT_NEAR(order(json, 128, "advect", "upwind(5)"), 5.0 / 6, 0.1);
  for (const std::string limiter : {"muscl(minmod)", "muscl(van_leer)", "muscl(mc)"})
    EXPECT_LT(error(json, 256, "advect", limiter), 0.5 * error(json, 256, "advect", "central(2)")) << limiter;
  EXPECT_LT(error(json, 256, "advect", "upwind(5)"), error(json, 256, "advect", "muscl(mc)")) << "what limiters cost";
}

TEST_F(ChartExamples, Plate) {
  if (!is_thorough()) GTEST_SKIP() << "at night";
  if (testing::is_thorough()) {
    const Json json = chart("heat/heat", "accuracy_of_plate", "--vary cells=16,32 --vary fraction=0.3");
    EXPECT_EQ(json["points"][0]["errors"].size(), 2u) << "l2 and linf";
    EXPECT_NEAR(order(json, 16, "time", "euler"), 2, 0.15);
  }
  const Json fine = chart("heat/heat", "accuracy_of_plate", "--vary cells=16,32 --vary fraction=0.3 --vary time=rk4");
  EXPECT_NEAR(order(fine, 16, "lap", "central(4)"), 4, 0.15);
}

TEST_F(ChartExamples, Drum) {
  const Json json = chart("wave/wave", "accuracy_of_drum", "--vary cells=32,64 --vary fraction=0.3");
  EXPECT_NEAR(order(json, 32, "lap", "central(2)"), 2, 0.15);
  const Json fine = chart("wave/wave", "accuracy_of_drum", "--vary cells=32,64 --vary fraction=0.3 --vary time=rk4");
  EXPECT_NEAR(order(fine, 32, "lap", "central(4)"), 4, 0.15);
}

TEST_F(ChartExamples, SpotOfGrayAndScott) {
  const Json json =
      chart("gray_scott/gray_scott", "accuracy_of_spot", "--vary cells=32,64 --vary fraction=0.9 --vary time=rk4");
  EXPECT_LT(json["reference"]["uncertainty"].get<double>(), 2e-3);
  EXPECT_NEAR(order(json, 32, "lap", "central(4)"), 4, 0.25) << "the spot is five cells wide";
  EXPECT_LT(error(json, 64, "lap", "central(4)"), 0.25 * error(json, 64, "lap", "central(2)"));
}

/// Fourier series and differences for the same flow; both solve for the stream function.
TEST_F(ChartExamples, MergingVortices) {
  if (!is_thorough()) GTEST_SKIP() << "at night";
  const Json json = chart("vorticity/vorticity", "accuracy_of_merger",
                          "--vary cells=32,64 --vary step=0.08 --set step=0.05 --reference-cells 96");
  EXPECT_LT(json["reference"]["uncertainty"].get<double>(), 1e-3);
  EXPECT_NEAR(order(json, 32, "scheme", "second"), 2, 0.15);
  EXPECT_GT(order(json, 32, "scheme", "sixth"), 4.5);
  EXPECT_GT(order(json, 32, "scheme", "waves"), 7);
}

/// Convection: a spectral run and differences, and the growth of Rayleigh's first wave, for Pr = 1 sqrt(Ra/3) -
/// 3*pi^2/2.
TEST_F(ChartExamples, RollsAlongWhichTheFluidSlips) {
  if (!testing::is_thorough()) GTEST_SKIP() << "at night: a reference of 96 x 96 cells";
  const Json json = chart("convection/free_rolls", "accuracy_of_rolls",
                          "--vary cells=24,48 --vary step=0.0005 --set end=0.05 --reference-cells 96");
  EXPECT_LT(json["reference"]["uncertainty"].get<double>(), 1e-3);
  EXPECT_NEAR(order(json, 24, "scheme", "second"), 2, 0.2);
  EXPECT_GT(order(json, 24, "scheme", "sixth"), 4.5);
  EXPECT_GT(order(json, 24, "scheme", "waves"), 7);
}

TEST_F(ChartExamples, FirstRollsGrowAsRayleighSays) {
  for (const double rayleigh : {600.0, 657.511364, 1000.0}) {
    const auto rising = [&](double end) {
      const Outcome run =
          dpde(fmt::format("run " DPDE_SOURCE_DIR "/dsl-examples/convection/free_rolls.dpde first_growth --json "
                           "--set Ra={} --set end={}",
                           rayleigh, end));
      return run.json()["observables"]["rising"].get<double>();
    };
    const double rate = std::log(rising(0.75) / rising(0.5)) / 2 / 0.25, pi = std::numbers::pi;
    EXPECT_NEAR(rate, std::sqrt(rayleigh / 3) - 1.5 * pi * pi, 1e-4) << rayleigh;
  }
}

TEST_F(ChartExamples, Canal) {
  if (!is_thorough()) GTEST_SKIP() << "at night";
  const Json json = chart("shallow_water/shallow_water", "accuracy_of_canal", "--vary time=rk4 --vary fraction=0.45");
  EXPECT_LT(json["reference"]["uncertainty"].get<double>(), 1e-6);
  EXPECT_NEAR(order(json, 200, "dx", "central(2)"), 2, 0.15);
  EXPECT_LT(error(json, 400, "dx", "central(4)"), 0.1 * error(json, 400, "dx", "central(2)"));
}

}  // namespace
}  // namespace dpde::testing
