// SPDX-License-Identifier: Apache-2.0
#include "random/torn_corners.h"

#include <gtest/gtest.h>

#include <string>

#include "support/derivative_check.h"

namespace dpde::testing {
namespace {

/// Of the sides along x and y, and what is read: whether the order of the fills changes the result.
TEST(TornCorners, AreThoseWhoseFillsDoNotCommute) {
  struct Case {
    const char *axes, *sides, *read;
    bool is_torn;
  };
  const Case cases[] = {
      {"x bounded, y bounded", "x = gradient(g), y = 1", "u[+1, +1]", true},
      {"x bounded, y bounded", "x = gradient(g), y = 1", "u[+1, 0] + u[0, +1]", false},
      {"x bounded, y bounded", "x = gradient(g), y = 1", "interp(u, 0.2, 0.1)", true},
      {"x bounded, y bounded", "x = zero_gradient, y = 1", "u[+1, +1]", false},
      {"x bounded, y bounded", "x = 0, y = gradient(0)", "u[+1, +1]", false},
      {"x bounded, y bounded", "x = 0, y = 1", "u[+1, +1]", true},
      {"x bounded, y bounded", "x = v, y = zero_gradient", "u[+1, +1]", true},
      {"x bounded, y bounded", "x = gradient(1), y = linear", "u[+1, +1]", false},
      {"x bounded, y bounded", "x = on_wall(1), y = gradient(v)", "u[+1, 0]", false},
      {"x bounded, y bounded", "x = on_wall(1), y = gradient(v)", "u[0, +1]", true},
      {"x bounded, y bounded", "x = on_wall(1), y = on_wall(gradient(v))", "u", true},
      {"x periodic, y bounded", "x = periodic, y = v", "u[+1, +1]", false},
  };
  for (const Case& c : cases) {
    const std::string text =
        "kernel wall(out v: field) on 2 axes { v = 1 }\nkernel k(u: field halo 1, out w: field, g: param) on 2 axes { "
        "w = g + " +
        std::string(c.read) + " }\nprogram p { axes " + c.axes + "; run wall grow 1; fill u " + c.sides +
        "; run k; keep w }";
    EXPECT_EQ(has_torn_corners(parse_module(text)), c.is_torn) << text;
  }
}

}  // namespace
}  // namespace dpde::testing
