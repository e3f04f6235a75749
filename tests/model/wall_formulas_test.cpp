// SPDX-License-Identifier: Apache-2.0
// Formulas of fields at walls: where they may stand, and what is said elsewhere. Hints of what lies at other places.
#include "model/model_support.h"

namespace dpde::model {
namespace {

/// Of a field q at centres, r on the faces across x, a vector w on faces; `of_q` and `of_r` are their boundaries at x.
std::string walled(const std::string& of_q, const std::string& of_r = "0", const std::string& scheme = "time = rk4",
                   const std::string& grid = "0 .. 1") {
  return "model m { field q; field r on faces.x; vector w on faces; coefficient c\n  dt(q) = lap(q); dt(r) = lap(r)\n"
         "  dt(w) = lap(w) }\nscheme k { " +
         scheme + " }\nscene s : m with k {\n  grid x = " + grid +
         ", cells 8\n  grid y = 0 .. 1, cells 8, periodic\n  c = 1\n  initial q = 0\n  initial r = 0\n  initial w = 0\n"
         "  time 0 .. 1, step 1/1024\n  boundary q: x.low = 0, x.high = " +
         of_q + "\n  boundary r: x.low = 0, x.high = " + of_r + "\n  boundary w: x.low = 0, x.high = (0, 0)\n}\n";
}

TEST(WallFormulas, AreMadeOfFieldsThere) {
  const Problem p = problem_of(walled("gradient(c*t - q^4 + r)"));
  EXPECT_EQ(print(p.states[0].boundary[0].high.value), "c*t - q^4 + r");
  EXPECT_EQ(message(walled("mixed(1, 2, q*w.x)")), "0 diagnostics:");
}

TEST(OneAxis, NumbersAndVectorsAreTheSame) {
  const std::string text =
      "model m { field p; vector D; param k; dt(p) = k - D*grad(p); dt(D) = 0 }\nscene s : m {\n"
      "  grid x = 0 .. 1, cells 4, periodic\n  k = 2\n  initial p = 0\n  initial D = 1\n  time 0 .. 1, step 1/8\n}\n";
  EXPECT_EQ(print(*problem_of(text).states[0].rhs), "k - D.x*dx(p)");
}

}  // namespace
}  // namespace dpde::model
