// SPDX-License-Identifier: Apache-2.0
// Names of a person that are those the compiler makes up: t1 of a common subexpression, c_bar of an adjoint. They change no gradient.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "support/scene_run.h"

namespace dpde::testing {
namespace {

/// `text` with each `@` replaced.
std::string called(std::string text, const std::string& name) {
  for (std::size_t at = text.find('@'); at != std::string::npos; at = text.find('@')) text.replace(at, 1, name);
  return text;
}

/// The loss where 0.7 in the text is `value`.
double loss_at(std::string text, double value) {
  text.replace(text.find("= 0.7"), 5, "= " + std::to_string(value));
  return task_gradient(text, "t").loss;
}

/// The gradient, summed over its cells, against central differences of runs with another value of the unknown.
void expect_right(const std::string& text, const std::string& unknown) {
  SCOPED_TRACE(text);
  double slope = 0;
  const TaskResult result = task_gradient(text, "t");
  for (const double value : result.gradient.at(unknown)) slope += value;
  const double h = 1e-3, difference = (loss_at(text, 0.7 + h) - loss_at(text, 0.7 - h)) / (2 * h);
  EXPECT_GT(std::abs(difference), 1e-2);
  EXPECT_NEAR(slope, difference, 1e-6);
}

/// The terms of v share subexpressions, which become the lets t1, t2, ...
const std::string reaction = R"(
  dt(u) = -@*u
  dt(v) = -u*v*exp(-(u*v)^2)*(1 + sin(u*v*exp(-(u*v)^2)))
}
scheme q { time = euler }
scene s : m with q {
  grid x = 0 .. 1, cells 16, periodic
  @ = 0.7
  initial u = 1 + 0.3*sin(2*pi*x)
  initial v = 0.8 + 0.2*cos(2*pi*x)
  time 0 .. 0.5, step 0.05
  subcycle v in 2
)";

TEST(Names, AParameterMayBeCalledAsALet) {
  for (const std::string name : {"tau", "t1", "t2", "bar", "u_next", "shared"}) {
    expect_right(called("model m { field u, v; param @" + reaction + "}\ntask t : s { unknown @; minimise mean(v^2) }", name), name);
  }
}

TEST(Names, ACoefficientFieldMayBeCalledAsALet) {
  for (const std::string name : {"tau", "t1", "t2", "hx2"}) {
    expect_right(called("model m { field u, v; coefficient @" + reaction + "}\ntask t : s { unknown @; minimise mean(v^2) }", name), name);
  }
}

}  // namespace
}  // namespace dpde::testing
