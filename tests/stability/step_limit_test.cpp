// SPDX-License-Identifier: Apache-2.0
// Largest stable steps as von Neumann's analysis of the step's own tangent finds them, against tables that a scan of
// amplification factors gave (numerics.md, 1.1 and 1.2) and closed forms.
#include "stability/step_limit.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "driver/compile/pipeline.h"
#include "stability/frozen/one_moment.h"

namespace dpde::stability {
namespace {

/// The limit of a periodic scene s with h = 1 along all axes.
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

Scene scene_of(const std::string& text, const std::map<std::string, FrozenValue>& fields = {}) {
  const SourceFile source("test.dpde", text);
  DiagnosticSink sink;
  driver::CompileOptions options;
  options.selection.name = "s";
  std::optional<driver::Compiled> compiled = driver::compile(source, options, sink);
  for (const Diagnostic& d : sink.all()) ADD_FAILURE() << d.message << "\n" << text;
  std::string why;
  std::optional<LinearStep> linear =
      LinearStep::make(at_one_moment(compiled.value().stencil, 0), compiled->step_name(), why);
  EXPECT_EQ(why, "");
  FrozenPoint point{fields, {}, {{"hx", 1}, {"hy", 1}, {"hz", 1}, {"t", 1e6}}};
  for (const model::Parameter& param : compiled->problem->params) point.params[param.name] = param.value;
  return {std::move(*compiled), std::move(linear).value(), std::move(point)};
}

std::string text_of(const std::string& equation, const std::string& scheme, int rank = 1) {
  std::string text = "model m { field u; " + equation + " }\nscheme c { " + scheme + " }\nscene s : m with c {\n";
  for (int axis = 0; axis < rank; ++axis) text += fmt::format("  grid {} = 0 .. 64, cells 64, periodic\n", "xyz"[axis]);
  if (equation.starts_with("dt(dt(")) text += "  initial dt(u) = 0\n";
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
INSTANTIATE_TEST_SUITE_P(Stability, AdvectionTable,
                         ::testing::Values(Entry{"upwind(1)", "euler", 1}, Entry{"upwind(1)", "rk2", 1},
                                           Entry{"upwind(1)", "ssp_rk3", 1.2564}, Entry{"upwind(1)", "rk4", 1.3926},
                                           Entry{"upwind(1)", "ab2", 0.5}, Entry{"upwind(1)", "leapfrog", 0},
                                           Entry{"central(2)", "euler", 0}, Entry{"central(2)", "rk2", weak},
                                           Entry{"central(2)", "ssp_rk3", 1.7321}, Entry{"central(2)", "rk4", 2.8284},
                                           Entry{"central(2)", "ab2", weak}, Entry{"central(2)", "leapfrog", 1},
                                           Entry{"central(4)", "euler", 0}, Entry{"central(4)", "rk2", weak},
                                           Entry{"central(4)", "ssp_rk3", 1.2622}, Entry{"central(4)", "rk4", 2.0612},
                                           Entry{"central(4)", "ab2", weak}, Entry{"central(4)", "leapfrog", 0.7288},
                                           Entry{"upwind(3)", "euler", 0}, Entry{"upwind(3)", "rk2", 0.8738},
                                           Entry{"upwind(3)", "ssp_rk3", 1.6259}, Entry{"upwind(3)", "rk4", 1.7453},
                                           Entry{"upwind(3)", "ab2", 0.5802}, Entry{"upwind(3)", "leapfrog", 0},
                                           Entry{"upwind(1)", "ab3", 0.2727}, Entry{"central(2)", "ab3", 0.7236},
                                           Entry{"central(4)", "ab3", 0.5274}, Entry{"upwind(3)", "ab3", 0.3965}));

/// The wave of two cells has the largest wave number, pi a cell: 1/pi of the limits on the imaginary axis.
INSTANTIATE_TEST_SUITE_P(Spectral, AdvectionTable,
                         ::testing::Values(Entry{"spectral", "euler", 0}, Entry{"spectral", "rk2", weak},
                                           Entry{"spectral", "ssp_rk3", std::sqrt(3) / M_PI},
                                           Entry{"spectral", "rk4", std::sqrt(8) / M_PI},
                                           Entry{"spectral", "leapfrog", 1 / M_PI}));

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
    for (int axis = 0; axis < rank; ++axis)
      EXPECT_NEAR(std::abs(found.wave[static_cast<std::size_t>(axis)]), M_PI, 1e-3);
  }
}
INSTANTIATE_TEST_SUITE_P(Stability, DiffusionTable,
                         ::testing::Values(Entry{"central(2)", "euler", 0.5}, Entry{"central(2)", "rk2", 0.5},
                                           Entry{"central(2)", "ssp_rk3", 0.62819}, Entry{"central(2)", "rk4", 0.69632},
                                           Entry{"central(2)", "ab2", 0.25}, Entry{"central(2)", "leapfrog", 0},
                                           Entry{"central(4)", "euler", 0.375}, Entry{"central(4)", "rk2", 0.375},
                                           Entry{"central(4)", "ssp_rk3", 0.47114}, Entry{"central(4)", "rk4", 0.52224},
                                           Entry{"central(4)", "ab2", 0.1875}, Entry{"central(2)", "ab3", 0.13636},
                                           Entry{"central(4)", "ab3", 0.10227}));
INSTANTIATE_TEST_SUITE_P(Spectral, DiffusionTable,
                         ::testing::Values(Entry{"spectral", "euler", 0.20264}, Entry{"spectral", "rk2", 0.20264},
                                           Entry{"spectral", "ssp_rk3", 0.25459}, Entry{"spectral", "rk4", 0.28221},
                                           Entry{"spectral", "ab2", 0.10132}, Entry{"spectral", "leapfrog", 0}));

/// Advection by c = 1 and diffusion, forward in time and central in space: dt <= min(h^2/(2 d D), 2 D/c^2), both
/// needed.
TEST(StepLimit, OfAdvectionAndDiffusionIsTheSmallerOfTwo) {
  for (const double d : {0.001, 0.02, 0.3, 0.7, 4.0}) {
    const std::string equation = fmt::format("dt(u) = -advect(1, u) + {}*lap(u)", d);
    const StepLimit found = scene_of(text_of(equation, "advect = central(2); time = euler")).limit();
    const double expected = std::min(0.5 / d, 2 * d);
    ASSERT_EQ(found.kind, StepLimit::Kind::limit) << d;
    EXPECT_NEAR(found.step, expected, 1e-3 * expected) << d;
  }
}

/// c dt/h <= 1/sqrt(d) with central(2), sqrt(3/4)/sqrt(d) with central(4); RK4 goes to 2 sqrt(2)/(2 sqrt(d)).
TEST(StepLimit, OfWavesIsThatOfTheClosedForm) {
  for (const int rank : {1, 2, 3}) {
    for (const auto& [scheme, expected] : {std::pair{"lap = central(2); time = leapfrog", 1.0},
                                           {"lap = central(4); time = leapfrog", 0.8660254},
                                           {"lap = central(2); time = verlet", 1.0},
                                           {"lap = central(2); time = rk4", 1.4142136}}) {
      const StepLimit found = scene_of(text_of("dt(dt(u)) = lap(u)", scheme, rank)).limit();
      ASSERT_EQ(found.kind, StepLimit::Kind::limit) << scheme << rank;
      EXPECT_NEAR(found.step * std::sqrt(rank), expected, 1e-3) << scheme << rank;
    }
  }
}

/// |g|^2 = 1 + nu^4/4 at pi/2 for central(2) and RK2: a hundredfold in 594 steps at 0.5, in 42 at 1.
TEST(StepLimit, WeakGrowthIsMeasured) {
  const Scene scene = scene_of(text_of("dt(u) = -advect(1, u)", "advect = central(2); time = rk2"));
  for (const auto& [nu, growth, steps] : {std::tuple{0.5, 1.00778, 594.0}, {1.0, 1.118, 42.0}}) {
    const Largest found = scene.analysis().excess(nu);
    EXPECT_NEAR(std::exp(found.value), growth, 1e-3 * growth);
    EXPECT_NEAR(std::ceil(std::log(100.0) / found.value), steps, 1);
    EXPECT_NEAR(std::abs(found.angles[0]), M_PI / 2, 1e-3);
  }
}

/// Growth that the equations have is no fault of the scheme: u' = 0.3 u + lap(u) is limited as lap(u) is, but for that.
TEST(StepLimit, GrowthOfTheEquationsIsAllowed) {
  const Scene scene = scene_of(text_of("dt(u) = 0.3*u + lap(u)", "time = euler"));
  EXPECT_NEAR(scene.analysis().growth_rate(), 0.3, 1e-4);
  const StepLimit found = scene.limit();
  ASSERT_EQ(found.kind, StepLimit::Kind::limit);
  EXPECT_NEAR(found.step, 2 / (4 - 0.3), 1e-3);
  EXPECT_NEAR(scene_of(text_of("dt(u) = 0.3*u", "time = euler")).analysis().growth_rate(), 0.3, 1e-9);
}

/// An oscillation that grows by Euler's method, not by the equations.
TEST(StepLimit, OfAnOscillationByEuler) {
  const std::string text =
      "model m { field a, b; dt(a) = b - 0.1*a; dt(b) = -a - 0.1*b }\nscheme c { time = euler }\n"
      "scene s : m with c {\n  grid x = 0 .. 8, cells 8, periodic\n  initial a = 1\n"
      "  initial b = 0\n  time 0 .. 1, step 0.1\n}\n";
  const StepLimit found = scene_of(text).limit();
  ASSERT_EQ(found.kind, StepLimit::Kind::limit);
  EXPECT_NEAR(found.step, 2 * 0.1 / (0.01 + 1), 1e-3 * found.step);  // |1 + dt (-0.1 + i)| = 1
}

TEST(StepLimit, FollowingTheFlowHasNone) {
  const std::string euler = "; time = euler";
  for (const std::string advect : {"semi_lagrangian", "semi_lagrangian(cubic)"}) {
    const Scene scene = scene_of(text_of("dt(u) = -advect(1.3, u)", "advect = " + advect + euler));
    EXPECT_EQ(scene.limit().kind, StepLimit::Kind::none) << advect;
    // Half a cell beyond whole ones, the wave of two cells is gone; at whole cells nothing is lost.
    EXPECT_NEAR(scene.analysis().growth_of({M_PI, 0, 0}, 2.5 / 1.3), 0, 1e-9) << advect;
    EXPECT_NEAR(scene.analysis().growth_of({M_PI, 0, 0}, 2 / 1.3), 1, 1e-9) << advect;
  }
}

/// The tangent of the step is that of all passes of a repeat: v goes 4 times as far as in a step of its own.
TEST(StepLimit, OfSubcyclesIsThatOfTheirParts) {
  const auto text = [](const std::string& parts) {
    return "model m { field u, v; dt(u) = lap(u); dt(v) = 4*lap(v) }\nscheme c { time = euler }\n"
           "scene s : m with c {\n  grid x = 0 .. 8, cells 8, periodic\n  initial u = 1\n"
           "  initial v = 0\n  time 0 .. 1, step 0.1\n" +
           parts + "}\n";
  };
  EXPECT_NEAR(scene_of(text("")).limit().step, 0.125, 1e-4);
  EXPECT_NEAR(scene_of(text("  subcycle v in 2\n")).limit().step, 0.25, 1e-4);
  EXPECT_NEAR(scene_of(text("  subcycle v in 8\n")).limit().step, 0.5, 1e-4);
}

}  // namespace
}  // namespace dpde::stability
