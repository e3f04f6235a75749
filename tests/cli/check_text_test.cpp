// SPDX-License-Identifier: Apache-2.0
// What `dpde check` prints: what decides, or all of it; what tasks of a scene share is printed once.
#include <algorithm>
#include <filesystem>

#include "command_support.h"
#include "support/setting.h"

namespace dpde::testing {
namespace {

class CheckText : public Command {
 protected:
  void SetUp() override {
    Command::SetUp();
    write("s.dpde",
          "model m { field u, v; param k = 1e-4; dt(u) = -advect(1, u) + k*lap(u); dt(v) = -advect(2, v) + k*lap(v) }\n"
          "scheme c { advect = central(2) }\n"
          "scene s : m with c { grid x = 0 .. 1, cells 16, periodic; initial u = sin(2*pi*x); "
          "initial v = cos(2*pi*x); time 0 .. 1, step 1/64 }\n"
          "task by_u : s { unknown k; minimise mean(u^2) }\n"
          "task by_v : s { unknown k; minimise mean(v^2) }\n");
  }
  static std::size_t lines_with(const std::string& text, const std::string& words) {
    std::size_t count = 0;
    for (std::size_t at = text.find(words); at != std::string::npos; at = text.find(words, at + 1)) ++count;
    return count;
  }
};

TEST_F(CheckText, WhatTasksShareIsPrintedOnce) {
  const Outcome outcome = dpde("check s.dpde");
  EXPECT_EQ(outcome.status, 0);
  for (const char* words : {"scene s: x = 0 .. 1", "order: 2 in space", "stability: ", "more with --all: "})
    EXPECT_EQ(lines_with(outcome.out, words), 1U) << words << "\n" << outcome.out;
  for (const char* words : {"---- task by_u\n", "---- task by_v\nscene s: as above"})
    EXPECT_EQ(lines_with(outcome.out, words), 1U) << words << "\n" << outcome.out;
  EXPECT_EQ(lines_with(outcome.out, "unused "), 1U) << "their number\n" << outcome.out;
}

/// The first is the one with the largest number.
TEST_F(CheckText, AKindOfWarningIsPrintedOnceWithItsWorstPlace) {
  const Outcome outcome = dpde("check s.dpde");
  EXPECT_EQ(lines_with(outcome.err, "warning[W0804]"), 1U) << outcome.err;
  EXPECT_EQ(lines_with(outcome.err, "number of v is"), 1U) << outcome.err;
  EXPECT_EQ(lines_with(outcome.err, "note: 1 more of W0804 (line 1): --all shows it\n"), 1U) << outcome.err;
}

TEST_F(CheckText, AllIsThereOnRequest) {
  const Outcome all = dpde("check s.dpde --all");
  EXPECT_EQ(lines_with(all.err, "warning[W0804]"), 2U) << "of two fields\n" << all.err;
  for (const char* words : {"  u: state\n", "unused ", "cell Peclet number of u along x", "conserved: "})
    EXPECT_GE(lines_with(all.out, words), 1U) << words << "\n" << all.out;
  EXPECT_EQ(lines_with(all.out, "more with --all"), 0U);
}

TEST_F(CheckText, GrowthThatARunShowsIsSaid) {
  write("g.dpde",
        "model m { field u; param q = 1; dt(u) = q*u + 1e-3*lap(u) }\n"
        "scene s : m { grid x = 0 .. 1, cells 16, periodic; initial u = 1; time 0 .. 1/2, step 1/64 }\n");
  const std::string words = "the equations themselves let waves grow, at most by a factor of e in ";
  EXPECT_EQ(lines_with(dpde("check g.dpde").out, words), 0U);
  EXPECT_EQ(lines_with(dpde("check g.dpde --all").out, words), 1U);
  EXPECT_EQ(lines_with(dpde("check g.dpde --set q=8").out, words), 1U);
}

TEST_F(CheckText, MistakesOfTheSceneThatDataAreFromAreThoseOfTheTask) {
  write("d.dpde",
        "model m { field u in K; param k = 1 in 1/s; dt(u) = -k*u }\n"
        "scene s : m { grid x = 0 .. 1 in m, cells 4, periodic; initial u = 1; time 0 .. 1 in s, step 1/8 }\n"
        "scene w = s { let length = 2 in m; k = 1/length }\n"
        "task t : s { data seen = u from scene w at t = 1; unknown k; minimise mean((u - seen)^2) at t = 1 }\n");
  EXPECT_EQ(dpde("check d.dpde w --json").codes(), std::vector<std::string>{"E0341"});
  EXPECT_EQ(dpde("check d.dpde t --json").codes(), std::vector<std::string>{"E0341"});
}

TEST_F(CheckText, JsonHasAllInAnyCase) {
  const Json brief = dpde("check s.dpde --json").json(), all = dpde("check s.dpde --json --all").json();
  EXPECT_EQ(brief["diagnostics"].size(), 2U);
  EXPECT_EQ(brief["diagnostics"], all["diagnostics"]);
}

TEST_F(CheckText, OfExamplesFitsAScreen) {
  if (!is_thorough()) GTEST_SKIP() << "at night: minutes";
  for (const auto& entry : fs::recursive_directory_iterator(DPDE_SOURCE_DIR "/dsl-examples")) {
    if (entry.path().extension() != ".dpde") continue;
    const Outcome outcome = dpde("check " + entry.path().string());
    EXPECT_LE(std::ranges::count(outcome.out, '\n'), 40) << entry.path() << "\n" << outcome.out;
  }
}

}  // namespace
}  // namespace dpde::testing
