// SPDX-License-Identifier: Apache-2.0
// Axes that run down: what a scene on one becomes, and what does not go with them.
#include "model/model_support.h"

namespace dpde::model {
namespace {

std::string scene(const std::string& grid, const std::string& boundary, const std::string& rate = "-c*dx(dx(v))") {
  return "network two(a) {\n  padding replicate\n  initial he, seed 7\n  conv 1, 3\n}\n"
         "model m { field v on faces.x; param c; dt(v) = " +
         rate + " }\nscene s : m {\n  grid x = " + grid + "\n  c = 1\n  boundary v: " + boundary +
         "\n  initial v = x^2\n  time 0 .. 1, step 1/8\n}\n";
}

TEST(FallingAxes, AreAChangeOfCoordinates) {
  const Outcome outcome = outcome_of(R"(
model m { field v on faces.x; field w; param c; dt(v) = c*dx(w*dx(v)) + advect(v, v); dt(w) = dx(v)/2 - c*dx(v) }
scene s : m {
  grid x = 3 .. -1, cells 8
  c = 2
  boundary v: x.low = outflow, x.high = t
  boundary w: x.low = 0, x.high = gradient(x)
  initial v = x^2
  initial w = 1
  time 0 .. 1, step 1/8
}
)");
  ASSERT_TRUE(outcome.problem);
  const std::string text = print(*outcome.problem);
  for (const char* line :
       {"grid x = -1 .. 3, cells 8  # the place is 2 - x\n", "dt(v) = c*dx(w*dx(v)) + advect(-v, v)\n",
        "dt(w) = c*dx(v) - dx(v)/2\n", "boundary v: x.low = t, x.high outflow\n",
        "boundary w: x.low = gradient(2 - x), x.high = 0\n", "initial v = (2 - x)^2\n"})
    EXPECT_NE(text.find(line), std::string::npos) << line << "\n" << text;
}

TEST(FallingAxes, EndWhereTheFlowLeaves) {
  EXPECT_EQ(refusal_of(scene("0 .. 2, cells 8", "x.low = 0, x.high = outflow")), "");
  EXPECT_EQ(refusal_of(scene("2 .. 0, cells 8", "x.low = outflow, x.high = 0")), "");
  EXPECT_EQ(refusal_of(scene("0 .. 2, cells 8", "x.low = outflow, x.high = 0")),
            "outflow cannot appear in x.low, where the axis begins: E0311 let the axis end there: grid x = 2 .. 0; "
            "arrays then begin with the cell at the other end, formulas stay");
  EXPECT_EQ(refusal_of(scene("2 .. 0, cells 8", "x.low = 0, x.high = outflow")),
            "outflow cannot appear in x.high, where the axis begins: E0311 let the axis end there: grid x = 0 .. 2; "
            "arrays then begin with the cell at the other end, formulas stay");
  EXPECT_EQ(refusal_of(scene("2 .. 0, cells 8", "x = outflow")),
            "outflow cannot appear in x.high, where the axis begins: E0311 one end of x can be open: give v a value at "
            "the other");
}

TEST(FallingAxes, SayWhatDoesNotGoWithThem) {
  EXPECT_EQ(refusal_of(scene("1 .. 0, cells 8, stretched x^2", "x = 0")),
            "an axis that runs down cannot appear in a grid line with stretched: E0311 let it run up, or leave "
            "stretched out");
  EXPECT_EQ(refusal_of(scene("1 .. 0, cells 8", "x = 0", "dx(two(dx(v)))")),
            "the network two cannot appear in a scene whose x runs down: E0311 its weights know neighbours by the "
            "order of the cells, which is turned round here");
  EXPECT_EQ(refusal_of(scene("1 .. 1, cells 8", "x = 0")), "the axis begins and ends at 1: E0407 ");
}

}  // namespace
}  // namespace dpde::model
