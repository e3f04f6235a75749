// SPDX-License-Identifier: Apache-2.0
// Verdicts see what steps read, wherever it stands, and states that steps make, whatever a scene begins with: beside
// each limit a run goes on and a run blows up.
#include <gtest/gtest.h>

#include <cmath>

#include "stability/stability_report.h"
#include "stability_support.h"
#include "support/setting.h"

namespace dpde::stability {
namespace {

/// u' = -v u by rk4, where v becomes 100 in some way.
struct Way {
  std::string name, model, scene, start = "1";
};

const std::string solved = "  solve lap(phi) - phi = -1 for phi\n";

const std::vector<Way> ways{
    {"an equation that solves", solved + "  dt(u) = -100*phi*u\n  dt(v) = 0\n", ""},
    {"a held number", "  mask solid\n  dt(u) = -v*u\n  dt(v) = 0\n  v = 100 inside solid\n", "  solid = x < 0.9\n"},
    {"a held number that is there from the start",
     "  mask solid\n  dt(u) = -v*u\n  dt(v) = 0\n  v = 100 inside solid\n", "  solid = x < 0.9\n", "100"},
    {"a held number where much more is given", "  mask solid\n  dt(u) = -v*u\n  dt(v) = 0\n  v = 100 inside solid\n",
     "  solid = x < 2\n", "1000"},
    {"a held solution", solved + "  mask solid\n  dt(u) = -v*u\n  dt(v) = 0\n  v = 100*phi inside solid\n",
     "  solid = x < 0.9\n"},
    {"a held formula of time", "  mask solid\n  dt(u) = -v*u\n  dt(v) = 0\n  v = 100 + 1e-4*t inside solid\n",
     "  solid = x < 0.9\n"},
    {"a held formula of a state",
     "  field w\n  mask solid\n  dt(u) = -v*u\n  dt(v) = 0\n  dt(w) = 0\n  v = 100*w inside solid\n",
     "  solid = x < 0.9\n  initial w = 1\n"},
    {"an event", "  dt(u) = -v*u\n  dt(v) = 0\n", "  after step: v = 100\n"},
    {"an event that solves", solved + "  dt(u) = -v*u\n  dt(v) = 0\n", "  after step: v = 100*phi\n"},
};

/// Formulas that are 1, of all that formulas are made of, in all places that make v 100.
std::vector<Way> made_of_features() {
  struct Feature {
    std::string name, formula, model = "", scene = "";
  };
  const std::vector<Feature> features{
      {"a parameter", "q", "  param q = 1\n"},
      {"a state", "w"},
      {"a product", "w*(2 - w)"},
      {"a mean", "mean(w)"},
      {"a coefficient", "c", "  coefficient c\n", "  c = 1\n"},
      {"a control", "F", "  control F\n", "  F = 1 every interval\n"},
      {"what is solved for", "phi", solved},
      {"a derivative", "w + dx(w)"},
      {"a choice", "if(w > 0, w, 2)"},
      {"an operator", "op(w)"},
      {"a power", "exp(w - 1)^2"},
  };
  const std::string mask = "  mask solid\n", solid = "  solid = x < 0.9\n", decay = "  dt(u) = -v*u\n  dt(v) = 0\n";
  std::vector<Way> all;
  for (const auto& [name, formula, model, scene] : features) {
    const std::string made = model + "  field w\n  dt(w) = 0\n", given = scene + "  initial w = 1\n";
    all.push_back({name + " in an equation", made + "  dt(u) = -100*(" + formula + ")*u\n  dt(v) = 0\n", given});
    all.push_back({name + " in a let", made + "  let a = 100*(" + formula + ")\n  dt(u) = -a*u\n  dt(v) = 0\n", given});
    all.push_back({name + " held", made + mask + decay + "  v = 100*(" + formula + ") inside solid\n", given + solid});
    all.push_back({name + " in an event", made + decay, given + "  after step: v = 100*(" + formula + ")\n"});
  }
  return all;
}

std::string text_of(const Way& way, double step) {
  return "operator op(g) order 1 = (g[+1] + g)/2\nmodel m {\n  field u, v\n" + way.model +
         "}\nscene s : m {\n  grid x = 0 .. 1, cells 16, periodic\n" + fmt::format("  let interval = {}\n", step) +
         way.scene + "  initial u = 1\n  initial v = " + way.start + "\n  time 0 .. 400*interval, step interval\n}\n";
}

double size_after_run(const Way& way, double step) {
  const auto session = open_scene(text_of(way, step));
  session->rollout().run();
  double largest = 0;
  for (const double value : session->final_state(0)) largest = std::max(largest, std::abs(value));
  return largest;
}

TEST(UsesVerdict, LimitsAreThoseOfRuns) {
  const double limit = 2.78529356 / 100;  // of rk4 on the negative axis (Hairer, Wanner IV.2)
  std::vector<Way> all = ways;
  const std::vector<Way> made = made_of_features();
  for (std::size_t i = 0; i < made.size(); ++i) {
    if (testing::is_tried(i, 7)) all.push_back(made[i]);
  }
  for (const Way& way : all) {
    const auto session = open_scene(text_of(way, 0.01));
    std::vector<double> before = session->initial(1);
    const StabilityReport verdict = verdict_of(*session);
    ASSERT_EQ(verdict.limit.kind, StepLimit::Kind::limit) << way.name << ": " << verdict.why;
    EXPECT_NEAR(verdict.limit.step, limit, 1e-3 * limit) << way.name;
    EXPECT_EQ(session->initial(1), before) << way.name << ": the run begins as the scene says";
    EXPECT_LT(size_after_run(way, 0.97 * limit), 1) << way.name;
    EXPECT_GT(size_after_run(way, 1.03 * limit), 1e3) << way.name;
  }
}

/// Points on walls are what the boundary says, and nothing reads what else they are given.
TEST(UsesVerdict, ValuesOnWallsAreThoseOfTheBoundary) {
  const auto limit_of = [](const std::string& flow) {
    const auto session = open_scene(
        "model m { field w on faces.x; field q; dt(w) = 0*w; dt(q) = -dx(w*interpolate(q)) + lap(q)/100 }\n"
        "scene s : m {\n  grid x = 0 .. 1, cells 32\n  boundary w: x = 0\n  boundary q: x = zero_gradient\n"
        "  initial w = " +
        flow + "\n  initial q = 1\n  time 0 .. 1, step 1e-4\n}\n");
    return verdict_of(*session).limit.step;
  };
  const double limit = limit_of("sin(pi*x)");
  EXPECT_NEAR(limit_of("if(x > 0.99, 1000, sin(pi*x))"), limit, 1e-9 * limit);
}

/// A prescribed value multiplies in each stage: it grows in steps of any length, and not by the equations.
TEST(UsesVerdict, HeldValuesThatGrowAreUnstableAtEveryStep) {
  const auto kind_of = [](const std::string& g, const std::string& held, const std::string& rate, int cells = 32) {
    const auto session = open_scene(
        "model m { field u; mask q; param g = " + g + "; dt(u) = " + rate + "; u = g*" + held +
        " inside q\n  solve psi - 0.01*lap(psi) = u for psi }\nscheme r { time = rk4 }\nscene s : m with r {\n"
        "  grid x = 0 .. 1, cells " +
        std::to_string(cells) +
        ", periodic\n  q = abs(x - 0.5) < 0.2\n  initial u = 1\n"
        "  time 0 .. 1, step 1/4000\n}\n");
    return verdict_of(*session).limit.kind;
  };
  for (const char* g : {"1.02", "-1.02", "1.5", "-3"}) EXPECT_EQ(kind_of(g, "u", "0"), StepLimit::Kind::never) << g;
  EXPECT_EQ(kind_of("0.98", "u", "0"), StepLimit::Kind::none);
  for (const int cells : {600, 5000}) {
    for (const char* g : {"1.02", "-1.02", "-3"}) EXPECT_EQ(kind_of(g, "u", "0", cells), StepLimit::Kind::never) << g;
    EXPECT_EQ(kind_of("1.02", "u", "0.1*lap(u)", cells), StepLimit::Kind::never) << cells;
    EXPECT_EQ(kind_of("0.98", "u", "0", cells), StepLimit::Kind::none) << cells;
  }
  EXPECT_EQ(kind_of("-1", "psi", "0.1*lap(u)"), StepLimit::Kind::never);
  EXPECT_EQ(kind_of("-0.5", "psi", "0.1*lap(u)"), StepLimit::Kind::limit);
}

}  // namespace
}  // namespace dpde::stability
