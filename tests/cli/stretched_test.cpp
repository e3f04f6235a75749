// SPDX-License-Identifier: Apache-2.0
// Stretched axes for users: positions in files and plots, files of other grids, averages over cells, certificates.
#include <cmath>
#include <numbers>

#include "command_support.h"
#include "dpde/runtime/npy.h"
#include "support/netcdf_file.h"

namespace dpde::testing {
namespace {

std::string channel(const std::string& stretched, int cells, const std::string& more = "",
                    const std::string& scene = "channel") {
  return "scene " + scene +
         " : flow with s {\n"
         "  grid x = 0 .. 2*pi, cells " +
         std::to_string(cells) +
         ", periodic, stretched x + 0.3*sin(x)\n"
         "  grid y = -1 .. 1, cells " +
         std::to_string(cells) + ", stretched " + stretched +
         "\n"
         "  beta = 2\n  k = 0.05\n  w = 1 + 0.2*sin(x)*y\n"
         "  boundary u: y.low = 0.1*k, y.high = mixed(1, 0.2, k)\n"
         "  initial u = cos(x)*(1 - y^2)\n"
         "  time 0 .. 0.05, step 0.0005\n}\n" +
         more;
}
const std::string model =
    "model flow {\n  field u\n  param beta, k\n  coefficient w\n  dt(u) = div(w*k*grad(u)) - advect((u, 0.1), u)\n}\n"
    "scheme s { advect = upwind(1); dx = central(2); time = rk2 }\n";
const std::string tanh_map = "tanh(beta*y)/tanh(beta)";

double place(double y) { return std::tanh(2 * y) / std::tanh(2.0); }

class Stretched : public Command {};

TEST_F(Stretched, FilesAndPicturesShowTheTruePlaces) {
  write("c.dpde", model + channel(tanh_map, 8));
  const Outcome ran = dpde("run c.dpde --quiet --out o");
  ASSERT_EQ(ran.status, 0) << ran.err;
  {
    const NetcdfFile file(path("o/channel.nc").string());
    const std::vector<double> y = file.values("y"), bounds = file.values("y_bounds"), x = file.values("x"),
                              u = file.values("u");
    for (std::size_t i = 0; i < 8; ++i) {
      const double centre = place(-1 + (static_cast<double>(i) + 0.5) / 4),
                   s = (static_cast<double>(i) + 0.5) * std::numbers::pi / 4;
      EXPECT_NEAR(y[i], centre, 1e-15);
      EXPECT_NEAR(x[i], s + 0.3 * std::sin(s), 1e-14);
      EXPECT_NEAR(bounds[2 * i], place(-1 + static_cast<double>(i) / 4), 1e-15);
      EXPECT_NEAR(bounds[2 * i + 1], place(-1 + static_cast<double>(i + 1) / 4), 1e-15);
      EXPECT_NEAR(u[8 * i], std::cos(x[0]) * (1 - centre * centre), 1e-14);
    }
  }
  EXPECT_EQ(dpde("plot o/channel.nc --out p").status, 0);
  const Outcome formatted = dpde("fmt c.dpde");
  EXPECT_NE(content(path("c.dpde")).find("stretched tanh(beta*y)/tanh(beta)"), std::string::npos) << formatted.err;
}

TEST_F(Stretched, FilesOfOtherGridsAreRefused) {
  write("c.dpde", model + channel(tanh_map, 8));
  ASSERT_EQ(dpde("run c.dpde --quiet --out o").status, 0);
  std::string text = model + channel(tanh_map, 8);
  text.replace(text.find("cos(x)*(1 - y^2)"), 16, "load(\"o/channel.nc\", u) at t = 0");
  write("again.dpde", text);
  ASSERT_EQ(dpde("run again.dpde --quiet --out p").status, 0);
  EXPECT_EQ(read_npy(path("p/u.npy")).values, read_npy(path("o/u.npy")).values);
  const Outcome uniform = dpde("run again.dpde --quiet --out p --json --set beta=1.9");
  EXPECT_NE(uniform.status, 0);
  EXPECT_NE(uniform.out.find("another grid"), std::string::npos) << uniform.out;
}

TEST_F(Stretched, CheckpointsOfOtherMapsAreRefused) {
  write("c.dpde", model + channel(tanh_map, 8));
  ASSERT_EQ(dpde("run c.dpde --quiet --out o --checkpoint-every 10").status, 0);
  write("c.dpde", model + channel("tanh(1.9*y)/tanh(1.9)*(1 + 0*beta)", 8));
  const Outcome other = dpde("run c.dpde --quiet --out o --resume --set end=0.1 --json");
  EXPECT_NE(other.status, 0) << other.out;
  EXPECT_NE(other.out.find("stretched"), std::string::npos) << other.out;
  write("c.dpde", model + channel(tanh_map, 8));
  EXPECT_EQ(dpde("run c.dpde --quiet --out o --resume --set end=0.1 --json").status, 0);
}

/// Averages over the finer cells are weighted by volume: for y^2 the coarse values are exact to the fine midpoint rule.
TEST_F(Stretched, DataOfAFinerSceneAreMeansByVolume) {
  const std::string task =
      "task t : channel {\n  data d = u from scene fine at t = 0\n  unknown initial u from 0\n  minimise mean((u - "
      "d)^2) at t = 0\n}\n";
  const auto text = [&](const std::string& map, const std::string& initial) {
    std::string fine = channel(map, 24, "", "fine");
    fine.replace(fine.find("cos(x)*(1 - y^2)"), 16, initial);
    return model + channel(tanh_map, 8) + fine + task;
  };
  write("one.dpde", text(tanh_map, "3"));
  const Outcome one = dpde("gradient one.dpde t --json");
  ASSERT_EQ(one.status, 0) << one.err;
  EXPECT_NEAR(one.json()["loss"].get<double>(), 9, 1e-14);
  write("other.dpde", text("tanh((beta - 0.5)*y)/tanh(beta - 0.5)", "3"));
  EXPECT_EQ(dpde("gradient other.dpde t --json").codes(), std::vector<std::string>{"E0909"});
}

TEST_F(Stretched, DerivativesAreCertified) {
  for (const char* unknowns : {"unknown initial u", "unknown w\n  unknown k from 0.06"}) {
    write("t.dpde", model + channel(tanh_map, 6,
                                    std::string("task t : channel {\n  ") + unknowns +
                                        "\n  minimise integral((u - 0.5)^2) + 1e-2*mean(dy(u)^2)\n}\n"));
    const Outcome outcome = dpde("verify t.dpde t --json");
    ASSERT_EQ(outcome.status, 0) << outcome.out << outcome.err;
    EXPECT_TRUE(outcome.json()["passed"].get<bool>()) << outcome.out;
    EXPECT_LT(outcome.json()["dot_product"]["max_relative_error"].get<double>(), 1e-12) << outcome.out;
  }
}

/// Only the adjoint of the loss reads the metric across the periodic axis, not the loss itself: it must not change the
/// metric's ghost cells, which the adjoint of the step reads.
TEST_F(Stretched, LossesLeaveTheMetricBeyondWallsAsItIs) {
  write("m.dpde",
        "model m { field p; coefficient g; dt(p) = 0.02*lap(p) + g }\n"
        "scene s : m {\n"
        "  grid x = 0 .. 1, cells 5, periodic\n"
        "  grid y = 0 .. 1, cells 4, stretched (exp(y) - 1)/(exp(1) - 1)\n"
        "  g = x\n  initial p = cos(2*pi*x)*y\n  boundary p: y = 0\n  time 0 .. 0.2, step 0.02\n}\n"
        "task state : s { unknown initial p; minimise mean(dx(p)^2); using lbfgs() }\n"
        "task source : s { unknown g; minimise mean((p - 1)^2) + mean(dx(g)^2); using lbfgs() }\n");
  for (const std::string task : {"state", "source"}) {
    for (const std::string backend : {"jit", "cpp"}) {
      const Outcome proven = dpde("verify m.dpde " + task + " --json --backend " + backend);
      EXPECT_EQ(proven.status, 0) << task << " " << backend << "\n" << proven.out << proven.err;
    }
    const Json compiled = dpde("gradient m.dpde " + task + " --json").json(),
               interpreted = dpde("gradient m.dpde " + task + " --json --backend interpreter").json();
    const std::string unknown = task == "state" ? "p" : "g";
    const double norm = compiled["gradient"][unknown]["norm"];
    EXPECT_GT(norm, 0);
    EXPECT_NEAR(norm, interpreted["gradient"][unknown]["norm"], 1e-12 * norm) << task;
  }
}

}  // namespace
}  // namespace dpde::testing
