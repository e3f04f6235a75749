// SPDX-License-Identifier: Apache-2.0
// Boundary conditions in the commands that driver/conditions_test leaves out: each stage of emit, stability, bench,
// chart and build. One condition by day, all at night.
#include <fmt/format.h>

#include "command_support.h"
#include "support/setting.h"

namespace dpde::testing {
namespace {

class ConditionsCommand : public Command, public ::testing::WithParamInterface<std::string> {};

std::string text_with(const std::string& condition, const std::string& side) {
  const std::string others = side == "x.high" ? "x.low = 0.1, y = 0.1" : "x = 0.1, y.high = 0.1";
  const std::string control = condition.find('F') == std::string::npos ? "" : "; control F",
                    value = control.empty() ? "" : "  F = 0.5 + sin(5*t) every 0.02\n";
  return "model m { field u; coefficient g; param k, q" + control +
         "; dt(dt(u)) = k*lap(u) - 0.1*dt(u) + 0.1*q*g }\nscheme s { time = rk4 }\nscene z : m with s {\n"
         "  grid x = 0 .. 1, cells 8\n  grid y = 0 .. 1, cells 7\n  k = 1; q = 0.8; g = 0.3 + 0.1*x\n" +
         value + "  boundary u: " + side + " = " + condition + ", " + others +
         "\n  initial u = exp(-9*(x - 0.6)^2)\n  initial dt(u) = 0\n  time 0 .. 0.04, step 0.01\n}\n"
         "task find : z { unknown k from 1.1; unknown q; minimise mean(u^2) }\n";
}

TEST_P(ConditionsCommand, ByEveryOtherVerb) {
  if (!is_thorough()) GTEST_SKIP() << "at night: measurements, and a C++ compiler";
  const std::string stages[] = {"ast",          "model",        "stencil",    "tangent",     "adjoint",
                                "loop",         "adjoint-loop", "cpp",        "adjoint-cpp", "llvm",
                                "adjoint-llvm", "asm",          "adjoint-asm"};
  for (const char* side : {"x.high", "y.low"}) {
    SCOPED_TRACE(GetParam() + " at " + side);
    write("a.dpde", text_with(GetParam(), side));
    for (const std::string& stage : stages) {
      const Outcome emit = dpde("emit a.dpde find --stage " + stage);
      EXPECT_EQ(emit.status, 0) << stage << emit.err;
      EXPECT_NE(emit.out, "") << stage;
    }
    const Outcome stability = dpde("stability a.dpde z --json");
    EXPECT_EQ(stability.status, 0) << stability.err;
    const Outcome bench = dpde("bench a.dpde find --json");
    EXPECT_EQ(bench.status, 0) << bench.err;
    const Outcome chart =
        dpde("chart a.dpde z --reference-cells 32 --vary cells=8,16 --samples 1 --sample-seconds 0.001 --json --out c");
    EXPECT_EQ(chart.status, 0) << chart.err;
    const Outcome build = dpde("build a.dpde find -o lib --quiet");
    EXPECT_EQ(build.status, 0) << build.err;
  }
}

std::vector<std::string> conditions() {
  std::vector<std::string> all{"radiating(1 + u^2)",
                               "0.5",
                               "sin(t)",
                               "q*u",
                               "g",
                               "F",
                               "zero_gradient",
                               "gradient(-q*u^2)",
                               "gradient(g)",
                               "gradient(F)",
                               "mixed(q, 1, sin(t))",
                               "linear",
                               "outflow",
                               "radiating(q)"};
  if (!is_thorough()) all.resize(1);  // a skipped test reports so
  return all;
}

INSTANTIATE_TEST_SUITE_P(OfTheTable, ConditionsCommand, ::testing::ValuesIn(conditions()));

}  // namespace
}  // namespace dpde::testing
