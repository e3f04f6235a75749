// SPDX-License-Identifier: Apache-2.0
// What a scheme says of single fields and of the parts of a step, and what it cannot say.
#include <gtest/gtest.h>

#include "model/model_support.h"
#include "model/print/print_model.h"

namespace dpde::model {
namespace {

std::string smoke(const std::string& rows, const std::string& more = "") {
  return "model m {\n  vector u on faces\n  field p, q\n  param k\n"
         "  dt(q) = -advect(u, q) + 1\n  dt(u) = -advect(u, u) - grad(p) + k*lap(u)\n  0 = div(u) gives p\n}\n"
         "scheme f { time = euler; " +
         rows +
         " }\nscene s : m with f {\n  grid x = 0 .. 1, cells 8, periodic\n  grid y = 0 .. 1, cells 8, periodic\n"
         "  k = 0.1\n  initial u = 0\n  initial q = 0\n  time 0 .. 1, step 1/8\n" +
         more + "}\n";
}

std::string refused(const std::string& rows, const std::string& more = "") { return refusal_of(smoke(rows, more)); }

TEST(Transports, AreChosenFieldByField) {
  EXPECT_EQ(refused("advect = semi_lagrangian; advect q = maccormack"), "");
  EXPECT_EQ(refused("advect u = upwind(3); advect q = semi_lagrangian(3)"), "");
  const Problem problem = problem_of(smoke("advect = semi_lagrangian; advect u = maccormack(steady)"));
  EXPECT_EQ(
      print(problem.scheme),
      "scheme f { advect = semi_lagrangian; advect u.x = maccormack(steady); advect u.y = maccormack(steady); dx = "
      "central(2); lap = central(2); time = euler }\n");
}

TEST(Split, TakesEachTermOnce) {
  EXPECT_EQ(refused("advect = semi_lagrangian; split = lie(advect, sources, diffusion)"), "");
  EXPECT_EQ(refused("split = strang(diffusion, sources(q), advect)"), "");
  EXPECT_EQ(refused("split = lie(advect(u), sources, advect(q), diffusion)"), "");
  const Problem problem = problem_of(smoke("split = strang(advect, sources(q), diffusion)"));
  EXPECT_EQ(print(problem.scheme),
            "scheme f { advect = central(2); dx = central(2); lap = central(2); split = strang(advect, sources(q), "
            "diffusion); time = euler }\n");
}

TEST(Split, GoesWithTimeSchemesOfOneStep) {
  const std::string split = "split = lie(advect, sources, diffusion); ";
  for (const char* time : {"euler", "rk2", "rk4", "ssp_rk3", "imex_euler", "ars222"})
    EXPECT_EQ(refusal_of(smoke(split), {{"time", time}}), "") << time;
  for (const char* time : {"imex_euler", "crank_nicolson"}) {
    EXPECT_EQ(refusal_of(smoke(split + "advect = semi_lagrangian"), {{"time", time}}), "") << time;
  }
}

}  // namespace
}  // namespace dpde::model
