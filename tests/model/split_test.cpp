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
  EXPECT_EQ(refused("advect r = maccormack"), "r is not known here: E0301 known here: p, q, u, u.x, u.y");
  EXPECT_EQ(refused("advect q = maccormack; advect q = upwind(1)"), "the advect of q is given twice: E0303 ");
  EXPECT_EQ(refused("advect q = fast").find("advect cannot be fast: E0502 choose one of: central(2)"), 0u);
  EXPECT_EQ(refused("time q = euler"),
            "a field cannot appear in the row time: E0311 leave q out; only advect is chosen field by field");
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
  EXPECT_EQ(refused("split = lie(advect, diffusion)"),
            "split: the equation of q has sources, which no part takes: E0559 add sources, or sources(q)");
  EXPECT_EQ(refused("split = lie(advect, sources, sources(q), diffusion)"),
            "split: sources(q) is in it twice: E0559 each term is taken once: leave one of them out, or name the "
            "fields, as in sources(u)");
  EXPECT_EQ(refused("split = lie(advect, reaction, diffusion)"),
            "split: reaction is none of its parts: E0559 known here: advect, sources, diffusion");
  EXPECT_EQ(refused("split = lie(advect, source, diffusion)"),
            "split: source is none of its parts: E0559 did you mean sources?");
  EXPECT_EQ(refused("split = parts(advect, sources)"),
            "split cannot be parts(advect, sources): E0502 write split = lie(advect, sources, diffusion), or "
            "strang(...), in the order wanted");
  EXPECT_EQ(refused("split = lie(advect, sources(r), diffusion)"),
            "r is not known here: E0301 known here: p, q, u, u.x, u.y");
  const Problem problem = problem_of(smoke("split = strang(advect, sources(q), diffusion)"));
  EXPECT_EQ(print(problem.scheme),
            "scheme f { advect = central(2); dx = central(2); lap = central(2); split = strang(advect, sources(q), "
            "diffusion); time = euler }\n");
}

TEST(Split, SaysWhatItDoesNotGoWith) {
  const std::string split = "split = lie(advect, sources, diffusion); ";
  for (const char* time : {"euler", "rk2", "rk4", "ssp_rk3", "imex_euler", "ars222"})
    EXPECT_EQ(refusal_of(smoke(split), {{"time", time}}), "") << time;
  EXPECT_EQ(refusal_of(smoke(split), {{"time", "ab2"}}),
            "split: time = ab2 takes all terms at once: E0559 take time = rk2, rk4, ssp_rk3, euler or ars222");
  EXPECT_EQ(refusal_of(smoke(split), {{"time", "crank_nicolson"}}),
            "time = crank_nicolson does not go with an equation for u.x with more of the fields in it than is solved "
            "for: E0555 take time = ars222, which takes other terms explicitly");
  for (const char* time : {"imex_euler", "crank_nicolson"}) {
    EXPECT_EQ(refusal_of(smoke(split + "advect = semi_lagrangian"), {{"time", time}}), "") << time;
    EXPECT_EQ(refusal_of(smoke("advect = semi_lagrangian"), {{"time", time}}),
              "time = " + std::string(time) +
                  " does not go with advection along the flow in one step with other terms: E0555 write split = "
                  "lie(advect, sources, diffusion) in the scheme, or take advect = upwind(3)");
  }
  EXPECT_EQ(refusal_of("model m {\n  field u\n  dt(u) = lap(u) - u\n}\nscheme f { time = rk2; split = lie(diffusion, "
                       "sources) }\nscene s : m with f {\n  grid x = 0 .. 1, cells 8, periodic\n  initial u = 0\n"
                       "  subcycle u in 2\n  time 0 .. 1, step 1/8\n}\n"),
            "split: subcycles divide the step already: E0559 leave the subcycles out");
}

}  // namespace
}  // namespace dpde::model
