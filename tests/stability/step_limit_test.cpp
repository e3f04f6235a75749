// SPDX-License-Identifier: Apache-2.0
// Largest stable steps as von Neumann's analysis of the step's own tangent finds them, against tables that a scan of
// amplification factors gave (numerics.md, 1.1 and 1.2) and closed forms.
#include "stability/step_limit.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "driver/pipeline.h"

namespace dpde::stability {
namespace {

/// Of a periodic scene s with h = 1 along all axes.
struct Scene {
  driver::Compiled compiled;
  LinearStep linear;
  FrozenPoint point;

  StepLimit limit(double step = 0.1) const { return analysis(step).limit(); }
  FrozenAnalysis analysis(double step = 0.1) const {
    const int rank = static_cast<int>(compiled.problem->axes.size());
    return FrozenAnalysis::make(linear, point, rank, step).value();
  }
};

Scene scene_of(const std::string& text, const std::map<std::string, double>& fields = {}) {
  const SourceFile source("test.dpde", text);
  DiagnosticSink sink;
  driver::CompileOptions options;
  options.selection.name = "s";
  std::optional<driver::Compiled> compiled = driver::compile(source, options, sink);
  for (const Diagnostic& d : sink.all()) ADD_FAILURE() << d.message << "\n" << text;
  std::string why;
  std::optional<LinearStep> linear = LinearStep::make(compiled.value().stencil, compiled->step_name(), why);
  EXPECT_EQ(why, "");
  FrozenPoint point{fields, {{"hx", 1}, {"hy", 1}, {"hz", 1}, {"t", 1e6}}, {}};
  for (const model::Parameter& param : compiled->problem->params) point.params[param.name] = param.value;
  return {std::move(*compiled), std::move(linear).value(), std::move(point)};
}

std::string text_of(const std::string& equation, const std::string& scheme, int rank = 1) {
  std::string text = "model m { field u; " + equation + " }\nscheme c { " + scheme + " }\nscene s : m with c {\n";
  for (int axis = 0; axis < rank; ++axis) text += fmt::format("  grid {} = 0 .. 64, cells 64, periodic\n", "xyz"[axis]);
  return text + "  initial u = sin(x)\n  time 0 .. 1, step 0.1\n}\n";
}

struct Entry {
  std::string space, time;
  double limit;
};
std::ostream& operator<<(std::ostream& out, const Entry& e) { return out << e.space << " " << e.time; }

constexpr double largest_error = 0.0005;  // relative; the tables have four to five digits

class AdvectionTable : public ::testing::TestWithParam<Entry> {};
TEST_P(AdvectionTable, IsPredicted) {
  const auto& [space, time, limit] = GetParam();
  const StepLimit found = scene_of(text_of("dt(u) = -advect(1, u)", "advect = " + space + "; time = " + time)).limit();
  if (limit == 0) {
    EXPECT_EQ(found.kind, StepLimit::Kind::never) << found.step;
    EXPECT_FALSE(found.is_weak()) << found.order;
  } else if (limit < 0) {
    EXPECT_EQ(found.kind, StepLimit::Kind::never) << found.step;
    EXPECT_TRUE(found.is_weak()) << found.order;
  } else {
    EXPECT_EQ(found.kind, StepLimit::Kind::limit);
    EXPECT_NEAR(found.step, limit, largest_error * limit);
  }
}
constexpr double weak = -1;
INSTANTIATE_TEST_SUITE_P(
    Stability, AdvectionTable,
    ::testing::Values(Entry{"upwind(1)", "euler", 1}, Entry{"upwind(1)", "rk2", 1}, Entry{"upwind(1)", "ssp_rk3", 1.2564},
                      Entry{"upwind(1)", "rk4", 1.3926}, Entry{"upwind(1)", "ab2", 0.5}, Entry{"upwind(1)", "leapfrog", 0},
                      Entry{"central(2)", "euler", 0}, Entry{"central(2)", "rk2", weak},
                      Entry{"central(2)", "ssp_rk3", 1.7321}, Entry{"central(2)", "rk4", 2.8284},
                      Entry{"central(2)", "ab2", weak}, Entry{"central(2)", "leapfrog", 1},
                      Entry{"central(4)", "euler", 0}, Entry{"central(4)", "rk2", weak},
                      Entry{"central(4)", "ssp_rk3", 1.2622}, Entry{"central(4)", "rk4", 2.0612},
                      Entry{"central(4)", "ab2", weak}, Entry{"central(4)", "leapfrog", 0.7288},
                      Entry{"upwind(3)", "euler", 0}, Entry{"upwind(3)", "rk2", 0.8738},
                      Entry{"upwind(3)", "ssp_rk3", 1.6259}, Entry{"upwind(3)", "rk4", 1.7453},
                      Entry{"upwind(3)", "ab2", 0.5802}, Entry{"upwind(3)", "leapfrog", 0}));

class DiffusionTable : public ::testing::TestWithParam<Entry> {};
TEST_P(DiffusionTable, IsPredicted) {
  const auto& [space, time, limit] = GetParam();
  for (const int rank : {1, 2, 3}) {
    const StepLimit found = scene_of(text_of("dt(u) = lap(u)", "lap = " + space + "; time = " + time, rank)).limit();
    if (limit == 0) {
      EXPECT_EQ(found.kind, StepLimit::Kind::never) << found.step;
      continue;
    }
    EXPECT_EQ(found.kind, StepLimit::Kind::limit);
    EXPECT_NEAR(found.step, limit / rank, largest_error * limit / rank) << rank;
    for (int axis = 0; axis < rank; ++axis) EXPECT_NEAR(std::abs(found.wave[static_cast<std::size_t>(axis)]), M_PI, 1e-3);
  }
}
INSTANTIATE_TEST_SUITE_P(
    Stability, DiffusionTable,
    ::testing::Values(Entry{"central(2)", "euler", 0.5}, Entry{"central(2)", "rk2", 0.5},
                      Entry{"central(2)", "ssp_rk3", 0.62819}, Entry{"central(2)", "rk4", 0.69632},
                      Entry{"central(2)", "ab2", 0.25}, Entry{"central(2)", "leapfrog", 0},
                      Entry{"central(4)", "euler", 0.375}, Entry{"central(4)", "rk2", 0.375},
                      Entry{"central(4)", "ssp_rk3", 0.47114}, Entry{"central(4)", "rk4", 0.52224},
                      Entry{"central(4)", "ab2", 0.1875}));

}  // namespace
}  // namespace dpde::stability
