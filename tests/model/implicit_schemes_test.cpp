// SPDX-License-Identifier: Apache-2.0
// What implicit time schemes solve for, and what they do not go with.
#include "model/analyse/implicit_part.h"
#include "model/model_support.h"

namespace dpde::model {
namespace {

/// "part | rest" of the equation of u.
std::string split(const std::string& rhs, int axes = 1, const std::string& model_lines = "") {
  const Problem problem =
      problem_of(text_with(rhs, axes, "  initial v = 0\n", "  field v\n  dt(v) = 0\n" + model_lines));
  const LinearPart parts = implicit_part(problem, "u", *problem.find_state("u")->rhs);
  return print(parts.part) + " | " + print(parts.rest);
}

TEST(ImplicitPart, HoldsTermsWithSecondDerivativesOfTheFieldItself) {
  EXPECT_EQ(split("k*lap(u) - advect(c, u)"), "k*d(u, x, 2) | -advect(c, u)");
  EXPECT_EQ(split("div(w*grad(u)) - u^3 + t"), "dx(w*dx(u)) | -u^3 + t");
  EXPECT_EQ(split("-(u - k*lap(u))"), "k*d(u, x, 2) | -u");
  EXPECT_EQ(split("k*(lap(u) + v)"), "k*d(u, x, 2) | k*v");
  EXPECT_EQ(split("-k*lap(lap(u)) - sin(t)*dx(u)"), "-k*d(d(u, x, 2), x, 2) | -(sin(t)*dx(u))");
  EXPECT_EQ(split("lap(u)/(1 + w^2) + mean(u)", 2), "(d(u, x, 2) + d(u, y, 2))/(1 + w^2) | mean(u)");
}

TEST(ImplicitPart, LeavesWhatIsNotLinearOrHoldsOtherFields) {
  for (const char* rhs : {"u*lap(u)", "lap(u^2)", "v*lap(u)", "lap(v)", "lap(w)*u", "div(u*grad(u))", "mean(v)*lap(u)",
                          "lap(advect(c, u))", "if(u > 0, 1, 2)*lap(u)"}) {
    const std::string parts = split(rhs);
    EXPECT_EQ(parts.substr(0, 4), "0 | ") << rhs << ": " << parts;
  }
}

TEST(ImplicitPart, IsWhatTheSchemeSays) {
  const auto split_by = [](Implicit implicit) {
    Problem problem = problem_of(
        text_with("k*lap(u) - 2*advect(c, u) + u^2*v + t", 1, "  initial v = 0\n", "  field v\n  dt(v) = 0\n"));
    problem.scheme.implicit = implicit;
    const LinearPart parts = implicit_part(problem, "u", *problem.find_state("u")->rhs);
    return print(parts.part) + " | " + print(parts.rest);
  };
  EXPECT_EQ(split_by(Implicit::linear), "k*d(u, x, 2) | -(2*advect(c, u)) + u^2*v + t");
  EXPECT_EQ(split_by(Implicit::all_but_advect), "k*d(u, x, 2) + u^2*v + t | -(2*advect(c, u))");
  EXPECT_EQ(split_by(Implicit::all), "k*d(u, x, 2) - 2*advect(c, u) + u^2*v + t | 0");
}

TEST(ImplicitSchemes, SayWhatTheyDoNotGoWith) {
  const std::string heat = text_with("k*lap(u) - u");
  EXPECT_EQ(refusal_of(heat, {{"time", "ars222"}}), "");
  EXPECT_EQ(refusal_of(heat, {{"time", "backward_euler"}}), "");
  EXPECT_EQ(refusal_of(heat, {{"time", "crank_nicolson"}}),
            "time = crank_nicolson does not go with an equation for u with more of the fields in it than is solved "
            "for: E0555 take time = ars222, which takes other terms explicitly");
  EXPECT_EQ(refusal_of(heat, {{"time", "ars443"}, {"lap", "spectral"}}),
            "time = ars443 does not go with derivatives by Fourier series: E0555 take dx and lap = central(4), or time "
            "= etdrk4");
  EXPECT_EQ(refusal_of("model flow {\n  vector u\n  field p\n  dt(u) = lap(u) - grad(p)\n  0 = div(u) gives p\n}\n"
                       "scene s : flow {\n  grid x = 0 .. 1, cells 8, periodic\n  grid y = 0 .. 1, cells 8, periodic\n"
                       "  initial u = (0, 0)\n  time 0 .. 1, step 1/64\n}\n",
                       {{"time", "ars222"}, {"dx", "spectral"}, {"lap", "spectral"}, {"advect", "spectral"}}),
            "time = ars222 does not go with derivatives by Fourier series: E0555 take time = rk4, or velocities on "
            "faces and dx and lap = central(2)");
  EXPECT_EQ(refusal_of(heat, {{"time", "ars443"}, {"dealias", "two_thirds"}}),
            "time = ars443 does not go with dealias = two_thirds: E0555 take time = etdrk4");
  EXPECT_EQ(
      refusal_of(text_with("-advect(c, u) + lap(u)"), {{"time", "imex_euler"}, {"advect", "maccormack"}}),
      "time = imex_euler does not go with advection along the flow in one step with other terms: E0555 write split "
      "= lie(advect, sources, diffusion) in the scheme, or take advect = upwind(3)");
  EXPECT_EQ(refusal_of(text_with("-u"), {{"time", "backward_euler"}}),
            "time = backward_euler does not go with equations in which it finds nothing to solve for: E0555 it takes "
            "terms like nu*lap(u) of dt(u) implicitly, with factors that hold no field of an equation; take time = "
            "rk2, or implicit = all for other terms too");
  EXPECT_EQ(refusal_of(text_with("-u"), {{"time", "backward_euler"}, {"implicit", "all"}}), "");
  EXPECT_EQ(refusal_of(text_with("-u"), {{"implicit", "all"}}),
            "time = rk4 does not go with implicit = all: E0555 take time = ars222, or leave implicit out");
  EXPECT_EQ(
      refusal_of("scheme c { time = ars222; implicit = all; split = lie(sources, diffusion) }\n"
                 "model m { field u; dt(u) = lap(u) - u^2 }\n"
                 "scene s : m with c { grid x = 0 .. 1, cells 8, periodic; initial u = 1; time 0 .. 1, step 0.1 }\n",
                 {}),
      "time = ars222 does not go with implicit = all and steps in parts: E0555 take implicit = linear, or leave "
      "split out");
  EXPECT_EQ(refusal_of(text_with("lap(u)", 1, "  subcycle u in 2\n"), {{"time", "ars222"}}),
            "time = ars222 does not go with equations that make several steps within each: E0555 take time = rk2 or "
            "rk4");
}

}  // namespace
}  // namespace dpde::model
