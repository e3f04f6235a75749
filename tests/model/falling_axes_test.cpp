// SPDX-License-Identifier: Apache-2.0
// Axes that run down: what a scene on one becomes, and what does not go with them.
#include "model/model_support.h"

namespace dpde::model {
namespace {

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

}  // namespace
}  // namespace dpde::model
