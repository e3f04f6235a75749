// SPDX-License-Identifier: Apache-2.0
// Conditions in events of all three kinds that switch between the event's times, when it happens, or never. The state
// in the condition rises by 0.0175 per step; the reference is a difference of the loss over slightly more than that.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "support/setting.h"
#include "watched_support.h"

namespace dpde::testing {
namespace {

/// `c`: the threshold of u. The event acts at t = 0.5, where u would be 0.45 on its way from 0.1 to 0.8.
struct ChoosingEvent {
  std::string when, what, c, with = "", model = "";
  bool is_refused = false;
};

std::string text_of_choice(const ChoosingEvent& event) {
  return "operator chosen(z) order 0 = if(z > 0, 1, 0)\nscheme e { time = rk4 }\n"
         "model m { field u, v, p; param k = 0.4, c = " +
         event.c + "\n dt(u) = k + 0.3\n dt(v) = 0\n dt(p) = k + 0.3\n " + event.model +
         "\n}\n"
         "scene z : m with e { initial u = 0.1; initial v = 0; initial p = 0.1 - c\n time 0 .. 1, step 1/40\n " +
         event.with + "\n " + event.when + ": " + event.what +
         "\n}\n"
         "task t : z { unknown k; minimise (u + v)^2 }\n";
}

void expect_judged(const std::string& text, bool is_refused) {
  const FoundGradient found = gradient_of(text);
  EXPECT_EQ(found.is_refused, is_refused) << text;
  EXPECT_EQ(found.is_wrong(), is_refused) << text << found.gradient << " and " << found.secant;
}

/// Conditions on u itself, which the event sets or not.
std::vector<ChoosingEvent> choices() {
  const std::string halves = "u = if(u > c, 0.5*u, u)", jumps = "v = v + u*if(u > c, 1, 0)";
  std::vector<ChoosingEvent> all;
  for (const std::string& what : {halves, jumps}) {
    for (const char* when : {"every 0.5", "at t = 0.5", "at t = 0.5, 0.525"}) {
      for (const char* never : {"0.05", "2", "0.35"}) all.push_back({when, what, never});
      all.push_back({when, what, "0.445", "", "", true});
    }
    all.push_back({"every 0.25", what, "0.54"});  // below at first, then above
    if (what == jumps) all.push_back({"after step", what, "0.05"});
    all.push_back({"after step", what, "2"});
    all.push_back({"after step", what, "0.35", "", "", true});
  }
  const std::vector<std::string> others = {"u = if(w > 0, 0.5*u, u)", "v = v + u*chosen(u - c)",
                                           "v = v + u*sign(u - c)", "v = v + 0.1*atan(1/p)",
                                           "v = if(u > c, u, 0), u = 0.1"};
  for (const std::string& what : others) {
    all.push_back({"every 0.5", what, "0.35", "", "let w = u - c"});
    all.push_back({"at t = 0.5", what, "0.445", "", "let w = u - c", true});
    all.push_back({"after step", what, "2", "", "let w = u - c"});
  }
  for (const char* when : {"every 0.5", "at t = 0.5"}) {  // conditions on values that the previous line set
    const std::string down = std::string(when) + ": u = u - 0.3";
    all.push_back({when, jumps, "0.35", down});
    all.push_back({when, jumps, "0.145", down, "", true});
  }
  all.push_back({"at t = 0.5", halves, "0.35", "at t = 0.25: u = 0.3"});
  all.push_back({"after step", jumps, "0.35", "after step: u = u - 0.001", "", true});
  return all;
}

TEST(WatchedEvents, AreRefusedWhereTheySwitchAsTheyHappen) {
  const std::vector<ChoosingEvent> all = choices();
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (is_tried(i, 2)) expect_judged(text_of_choice(all[i]), all[i].is_refused);
  }
}

std::string text_on_grid(const std::string& when, const std::string& c) {
  return "scheme e { time = rk4 }\nmodel m { field u; param k = 0.4; dt(u) = 0.3 + k*(1 + x)\n}\n"
         "scene z : m with e { grid x = 0 .. 1, cells 64, periodic\n initial u = 0.1 + 0.1*x; time 0 .. 1, step "
         "1/40\n " +
         when + ": u = if(u > " + c + ", 0.5*u, u)\n}\ntask t : z { unknown k; minimise mean(u^2) }\n";
}

/// At t = 0.5 u is 0.45 .. 0.75.
TEST(WatchedEvents, AreRefusedWhereTheySwitchFromCellToCell) {
  expect_judged(text_on_grid("at t = 0.5", "0.6"), true);
  expect_judged(text_on_grid("at t = 0.5", "0.35"), false);
  expect_judged(text_on_grid("at t = 0.5", "0.15"), false);  // both sides occur initially
}

/// Values that another event of the same step has set.
TEST(WatchedEvents, ThatFollowOthersAreLookedAtWhereTheyAct) {
  const std::string to_and_fro =
      "scheme e { time = euler }\nmodel m { field p, q; param k = 1; dt(p) = -0.5*k\n dt(q) = 0\n}\n"
      "scene z : m with e { initial p = 1; initial q = 0; time 0 .. 1, step 1/400\n after step: p = p - ";
  const auto text = [&](const std::string& depth) {
    return to_and_fro + depth + "\n after step: q = q + 0.01*atan(1/p)\n after step: p = p + " + depth +
           "\n}\ntask t : z { unknown k; minimise (q + 1)^2 }\n";
  };
  expect_judged(text("0.8"), true);
  expect_judged(text("0.2"), false);
}

/// Equations do not see the values before events of each step, nor do these events see stages: a limiter cuts T after a
/// step, before any equation reads it, and a stage in the middle of the step is not a state of an event.
TEST(WatchedEvents, OfEachStepAreNoMatterOfEquations) {
  const auto text = [](const std::string& scheme, const std::string& model, const std::string& event) {
    return "scheme e { time = " + scheme + " }\nmodel m { field T, q; param k = 1\n dt(T) = k*2\n dt(q) = " + model +
           "\n}\nscene z : m with e { grid x = 0 .. 4, cells 4, periodic\n initial T = 0.6; initial q = 0\n "
           "after step: " +
           event + "\n time 0 .. 4, step 1/4\n}\ntask t : z { unknown k; minimise mean(q^2) }\n";
  };
  const std::string passes_1 = "if(T > 1, 5, 1)*k";
  for (const char* scheme : {"euler", "rk2"}) {
    expect_judged(text(scheme, passes_1, "T = min(T, 0.4)"), false);
    EXPECT_TRUE(gradient_of(text(scheme, passes_1, "T = min(T, 2)")).is_refused) << scheme;
  }
  expect_judged(text("euler", passes_1, "T = min(T, 0.9)"), false);
  // The stages of rk4 reach 1 in a step from 0.5, and each step ends at 1, which the event reads.
  expect_judged(text("rk4", "k", "q = q + if(T > 0.85, 1, 0)*k, T = 0.5"), false);
}

}  // namespace
}  // namespace dpde::testing
