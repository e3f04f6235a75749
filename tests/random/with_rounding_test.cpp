// SPDX-License-Identifier: Apache-2.0
#include "stencil/interpret/with_rounding.h"

#include <gtest/gtest.h>

#include <cmath>

#include "random/variants.h"

namespace dpde::testing {

using namespace stencil;

namespace {

/// Results of reductions that add move by a part of the sum of magnitudes of the terms, also where the terms cancel;
/// what chooses a value is exact, and so is a copy.
TEST(WithRounding, MovesWhatAddsUp) {
  struct Case {
    const char* statement;
    double magnitudes;  // of the terms; 0: exact
  };
  const Case cases[] = {{"reduce w = sum u", 36e6},
                        {"reduce w = mean u", 6e6},
                        {"reduce w = sum u over x", 27e6},
                        {"reduce w = mean u over y", 11e6},
                        {"repeat 1 { reduce r = sum u; swap u, r } to w", 36e6},
                        {"reduce w = max u", 0},
                        {"reduce w = min u over x", 0},
                        {"run copy", 0}};
  const std::vector<double> u = {1e6, -2e6, 6e6, 4e6, -8e6, 15e6};
  for (const Case& c : cases) {
    const Module module = parse_module(
        "kernel copy(u: field, out w: field) on 2 axes { w = u }\nprogram p { axes x "
        "periodic, y periodic; " +
        std::string(c.statement) + "; keep w }");
    const auto run = [&](const Module& m) {
      return run_interpreted(m, m.programs.front(), {{2, {3, 2, 1}}, {{"u", u}}, {}}).fields.at("w");
    };
    const std::vector<double> exact = run(module), moved = run(with_rounding(module));
    double change = 0;
    for (std::size_t i = 0; i < exact.size(); ++i) change = std::max(change, std::abs(moved[i] - exact[i]));
    EXPECT_LE(change, 1.5e-15 * c.magnitudes) << c.statement;  // the last bit of the result besides
    if (c.magnitudes > 0) EXPECT_GE(change, 1e-17 * c.magnitudes) << c.statement;
  }
}

/// The tangent of a chaotic program, as seed 721439: one back end gave 1e23, the other 1e22, and rounding as much.
TEST(Distance, OfResultsWithoutDigitsIsOfOrderOne) {
  const Outcome small{{{"u", {1, -1e22}}}, {{"s", 2}}}, large{{{"u", {1, 3e23}}}, {{"s", 2}}};
  EXPECT_EQ(distance(small, large), distance(large, small));
  EXPECT_DOUBLE_EQ(distance(large, small), 3.1 / 3);
  EXPECT_EQ(distance({{{"u", {1e-3}}}, {}}, {{{"u", {0}}}, {}}), 1e-3);
  EXPECT_EQ(distance(small, {}), INFINITY);
}

}  // namespace
}  // namespace dpde::testing
