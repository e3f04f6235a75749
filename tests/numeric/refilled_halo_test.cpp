// SPDX-License-Identifier: Apache-2.0
// Solves whose coefficients read a state between walls: the state's ghost cells are filled before the solve, within it
// and after it, always with the same values. Gradients by the wall value against central differences.
#include <gtest/gtest.h>

#include <cmath>

#include "../driver/driver_support.h"
#include "support/scene_run.h"

namespace dpde::testing {
namespace {

struct Variant {
  const char *scheme, *grid, *coefficient, *wall, *place;
};

std::string text_of(const Variant& of, const std::string& b) {
  const bool is_staggered = *of.place != '\0', is_plane = std::string(of.grid).find("grid y") != std::string::npos;
  const std::string u = is_staggered ? "interpolate(u)" : "u", psi = is_staggered ? "interpolate(psi)" : "psi";
  return std::string("model m { param b; field u") + of.place + "; field v\n  solve div((1 + 0.3*" + of.coefficient +
         ")*grad(psi)) - psi = -" + u + " for psi\n  dt(u) = 0.4*lap(u) + 0.7*" + psi + "*u\n  dt(v) = 0.2*lap(v) - " +
         u + "*psi }\nscheme q { time = " + of.scheme + " }\nscene s : m with q {\n  " + of.grid + "\n  b = " + b +
         "\n  boundary psi: all = 0.3\n  boundary u: x.low = " + of.wall + ", x.high = 0.2" +
         (is_plane ? ", y = zero_gradient" : "") +
         "\n  boundary v: all = b\n  time 0 .. 0.015, step 0.005\n  initial u = 1 + 0.1*x\n"
         "  initial v = 0.5 + 0.2*x }\ntask t : s { unknown b; minimise mean(v^2) + mean(psi^2) over time }\n";
}

TEST(RefilledHalos, HaveGradients) {
  const char *line = "grid x = 1 .. 3, cells 4", *plane = "grid x = 1 .. 3, cells 4\n  grid y = 0 .. 1, cells 3";
  for (const Variant& variant :
       {Variant{"euler", line, "u", "b", ""}, Variant{"euler", line, "u*v", "mixed(1, 0.3, b)", ""},
        Variant{"rk4", line, "u", "b*(1 + 20*t)", ""}, Variant{"ab2", line, "u", "b", ""},
        Variant{"imex_euler", line, "u*v", "b*(1 + 20*t)", ""}, Variant{"rk2", plane, "u", "b + 0.2*t", ""},
        Variant{"ars222", line, "interpolate(u)", "b", " on faces.x"}}) {
    SCOPED_TRACE(std::string(variant.scheme) + " " + variant.coefficient + " " + variant.wall);
    constexpr double b = 0.5, h = 1e-4;
    const auto loss = [&](double by) { return task_loss(text_of(variant, std::to_string(b + by)), "t"); };
    const double wanted = (loss(h) - loss(-h)) / (2 * h);
    const TaskResult found = task_gradient(text_of(variant, "0.5"), "t");
    EXPECT_NEAR(found.gradient.at("b").front(), wanted, 1e-6 * std::abs(wanted));
  }
}

}  // namespace
}  // namespace dpde::testing
