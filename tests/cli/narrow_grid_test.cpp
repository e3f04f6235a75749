// SPDX-License-Identifier: Apache-2.0
// Certificates of flows past obstacles. On the narrow test grids an obstacle may close the channel, so that the
// pressure is undetermined there or nothing moves. A gradient that is right on the scene's grid is certified
// nevertheless, and rounding errors are not reported as wrong.
#include "command_support.h"
#include "support/setting.h"

namespace dpde::testing {
namespace {

struct Channel {
  const char *name, *ux, *uy, *start, *axis_y;
};
const Channel channels[] = {
    {"from below", "x = 0, y.low = 0, y.high = outflow", "x = zero_gradient, y.low = 1, y.high = outflow", "(0, 1)",
     ""},
    {"from below between walls", "x = 0, y = 0", "x = 0, y.low = 1, y.high = 1", "(0, 1)", ""},
    {"from the left", "x.low = 1, x.high = outflow, y = 0", "x.low = 0, x.high = outflow, y = 0", "(1, 0)", ""},
    {"from the left, periodic across", "x.low = 1, x.high = outflow", "x.low = 0, x.high = outflow", "(1, 0)",
     ", periodic"},
};
const std::string obstacles[] = {
    "(x - 50)^2 + (y - 50)^2 < 100",
    "min((x - 30)^2 + (y - 60)^2, (x - 70)^2 + (y - 140)^2) < 200",
    "max(abs(y - 100) - 2, x - 97) < 0",  // a wall that few rows contain
    "max(abs(x - 50) - 2, y - 197) < 0",  // likewise, along y
    "min((x - 50)^2 + (y - 100)^2, (x - 50)^2 + (y - 30)^2) < 9",
    "(x - 50)^2/9 + (y - 100)^2/9000 < 1",
    "cos(x*2*pi/100*3.5)*cos(y*2*pi/200*5.5) > 0.9",  // a lattice
};
const std::string narrow_schemes[] = {"advect = semi_lagrangian; time = euler",
                                      "advect = central(2); time = rk2; solve = cg",
                                      "advect = semi_lagrangian; time = euler; solve = multigrid"};

std::string obstacle_text(const Channel& channel, const std::string& solid, const std::string& scheme,
                          const std::string& projected) {
  return std::string(
             "model wake { vector u on faces; field p; mask solid; param nu = 0.05\n"
             "  dt(u) = -advect(u, u) - grad(p) + nu*lap(u); 0 = div(u) gives p; u = 0 inside solid }\n"
             "scheme book { ") +
         scheme + " }\nscene s : wake with book {\n  grid x = 0 .. 100, cells 16\n  grid y = 0 .. 200, cells 32" +
         channel.axis_y + "\n  solid = " + solid + "\n  boundary u.x: " + channel.ux +
         "\n  boundary u.y: " + channel.uy + "\n  initial u = " + channel.start + projected +
         "\n  time 0 .. 4, step 1\n}\n" +
         "task t : s { unknown nu; minimise mean(u.x^2) + mean((u.y - 0.5)^2); using lbfgs(), iterations 2 }\n";
}

class NarrowGrids : public Command {};

/// Three cases by day, 168 at night.
TEST_F(NarrowGrids, ThatAnObstacleClosesMakeNoGradientWrong) {
  std::size_t number = 0;
  for (const Channel& channel : channels) {
    for (const std::string& solid : obstacles) {
      for (const std::string& scheme : narrow_schemes) {
        for (const char* const projected : {"", " projected"}) {
          if (!is_tried(number++, 83)) continue;
          write("t.dpde", obstacle_text(channel, solid, scheme, projected));
          const Outcome outcome = dpde("verify t.dpde t --json");
          EXPECT_EQ(outcome.status, 0) << channel.name << ", " << solid << ", " << scheme << projected << outcome.err;
          EXPECT_EQ(outcome.json()["passed"], true);
        }
      }
    }
  }
}

}  // namespace
}  // namespace dpde::testing
