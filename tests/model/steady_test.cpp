// SPDX-License-Identifier: Apache-2.0
// What a run until steady goes with, and how well solves are done: what the text says, and what is refused.
#include "model/model_support.h"

namespace dpde::model {
namespace {

std::string steady_task(const std::string& equation, const std::string& scene, const std::string& task) {
  return "model m { field u; param k; " + equation + " }\nscene s : m {\n  grid x = 0 .. 1, cells 8\n  k = 1\n" +
         "  boundary u = 0\n  initial u = sin(x)\n  " + scene + "\n}\ntask t : s { unknown k; " + task + " }\n";
}

const std::string conducting = "dt(u) = k*lap(u)", until = "time 0 .. 1, step 1/8, until steady 1e-6",
                  of_end = "minimise mean(u)";

TEST(UntilSteady, IsRead) {
  Selection selection;
  selection.name = "t";
  for (const std::string scene : {until, until + "\n  after step: u = max(u, 0)"})
    EXPECT_EQ(problem_of(steady_task(conducting, scene, of_end), selection).steady, 1e-6);
}

/// Transforms by factors that are the same at all times are none of what depends on time.
TEST(UntilSteady, IsReadWithProgramsOfNoTime) {
  Selection selection;
  selection.name = "find";
  const Outcome outcome = outcome_of(
      "kernel move(v: field, out w: field) { w = v }\n"
      "program p { axes x periodic; transform u by k*ikx^2 to v; run move; swap u, w }\n"
      "scene s : p { grid x = 0 .. 1, cells 8, periodic\n k = 1; initial u = x\n "
      "time 0 .. 1, step 1/8, until steady 1e-6 }\n"
      "task find : s { unknown k; minimise mean(u) }\n",
      selection);
  EXPECT_TRUE(outcome.problem) << outcome.diagnostics.front().message;
}

TEST(SolveBy, IsAMethodWithATolerance) {
  const std::string text =
      "model m { field u; solve lap(p) = u for p; dt(u) = p }\nscene s : m {\n  grid x = 0 .. 1, cells 8\n"
      "  boundary u = 0; boundary p = 0\n  initial u = sin(x)\n  time 0 .. 1, step 1/8\n}\nscheme c { solve = ";
  const auto by = [&](const std::string& value) { return problem_of(text + value + " }\n").scheme.solve; };
  for (int i = 0; i <= static_cast<int>(SolveMethod::gmres); ++i) {
    const SolveMethod method = static_cast<SolveMethod>(i);
    EXPECT_EQ(by(std::string(name_of(method))), SolveBy{method});
  }
  EXPECT_EQ(by("gmres(1e-6)"), (SolveBy{SolveMethod::gmres, 1e-6}));
  EXPECT_EQ(by("multigrid(1e-9, 50)"), (SolveBy{SolveMethod::multigrid, 1e-9, 50}));
  EXPECT_EQ(by("automatic(1e-9, 50, warn)"), (SolveBy{SolveMethod::automatic, 1e-9, 50, true}));
  const SolveBy smoothed{SolveMethod::cg, 1e-6, SolveBy{}.most_iterations, false, Smoother::chebyshev};
  EXPECT_EQ(by("cg(1e-6); smoother = chebyshev"), smoothed);
  EXPECT_EQ(by("cg; smoother = chebyshev; real = f64").smoother, Smoother::chebyshev);
}

}  // namespace
}  // namespace dpde::model
