// SPDX-License-Identifier: Apache-2.0
// Runs and analyses of compiled scenes take formulas into account, wherever they are.
#include <algorithm>

#include "analysis/unused.h"
#include "driver/scene/session.h"
#include "driver_support.h"
#include "support/kept_code.h"

namespace dpde::testing {
namespace {

std::unique_ptr<driver::Session> opened(const std::string& text) {
  const SourceFile source("test.dpde", text);
  driver::CompileOptions options;
  options.selection.name = "s";
  options.backend = driver::Backend::jit;
  options.cache = kept_code();
  DiagnosticSink sink;
  return driver::Session::open(source, compiled(source, options), {}, sink);
}

/// The formula in the slot, numbers elsewhere.
std::string text_with(const std::string& slot, const std::string& formula, const std::string& model = "",
                      const std::string& scheme = "") {
  const auto at = [&](const std::string& name) { return name == slot ? formula : std::string("0.5"); };
  return "model m {\n  field u, v\n  mask solid\n" + model + "  dt(u) = 0\n  dt(v) = 0.1*" + at("equation") +
         "\n  v = " + at("held") + " inside solid\n  let q = u*" + at("output") + "\n}\nscheme k { " + scheme +
         " }\nscene s : m with k {\n  grid x = 0 .. 1, cells 8, periodic\n  grid y = 0 .. 1, cells 8, periodic\n" +
         "  solid = t < 100\n  initial u = 1\n  initial v = 0\n  exact u = " + at("exact") +
         "\n  time 0 .. 0.2, step 0.1, courant 0.5, speed 0.01*|" + at("speed") + "|\n  after step: v = v + " +
         at("event") + "\n  observe o = mean(" + at("observable") + ")\n  output q\n}\n";
}

/// lap(phi) - phi = u has the solution phi = -u for uniform u.
TEST(UsesInSteps, StepsStoreWhatTheySolveFor) {
  for (const char* slot : {"equation", "held", "event"}) {
    const auto session =
        opened(text_with(slot, "phi", "  solve lap(phi) - phi = u for phi\n", "solve = cg(1e-10, 100); guess = last"));
    session->rollout().run();
    const int kept = session->rollout().state_index("phi_last");
    ASSERT_GE(kept, 0) << slot;
    for (const double value : session->final_state(kept)) EXPECT_NEAR(value, -1, 1e-8) << slot;
  }
}

/// y is always idle; x only if no reported value of a run varies along it.
TEST(UsesInSteps, AxesAreIdleWhereNothingVaries) {
  const auto idle = [](const std::string& slot) {
    const auto session = opened(text_with(slot, "sin(2*pi*x)"));
    std::string axes;
    for (const analysis::Unused& unused : analysis::idle_axes(session->compiled(), *session)) axes += unused.name;
    return axes;
  };
  EXPECT_EQ(idle("none"), "xy");
  for (const char* slot : {"equation", "held", "event", "speed", "observable", "output", "exact"})
    EXPECT_EQ(idle(slot), "y") << slot;
}

}  // namespace
}  // namespace dpde::testing
