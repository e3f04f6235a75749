// SPDX-License-Identifier: Apache-2.0
// What a run until steady goes with, and how well solves are done: what the text says, and what is refused.
#include "model/model_support.h"

namespace dpde::model {
namespace {

std::string steady_task(const std::string& equation, const std::string& scene, const std::string& task) {
  return "model m { field u; param k; " + equation + " }\nscene s : m {\n  grid x = 0 .. 1, cells 8\n  k = 1\n" +
         "  boundary u = 0\n  initial u = sin(x)\n  " + scene + "\n}\ntask t : s { unknown k; " + task + " }\n";
}

std::string said_of(const std::string& equation, const std::string& scene, const std::string& task) {
  Selection selection;
  selection.name = "t";
  const Outcome outcome = outcome_of(steady_task(equation, scene, task), selection);
  return outcome.problem ? "" : outcome.diagnostics.front().message;
}

const std::string conducting = "dt(u) = k*lap(u)", until = "time 0 .. 1, step 1/8, until steady 1e-6",
                  of_end = "minimise mean(u)";

TEST(UntilSteady, IsRead) {
  Selection selection;
  selection.name = "t";
  EXPECT_EQ(problem_of(steady_task(conducting, until, of_end), selection).steady, 1e-6);
}

TEST(UntilSteady, RefusesWhatItsGradientDoesNotKnow) {
  EXPECT_NE(said_of(conducting, until, "minimise mean(u) at t = 0.5").find("a loss at given times"), std::string::npos);
  EXPECT_NE(said_of(conducting, until, "minimise mean(u) over time").find("a loss at given times"), std::string::npos);
  EXPECT_NE(said_of(conducting, until, "unknown initial u; " + of_end).find("initial state"), std::string::npos);
  EXPECT_NE(said_of(conducting + " + sin(t)", until, of_end).find("depends on time"), std::string::npos);
  EXPECT_NE(said_of(conducting, until + "\n  every 0.5: u = 0", of_end).find("depends on time"), std::string::npos);
  EXPECT_NE(said_of(conducting, until + ", tolerance 1e-6", of_end + " }\nscheme c { time = bs32").find("tolerance"),
            std::string::npos);
  EXPECT_EQ(said_of(conducting, until + "\n  after step: u = max(u, 0)", of_end), "");
  const std::string of_nothing = said_of(conducting, "time 0 .. 1, step 1/8, until steady 0", of_end);
  EXPECT_NE(of_nothing.find("must be positive"), std::string::npos);
}

/// Whatever line of a program takes the time.
TEST(UntilSteady, RefusesProgramsThatDependOnTime) {
  const auto said = [](const std::string& line) {
    Selection selection;
    selection.name = "find";
    const Outcome outcome = outcome_of(
        "kernel grow(u: field, out v: field, k: param) { v = k*u }\n"
        "kernel drive(u: field, out v: field, k, t: param) { v = k*u + t }\n"
        "program p { axes x periodic; " +
            line +
            "; swap u, v }\n"
            "scene s : p { grid x = 0 .. 1, cells 8, periodic\n k = 1; initial u = x\n "
            "time 0 .. 1, step 1/8, until steady 1e-6 }\n"
            "task find : s { unknown k; minimise mean(u) }\n",
        selection);
    return outcome.problem ? "" : outcome.diagnostics.front().message;
  };
  EXPECT_EQ(said("run grow"), "");
  EXPECT_NE(said("run drive").find("depends on time"), std::string::npos);
  EXPECT_EQ(said("transform u by k*ikx^2 to v"), "");
  EXPECT_NE(said("transform u by k*t*ikx^2 to v").find("depends on time"), std::string::npos);
  EXPECT_NE(said("transform u by phi1(k*t*ikx^2)*k to v").find("depends on time"), std::string::npos);
}

TEST(SolveBy, IsAMethodWithATolerance) {
  const std::string text =
      "model m { field u; solve lap(p) = u for p; dt(u) = p }\nscene s : m {\n  grid x = 0 .. 1, cells 8\n"
      "  boundary u = 0; boundary p = 0\n  initial u = sin(x)\n  time 0 .. 1, step 1/8\n}\nscheme c { solve = ";
  const auto by = [&](const std::string& value) { return problem_of(text + value + " }\n").scheme.solve; };
  EXPECT_EQ(by("cg"), (SolveBy{SolveMethod::cg}));
  EXPECT_EQ(by("gmres(1e-6)"), (SolveBy{SolveMethod::gmres, 1e-6}));
  EXPECT_EQ(by("multigrid(1e-9, 50)"), (SolveBy{SolveMethod::multigrid, 1e-9, 50}));
  EXPECT_EQ(by("automatic(1e-9, 50, warn)"), (SolveBy{SolveMethod::automatic, 1e-9, 50, true}));
  const SolveBy smoothed{SolveMethod::cg, 1e-6, SolveBy{}.most_iterations, false, Smoother::chebyshev};
  EXPECT_EQ(by("cg(1e-6); smoother = chebyshev"), smoothed);
  EXPECT_EQ(by("cg; smoother = chebyshev; real = f64").smoother, Smoother::chebyshev);
  EXPECT_NE(refusal_of(text + "cg; smoother = gauss }\n").find("red_black, jacobi, chebyshev"), std::string::npos);
  for (const char* wrong : {"cg(2)", "cg(1e-9, 0.5)", "cg(1e-9, 50, never)", "gauss(1e-9)", "cg(1e-9, 50, warn, 1)"})
    EXPECT_NE(refusal_of(text + wrong + " }\n").find("cg(1e-12, 200, warn)"), std::string::npos) << wrong;
}

}  // namespace
}  // namespace dpde::model
