// SPDX-License-Identifier: Apache-2.0
// A warning, once per axis, if a scheme's stencil exceeds the grid.
#include <fmt/format.h>

#include "driver_support.h"

namespace dpde::testing {
namespace {

/// The compiler's messages on scene s, without hints.
std::string told(const std::string& rate, const std::string& scheme, const std::string& grids) {
  const SourceFile source("test.dpde", "model m { field u; dt(u) = " + rate + " }\nscheme c { " + scheme +
                                           " }\nscene s : m with c {\n" + grids +
                                           "  initial u = 1\n  time 0 .. 1, step 0.01\n}\n");
  DiagnosticSink sink;
  driver::CompileOptions options;
  options.selection.name = "s";
  driver::compile(source, options, sink);
  std::string all;
  for (const Diagnostic& d : sink.all()) {
    EXPECT_TRUE(d.range.is_known());
    all += (all.empty() ? "" : "; ") + std::string(d.kind->code) + " " + d.message;
  }
  return all;
}

std::string ring(const std::string& axis, int cells) {
  return fmt::format("  grid {} = 0 .. 1, cells {}, periodic\n", axis, cells);
}
std::string rod(int cells) { return fmt::format("  grid x = 0 .. 1, cells {}\n  boundary u: x = 0\n", cells); }
std::string warning(int read, const std::string& axis, int cells) {
  return fmt::format(
      "W0505 a step reads {} cells in a row along {}, which has {}: some are read twice, and the scheme's "
      "order is lost",
      read, axis, cells);
}

TEST(WideFormulas, AreToldWhereTheGridHasFewerCells) {
  EXPECT_EQ(told("lap(u)", "lap = central(6)", ring("x", 2)), warning(7, "x", 2));
  EXPECT_EQ(told("lap(u)", "lap = central(6)", ring("x", 6)), warning(7, "x", 6));
  EXPECT_EQ(told("lap(u)", "lap = central(6)", ring("x", 7)), "");
  EXPECT_EQ(told("lap(u)", "lap = central(6)", rod(2)), warning(7, "x", 2));
  EXPECT_EQ(told("lap(u)", "lap = central(6)", rod(1)), warning(7, "x", 1));
  EXPECT_EQ(told("-advect(1, u)", "advect = upwind(3); time = rk4", ring("x", 3)), warning(4, "x", 3));
  EXPECT_EQ(told("-advect(1, u)", "advect = upwind(3); time = rk4", ring("x", 4)), "")
      << "two upstream, one downstream";
  EXPECT_EQ(told("-lap(lap(u))", "", ring("x", 4)), warning(5, "x", 4));
}

TEST(WideFormulas, AreToldOnceAnAxis) {
  EXPECT_EQ(told("lap(u) - advect((1, 1), u)", "lap = central(4); advect = central(8); time = rk4",
                 ring("x", 3) + ring("y", 8)),
            warning(9, "x", 3) + "; " + warning(9, "y", 8));
}

/// On a ring of one cell nothing varies; three points on two cells are expected.
TEST(WideFormulas, AreNoneOfThreePointsOrOnARingOfOneCell) {
  EXPECT_EQ(told("lap(u)", "", ring("x", 2)), "");
  EXPECT_EQ(told("lap(u)", "", rod(1)), "");
  EXPECT_EQ(told("lap(u)", "lap = central(6)", ring("x", 16) + ring("y", 1)), "");
  EXPECT_EQ(told("lap(u)", "lap = spectral", ring("x", 3)), "");
}

}  // namespace
}  // namespace dpde::testing
