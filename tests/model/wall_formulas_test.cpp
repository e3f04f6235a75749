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

TEST(WallFormulas, ThatCannotBeHadAreRefused) {
  EXPECT_EQ(message(walled("0", "gradient(q)")),
            "a formula of fields cannot appear in the boundary of r, which lies on faces | formulas of fields hold for "
            "fields at cell centres");
  EXPECT_EQ(message(walled("w.y")),
            "a formula of fields cannot appear in the boundary at x.high, where w.y is not known | it takes fields at "
            "cell centres and those on faces across x");
  EXPECT_EQ(message(walled("r", "gradient(1)")),
            "a formula of fields cannot appear in the boundary at x.high, where r follows from its slope | give r a "
            "value there, or outflow");
  EXPECT_EQ(
      message(walled("r", "0", "time = rk4", "1 .. 0")),
      "a formula of fields cannot appear in the boundary at x.high, where the arrays of r hold no value | let the "
      "axis end there: grid x = 0 .. 1");
  EXPECT_EQ(message(walled("gradient(-q)", "0", "time = ars222")),
            "time = ars222 does not go with a formula of fields at a wall | take time = rk4 or ssp_rk3");
  EXPECT_EQ(message(walled("gradient(-q)", "0", "time = euler; split = lie(diffusion)")),
            "a formula of fields cannot appear in the boundary of a scene whose steps are split | leave out split");
  EXPECT_EQ(message(walled("mixed(q, 1, 0)")),
            "field q cannot appear in a weight of mixed | in mixed(a, b, c), a*u + b*du/dn = c, c may vary along the "
            "wall; a and b are made of numbers, parameters and t");
}

TEST(WallFormulas, OfWhatIsSolvedForAreRefused) {
  EXPECT_EQ(
      message("model m { field q; solve lap(p) = q for p; dt(q) = p }\nscene s : m {\n  grid x = 0 .. 1, cells 8\n"
              "  initial q = 0\n  time 0 .. 1, step 1/8\n  boundary q = 0\n  boundary p = q\n}\n"),
      "a formula of fields at a wall cannot appear in the boundary of p | give it a value or a slope of numbers, "
      "parameters, coordinates, t and coefficients");
}

TEST(Hints, OfVectorsThatBelongOnEdges) {
  const auto said = [](const std::string& e, const std::string& b) {
    const Outcome outcome =
        outcome_of("model m { vector E " + e + "; vector B " + b +
                   "; dt(E) = curl(B); dt(B) = -curl(E) }\nscene s : m {\n  grid x = 0 .. 1, cells 4, periodic\n"
                   "  grid y = 0 .. 1, cells 4, periodic\n  grid z = 0 .. 1, cells 4, periodic\n  initial E = 0\n"
                   "  initial B = 0\n  time 0 .. 1, step 1/8\n}\n");
    if (outcome.diagnostics.empty()) return std::string();
    const Diagnostic& last = outcome.diagnostics.back();
    return last.message + " | " + last.hint;
  };
  EXPECT_EQ(said("on edges", "on faces"), "");
  EXPECT_EQ(said("on edges", ""),
            "E.y is at edges along y, but here its value at faces across x is wanted | write interpolate(E.y)");
  EXPECT_EQ(
      said("", "on faces"),
      "E.y is at cell centres, but here its value at edges along y is wanted | write interpolate(E.y), or declare "
      "vector E on edges where all of it is wanted there");
}

TEST(OneAxis, NumbersAndVectorsAreTheSame) {
  const std::string text =
      "model m { field p; vector D; param k; dt(p) = k - D*grad(p); dt(D) = 0 }\nscene s : m {\n"
      "  grid x = 0 .. 1, cells 4, periodic\n  k = 2\n  initial p = 0\n  initial D = 1\n  time 0 .. 1, step 1/8\n}\n";
  EXPECT_EQ(print(*problem_of(text).states[0].rhs), "k - D.x*dx(p)");
}

}  // namespace
}  // namespace dpde::model
