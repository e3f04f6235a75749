// SPDX-License-Identifier: Apache-2.0
// Staggered fields for users: positions in files, files and finer scenes as data, walls that are no unknowns.
#include <cmath>
#include <numbers>

#include "command_support.h"
#include "dpde/runtime/npy.h"
#include "support/netcdf_file.h"

namespace dpde::testing {
namespace {

std::string canal(int cells, const std::string& more = "") {
  return "model water { vector u on faces; field eta; dt(eta) = -div(u); dt(u) = -grad(eta) }\n"
         "scheme s { dx = central(2); time = rk4 }\n"
         "scene canal : water with s {\n"
         "  grid x = 0 .. 1, cells " +
         std::to_string(cells) +
         "\n"
         "  boundary u = 0.25\n"
         "  boundary eta = zero_gradient\n"
         "  initial u = 0.25 + x*(1 - x)\n"
         "  initial eta = cos(pi*x)\n"
         "  time 0 .. 0.5, step 1/32\n"
         "}\n" +
         more;
}

class Staggered : public Command {};

TEST_F(Staggered, FilesSayWhereValuesLie) {
  write("canal.dpde", canal(8));
  ASSERT_EQ(dpde("run canal.dpde canal --quiet --out o").status, 0);
  {
    const NetcdfFile file(path("o/canal.nc").string());
    EXPECT_EQ(file.dimensions("u_x"), (std::vector<std::string>{"time", "x_faces"}));
    EXPECT_EQ(file.dimensions("eta"), (std::vector<std::string>{"time", "x"}));
    const std::vector<double> faces = file.values("x_faces"), u = file.values("u_x");
    for (int i = 0; i < 8; ++i) {
      EXPECT_NEAR(faces[i], (i + 1) / 8.0, 1e-15);
      EXPECT_NEAR(u[i], 0.25 + faces[i] * (1 - faces[i]), 1e-15);
    }
    EXPECT_EQ(u[15], 0.25);  // the last one, on the wall, at the end
  }
  EXPECT_EQ(dpde("plot o/canal.nc --out p").status, 0);
  std::string text = canal(8);
  text.replace(text.find("0.25 + x*(1 - x)"), 16, "load(\"o/canal.nc\", u.x) at t = 0");
  write("again.dpde", text);
  ASSERT_EQ(dpde("run again.dpde canal --quiet --out q").status, 0);
  EXPECT_EQ(read_npy(path("q/eta.npy")).values, read_npy(path("o/eta.npy")).values);
  text.replace(text.find("u.x) at"), 3, "eta");
  write("other.dpde", text);
  const Outcome other = dpde("run other.dpde canal --json --out q");
  EXPECT_EQ(other.codes(), std::vector<std::string>{"E0907"}) << other.err;
}

/// The same faces on a grid three times as fine: cell values are averaged, face values are not.
TEST_F(Staggered, DataOfAFinerSceneAreThoseOnTheSameFaces) {
  std::string fine = canal(24);
  fine = fine.substr(fine.find("scene canal"));
  fine.replace(0, 11, "scene fine ");
  write("task.dpde",
        canal(8, fine + "task t : canal {\n  data v = u from scene fine at t = 0\n  unknown initial eta from 0\n"
                        "  minimise mean((u.x - v.x)^2) at t = 0\n  minimise mean(eta^2)\n}\n"));
  const Outcome first = dpde("gradient task.dpde t --json");
  ASSERT_EQ(first.status, 0) << first.err;
  write("zero.dpde", canal(8, "task t : canal {\n  unknown initial eta from 0\n  minimise mean(eta^2)\n}\n"));
  const Outcome alone = dpde("gradient zero.dpde t --json");
  EXPECT_NEAR(first.json()["loss"].get<double>(), alone.json()["loss"].get<double>(), 1e-15);
}

/// An unknown's value on a wall is not used: its derivative is 0, and the others are right.
TEST_F(Staggered, WallsAreNoUnknowns) {
  write("task.dpde",
        canal(6, "task t : canal {\n  unknown initial u from 0.1*x\n  minimise mean(eta^2) + mean(u.x^4)\n}\n"));
  const Outcome outcome = dpde("gradient task.dpde t --out o --json");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const std::vector<double> gradient = read_npy(path("o/gradient_u.x.npy")).values;
  EXPECT_EQ(gradient.back(), 0);
  EXPECT_GT(std::abs(gradient.front()), 1e-3);
  const Outcome certified = dpde("verify task.dpde t --json");
  EXPECT_TRUE(certified.json()["passed"].get<bool>()) << certified.out;
}

TEST_F(Staggered, FormattingKeepsPlacements) {
  write("f.dpde", "model m {\n  vector u on faces\n  field f, g on faces.x\n  coefficient w on nodes\n}\n");
  const Outcome outcome = dpde("fmt f.dpde --check");
  EXPECT_EQ(outcome.status, 0) << outcome.err;
}

}  // namespace
}  // namespace dpde::testing
