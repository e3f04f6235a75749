// SPDX-License-Identifier: Apache-2.0
// Names in the text that equal the compiler's own names: t1 of a common subexpression, c_bar of an adjoint. They do not
// change gradients.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "driver_support.h"
#include "support/scene_run.h"

namespace dpde::testing {
namespace {

/// `text` with each `@` replaced.
std::string called(std::string text, const std::string& name) {
  for (std::size_t at = text.find('@'); at != std::string::npos; at = text.find('@')) text.replace(at, 1, name);
  return text;
}

/// The loss with `value` instead of 0.7 in the text.
double loss_at(std::string text, double value) {
  text.replace(text.find("= 0.7"), 5, "= " + std::to_string(value));
  return task_gradient(text, "t").loss;
}

/// The gradient, summed over its cells, against central differences over runs with other values of the unknown.
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
    expect_right(
        called("model m { field u, v; param @" + reaction + "}\ntask t : s { unknown @; minimise mean(v^2) }", name),
        name);
  }
}

TEST(Names, ACoefficientFieldMayBeCalledAsALet) {
  for (const std::string name : {"tau", "t1", "t2", "hx2"}) {
    expect_right(
        called("model m { field u, v; coefficient @" + reaction + "}\ntask t : s { unknown @; minimise mean(v^2) }",
               name),
        name);
  }
}

/// A let of a kernel has the name of a parameter's adjoint, or of a field's tangent.
TEST(Names, ALetMayBeCalledAsADerivative) {
  for (const std::string name : {"k", "c_bar", "u_bar", "v_bar", "c_dot", "u_dot", "loss_bar", "t1"}) {
    const std::string text = called(R"(kernel decay(u: field, out v: field, c, dt: param) {
  let @ = exp(-c*u)
  v = u - dt*c*u*@*(1 + @)
}
program p { run decay; swap u, v }
scene s : p {
  grid x = 0 .. 1, cells 8, periodic
  c = 0.7
  initial u = 1 + 0.3*sin(2*pi*x)
  time 0 .. 0.5, step 0.05
}
task t : s { unknown c; minimise mean(u^2) }
)",
                                    name);
    expect_right(text, "c");
    expect_certified(text, true);
  }
}

/// The programs of a scene are called s_step, s_initial, t_loss_1; the text may use these names, too.
TEST(Names, ProgramsAndKernelsMayBeCalledAsThoseOfAScene) {
  for (const std::string name :
       {"decay", "s_step", "s_initial", "s_coefficients", "t_loss_1", "s_step_adjoint", "t_start"}) {
    expect_right(called(R"(kernel @(u: field, out v: field, c, dt: param) { v = u - dt*c*u^2 }
program @ { run @; swap u, v }
scene s : @ {
  grid x = 0 .. 1, cells 8, periodic
  c = 0.7
  initial u = 1 + 0.3*sin(2*pi*x)
  time 0 .. 0.5, step 0.05
}
task t : s { unknown c; minimise mean(u^2) }
)",
                        name),
                 "c");
  }
}

/// Names of stored states of schemes, and of their stage fields.
TEST(Names, ParametersMayBeCalledAsFieldsOfASchemeAre) {
  const std::map<std::string, std::vector<std::string>> names{
      {"ab2", {"u_rate", "u_rate_now", "u_next"}}, {"leapfrog", {"u_old"}}, {"rk4", {"u_1", "u_2"}}};
  for (const auto& [scheme, likely] : names) {
    for (const std::string& name : likely) {
      expect_right(called("model m { field u; param @; dt(u) = -@*u }\nscheme q { time = " + scheme + R"( }
scene s : m with q {
  grid x = 0 .. 1, cells 4, periodic
  @ = 0.7
  initial u = 1 + 0.3*sin(2*pi*x)
  time 0 .. 0.5, step 0.05
}
task t : s { unknown @; minimise mean(u^2) }
)",
                          name),
                   name);
    }
  }
}

/// Terms are added in the order of the model, not in that of the names.
TEST(Names, TheirOrderChangesNoBit) {
  const auto gradient_of_v = [](const std::string& u, const std::string& v) {
    std::string text = R"(
model m {
  field U, V
  vector c
  dt(U) = -advect(c, U) - U*(1 - (V + 1.5)^2)
  dt(V) = -advect(c, V) + 1.48*V*(1 - c.x^2)
  dt(c) = -advect(c, c)
}
scheme q { time = euler; advect = upwind(3) }
scene s : m with q {
  grid x = 0 .. 4.16, cells 3
  grid y = 0 .. 5.17, cells 4, periodic
  boundary U: x = zero_gradient
  boundary V: x = zero_gradient
  boundary c: x = zero_gradient
  initial U = 0.74 + 0.31*cos(y + 0.794)
  initial V = 1.07 + 0.31*cos(x + 1.29)
  initial c = (1.07 + 0.31*exp(-(y - 1.25)^2), 0.72)
  at t = 0.02: c.y = 0.848*c.y
  time 0 .. 0.06, step 0.02
}
task t : s { unknown initial V; minimise mean((U*V - exp(-x))^2) })";
    for (std::size_t at = 0; (at = text.find_first_of("UV", at)) != std::string::npos;)
      text.replace(at, 1, text[at] == 'U' ? u : v);
    return task_gradient(text, "t").gradient.at(v);
  };
  EXPECT_EQ(gradient_of_v("a", "b"), gradient_of_v("b", "a"));
}

/// A program of the text with the name of a generated one replaces it, as needed for emitted text. If the two differ,
/// this is reported.
TEST(Names, AProgramInPlaceOfOneThatTheSceneMakesIsTold) {
  const auto told = [](const std::string& loss, const std::string& initial) {
    const std::string text = R"(kernel go(u: field, out u_next: field, k, dt: param) { u_next = u*(1 - k*dt) }
program go { axes x periodic; run go; swap u, u_next }
kernel t_loss_1(u: field, sum loss: param, cells: param) { loss += )" +
                             loss + R"( }
program t_loss_1 { axes x periodic; run t_loss_1 }
kernel s_initial(out u: field) { u = )" +
                             initial + R"( }
program s_initial { axes x periodic; run s_initial; keep u }
scene s : go { grid x = 0 .. 1, cells 8, periodic; k = 2; initial u = 1; time 0 .. 1, step 1/8 }
task t : s { unknown k from 1; minimise mean(u^2); using lbfgs() }
)";
    driver::CompileOptions options;
    options.selection.name = "t";
    DiagnosticSink sink;
    driver::compile(SourceFile("t.dpde", text), options, sink);
    std::string all;
    for (const Diagnostic& d : sink.all()) {
      all +=
          std::string(d.kind->code) + " " +
          text.substr(static_cast<std::size_t>(d.range.begin), static_cast<std::size_t>(d.range.end - d.range.begin)) +
          "; ";
    }
    return all;
  };
  EXPECT_EQ(told("u^2/cells", "1"), "");
  EXPECT_EQ(told("5*u/cells", "1"), "W0503 t_loss_1; ");
  EXPECT_EQ(told("u^2/cells", "2"), "W0503 s_initial; ");
}

}  // namespace
}  // namespace dpde::testing
