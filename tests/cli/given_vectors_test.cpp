// SPDX-License-Identifier: Apache-2.0
// Given adjoints of operators of vectors and of fields on faces and nodes: gradients equal the derived ones, wrong ones
// stop the command.
#include <algorithm>
#include <cmath>
#include <regex>

#include "command_support.h"
#include "support/setting.h"

namespace dpde::testing {
namespace {

/// A product of neighbours, both components in both results.
const std::string turn = R"(
operator turn(u, a) order 0 = (u.x + a*(u.y[+1, 0] - u.y[-1, 0]), u.y - a*(u.x[0, +1] - u.x[0, -1])*u.y)
  adjoint u_bar = (turn_bar.x + a*(u.y[0, +1]*turn_bar.y[0, +1] - u.y[0, -1]*turn_bar.y[0, -1]), a*(turn_bar.x[-1, 0] - turn_bar.x[+1, 0]) + turn_bar.y*(1 - a*(u.x[0, +1] - u.x[0, -1])))
  adjoint a_bar += turn_bar.x*(u.y[+1, 0] - u.y[-1, 0]) - turn_bar.y*(u.x[0, +1] - u.x[0, -1])*u.y
model m {
  vector u
  field q
  param a, nu
  dt(u) = turn(u, a) + nu*lap(u) - grad(q)
  dt(q) = -div(turn(q*u, 1/4)) + turn(u, a).y
}
scene s : m {
  grid x = 0 .. 1, cells 5
  grid y = 0 .. 1, cells 4
  boundary u: x.low = (0.1*y, 0), x.high = zero_gradient, y = gradient(0.2)
  boundary q: all = 0.3
  initial u = (sin(3*x)*y, x + y^2)
  initial q = x*y
  a = 0.2
  nu = 0.01
  time 0 .. 1/16, step 1/64
}
scheme midpoint { time = rk2 }
task t : s {
  unknown initial u
  unknown initial q
  unknown a
  minimise mean(dot(turn(u, a), turn(u, 1/8)) + q^2)
}
)";

/// With centres and faces, and the transposes of staggered differences.
const std::string water = R"(
operator slope(p) order 0 = grad(p)
  adjoint p_bar = -div(slope_bar)
operator outflow(u, d) order 0 = div(interpolate(d)*u)
  adjoint u_bar = -interpolate(d)*grad(outflow_bar)
  adjoint d_bar = -interpolate(u.x*dx(outflow_bar)) - interpolate(u.y*dy(outflow_bar))
operator drag(v, w, k) order 0 = k*v[+1, 0]*v + w*v[0, -1]
  adjoint v_bar = k*(v[+1, 0]*drag_bar + v[-1, 0]*drag_bar[-1, 0]) + w[0, +1]*drag_bar[0, +1]
  adjoint w_bar = v[0, -1]*drag_bar
  adjoint k_bar += v[+1, 0]*v*drag_bar
model m {
  vector u on faces
  field eta
  field n on nodes
  coefficient depth
  param g, k
  dt(eta) = -outflow(u, depth + eta)
  dt(u.x) = -g*slope(eta).x - drag(u.x, interpolate(u.y), k) + dy(n)
  dt(u.y) = -g*slope(eta^2).y - 0.1*u.y
  dt(n) = 0.1*drag(n, interpolate(eta), 0.3) + dx(u.y)
}
scene s : m {
  grid x = 0 .. 1, cells 5
  grid y = 0 .. 1, cells 4
  boundary u.x: all = 0
  boundary u.y: y = 0, x = zero_gradient
  boundary eta: all = zero_gradient
  boundary n: x = 0.1, y.low = zero_gradient, y.high = 0.2
  initial u = (sin(3*x)*y, x + y^2)
  initial eta = x*y
  initial n = x - y
  depth = 1 + 0.2*x
  g = 1
  k = 0.3
  time 0 .. 1/16, step 1/64
}
scheme midpoint { time = rk2 }
task t : s {
  unknown initial u
  unknown initial eta
  unknown initial n
  unknown depth
  unknown k
  minimise mean(eta^2) + mean(outflow(u, eta)^2) + 0.1*mean(n^2)
}
)";

std::vector<std::string> all_settings() {
  std::vector<std::string> all{"--set cells=1", "--set cells.x=1 --set cells.y=3"};
  if (is_thorough())
    all.insert(all.end(), {"", "--set cells.x=2 --set cells.y=1", "--set time=euler", "--backend cpp"});
  return all;
}

class GivenVectorCommand : public Command {
 protected:
  static std::string replaced(const std::string& text, const std::string& a, const std::string& b) {
    const std::string result = std::regex_replace(text, std::regex(a), b);
    EXPECT_NE(result, text) << a;
    return result;
  }
  static std::string derived(const std::string& text) {
    return std::regex_replace(text, std::regex("\n  adjoint [^\n]*"), "");
  }
  static std::string periodic(const std::string& text) {
    return replaced(replaced(text, "  boundary [^\n]*\n", ""), "cells (.)", "cells $1, periodic");
  }

  /// Loss and gradients: for fields norm and largest value.
  std::vector<double> numbers(const std::string& file, const std::string& more) {
    const Outcome outcome = dpde("gradient " + file + " --json --no-certify " + more);
    EXPECT_EQ(outcome.status, 0) << outcome.err << outcome.out;
    const Json json = outcome.json();
    std::vector<double> values{json.value("loss", NAN)};
    for (const Json& of_unknown : json["gradient"]) {
      for (const Json& number : of_unknown) values.push_back(number.is_number() ? number.get<double>() : NAN);
    }
    return values;
  }

  void expect_derived_gradients(const std::string& text, std::size_t least, const std::vector<std::string>& settings) {
    write("given.dpde", text);
    write("derived.dpde", derived(text));
    const std::string taken = dpde("emit given.dpde t --stage stencil").out;
    EXPECT_NE(taken.find("\n  adjoint "), std::string::npos);
    for (const std::string& more : settings) {
      const std::vector<double> a = numbers("given.dpde", more), b = numbers("derived.dpde", more);
      ASSERT_EQ(a.size(), b.size());
      ASSERT_GE(a.size(), least);
      for (std::size_t i = 0; i < a.size(); ++i)
        EXPECT_NEAR(a[i], b[i], 1e-13 * std::max(1.0, std::abs(b[i]))) << more << " " << i;
    }
    const Outcome outcome = dpde("verify given.dpde t --json");
    EXPECT_EQ(outcome.status, 0) << outcome.err << outcome.out;
    EXPECT_TRUE(outcome.json()["passed"].get<bool>());
  }
  std::vector<std::string> codes(const std::string& text, const std::string& verb = "run") {
    write("one.dpde", text);
    std::vector<std::string> told = dpde(verb + " one.dpde --set step=0.001 --set end=0.001 --json").codes();
    told.erase(std::unique(told.begin(), told.end()), told.end());  // once for each component that reads it
    return told;
  }
};

TEST_F(GivenVectorCommand, GradientsOfVectorsAreThoseThatAreDerived) {
  expect_derived_gradients(turn, 6, all_settings());
  expect_derived_gradients(periodic(turn), 6, {"", "--set cells=1"});
}

TEST_F(GivenVectorCommand, GradientsOfStaggeredFieldsAreThoseThatAreDerived) {
  expect_derived_gradients(water, 9, all_settings());
  expect_derived_gradients(periodic(water), 9, {"", "--set cells=1"});
}

/// Each line separately: the others are then derived.
TEST_F(GivenVectorCommand, AWrongOneStopsWhateverMakesAGradient) {
  const std::pair<std::string, std::string> mistakes[] = {
      {"1 - a\\*\\(u.x\\[0, \\+1\\]", "1 + a*(u.x[0, +1]"},
      {"turn_bar.y\\[0, -1\\]\\)", "turn_bar.x[0, -1])"},
      {"= -div\\(slope_bar", "= -2*div(slope_bar"},
      {"= -interpolate\\(d\\)\\*grad", "= -interpolate(d^2)*grad"},
      {"interpolate\\(u.y\\*dy\\(outflow_bar\\)\\)", "0.9*interpolate(u.y*dy(outflow_bar))"}};
  for (const auto& [right, wrong] : mistakes) {
    const std::string& text =
        right.find("u.x\\[") != std::string::npos || right.find("turn") != std::string::npos ? turn : water;
    write("wrong.dpde", replaced(text, right, wrong));
    for (const char* command : {"gradient wrong.dpde t --no-certify", "verify wrong.dpde t"}) {
      const Outcome outcome = dpde(std::string(command) + " --json");
      EXPECT_NE(outcome.status, 0) << wrong;
      const std::vector<std::string> codes = outcome.codes();
      const auto error = std::ranges::find_if(codes, [](const std::string& code) { return code.starts_with('E'); });
      ASSERT_NE(error, codes.end()) << wrong;
      EXPECT_EQ(*error, "E0606") << wrong << outcome.err;
    }
    EXPECT_EQ(dpde("run wrong.dpde s").status, 0) << "no gradient, no adjoint";
  }
}

TEST_F(GivenVectorCommand, AllComponentsShareAKernel) {
  write("turn.dpde", turn);
  const std::string text = dpde("emit turn.dpde s --stage stencil").out;
  EXPECT_NE(text.find("out turn.x: field, out turn.y: field"), std::string::npos) << text;
  write("water.dpde", water);
  const std::string faces = dpde("emit water.dpde s --stage stencil").out;
  EXPECT_NE(faces.find("adjoint eta_bar = "), std::string::npos) << faces;
  EXPECT_EQ(faces.find("out slope.y: field"), std::string::npos) << "the equation reads slope(eta).x alone\n" << faces;
}

TEST_F(GivenVectorCommand, SaysWhatDoesNotFit) {
  const std::string rest =
      "scene s : m { grid x = 0 .. 1, cells 4, periodic; grid y = 0 .. 1, cells 4, periodic; initial u = 0; time 0 .. "
      "1, step 1 }\n";
  const std::string of_vector = "model m { vector u; dt(u) = f(u) }\n" + rest,
                    on_faces = "model m { vector u on faces; dt(u) = f(u) }\n" + rest;
  const std::vector<std::string> none, wrong_length{"E0309"}, number{"E0307"}, misplaced{"E0331"}, bad{"E0371"};
  EXPECT_EQ(codes("operator f(u) order 0 = u[-1, 0]\n  adjoint u_bar = f_bar[+1, 0]\n" + of_vector), none);
  EXPECT_EQ(codes("operator f(u) order 0 = u[-1, 0]\n  adjoint u_bar = 0\n" + of_vector), none);
  EXPECT_EQ(codes("operator f(u) order 0 = u[-1, 0]\n  adjoint u_bar = f_bar[-1, 0]\n" + of_vector), bad);
  EXPECT_EQ(codes("operator f(u) order 0 = u[-1, 0]\n  adjoint u_bar = f_bar.x[+1, 0]\n" + of_vector), wrong_length);
  EXPECT_EQ(codes("operator f(u) order 0 = u[-1, 0]\n  adjoint u_bar = f_bar[+1, 0]\nmodel m { field u; dt(u) = f((u, "
                  "u)).x + f(u*(1, 2)).y }\n" +
                  rest),
            none);
  EXPECT_EQ(
      codes("operator f(u) order 0 = u[-1, 0]\n  adjoint u_bar = (f_bar, f_bar)\nmodel m { field u; dt(u) = f(u) }\n" +
            rest),
      number);
  EXPECT_EQ(codes("operator f(u) order 0 = u[-1, 0]\n  adjoint u_bar = f_bar[+1, 0]\n" + on_faces), none);
  EXPECT_EQ(codes("operator f(u) order 0 = (u.y, u.x)\n  adjoint u_bar = (f_bar.y, f_bar.x)\n" + on_faces), misplaced);
  EXPECT_EQ(
      codes("operator f(u) order 0 = (interpolate(u.y), interpolate(u.x))\n  adjoint u_bar = (f_bar.y, f_bar.x)\n" +
            on_faces),
      misplaced)
      << "f_bar.y is on the faces of y";
  EXPECT_EQ(codes("operator f(u) order 0 = (interpolate(u.y), interpolate(u.x))\n  adjoint u_bar = "
                  "(interpolate(f_bar.y), interpolate(f_bar.x))\n" +
                  on_faces),
            none);
  EXPECT_EQ(codes("operator f(u) order 0 = div(u)\n  adjoint u_bar = -grad(f_bar)\nmodel m { vector u on faces; "
                  "dt(u.x) = f(u); dt(u.y) = interpolate(f(u)) }\n" +
                  rest),
            misplaced);
}

}  // namespace
}  // namespace dpde::testing
