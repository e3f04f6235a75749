// SPDX-License-Identifier: Apache-2.0
// Tangent and adjoint of stencil programs, and of their own results (both are closed), on every small extent.
#include "adjoint/adjoint.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "stencil/print_stencil.h"
#include "support/derivative_check.h"

namespace dpde {
namespace {

using adjoint::Activity;
using testing::check_derivatives;
using testing::parse_module;

struct Case {
  std::string name;
  int rank;
  std::string text;  // program `p`
  Activity wrt;
};

const std::string burgers_kernel = R"(
kernel k(u: field halo 1, out v: field, nu, hx, dt: param) {
  let ux = (u[+1] - u[-1])/(2*hx)
  v = u + dt*(-u*ux + nu*(u[-1] - 2*u + u[+1])/hx^2)
}
)";

const std::string burgers_2d_kernel = R"(
kernel k(u: field halo 1, v: field halo 1, out un: field, out vn: field, nu, hx, hy, dt: param) {
  let ux = (u[+1, 0] - u[-1, 0])/(2*hx)
  let vy = (v[0, +1] - v[0, -1])/(2*hy)
  un = u + dt*(-(u*ux + v*(u[0, +1] - u[0, -1])/(2*hy)) + nu*((u[-1, 0] - 2*u + u[+1, 0])/hx^2 + (u[0, -1] - 2*u + u[0, +1])/hy^2))
  vn = v + dt*(-(u*(v[+1, 0] - v[-1, 0])/(2*hx) + v*vy) + nu*(v[-1, 0] + v[+1, 0] - 4*v + v[0, -1] + v[0, +1])/(hx*hy))
}
)";

const std::string two_stages = R"(
kernel s1(u: field halo 2, kappa: field halo 1, out w: field, dt: param) {
  let flux = kappa[+1]*(u[+2] - u)*exp(u)
  w = u + dt*flux/kappa
}
kernel s2(u: field, w: field halo 1, out v: field, sum e: param, a, dt: param) {
  v = u + dt*(w[+1]*w - sin(w[-1])) + a^2*w^3
  e += a*w^2 + sqrt(u)
}
)";

const std::string interp_kernels = R"(
kernel s1(u: field halo 1, out w: field, nu: param) { w = u + nu*(u[-1] - 2*u + u[+1]) }
kernel s2(w: field halo 1, out v: field, c: param) { v = interp(w, -c*w*w) }
)";

const std::string interp_2d_kernels = R"(
kernel s2(w: field halo 1, q: field halo 1, out v: field, c: param) {
  let d = -c*w*q[+1, 0]
  v = interp(w, d, 2.3*q)*q + interp_dx(q, 0.4*w, d)
}
)";

const std::string heat_3d_kernel = R"(
kernel k(u: field halo 2, out v: field, nu, h: param) {
  v = u + nu*(u[-1, 0, 0] + u[+1, 0, 0] + u[0, -2, 0] + u[0, +2, 0] + u[0, 0, -1]*u[0, 0, +1] - 6*u)/h^2
}
)";

const std::string kinks = R"(
kernel k(u: field halo 1, out v: field, c: param) {
  let up = max(u - 1, 0)
  let um = min(u - 1, 0)
  v = up*(u - u[-1]) + um*(u[+1] - u) + abs(u[+1] - 1.01)*c + if(u > 0.9, 1/u, log(u[-1] + 3)) + tanh(u)/cosh(u) + atan(c*u)^c
}
)";

std::vector<Case> cases() {
  const Activity u_nu{{"u"}, {"nu"}};
  const std::string bounded = "fill u x.low = 0.3, x.high = zero_gradient\n";
  return {
      {"burgers periodic", 1, burgers_kernel + "program p { fill u periodic; run k; swap u, v }", u_nu},
      {"burgers bounded", 1, burgers_kernel + "program p { " + bounded + "run k; swap u, v }", u_nu},
      {"burgers 2-D periodic", 2,
       burgers_2d_kernel + "program p { fill u periodic; fill v periodic; run k; swap u, un; swap v, vn }",
       {{"u", "v"}, {"nu"}}},
      {"burgers 2-D mixed", 2,
       burgers_2d_kernel + "program p { fill u x periodic, y.low = 1, y.high = 0.2; fill v x periodic, y = zero_gradient; run k; "
                           "swap u, un; swap v, vn }",
       {{"u", "v"}, {"nu"}}},
      {"burgers 2-D bounded", 2,
       burgers_2d_kernel + "program p { fill u x = 0.5, y.low = 1, y.high = zero_gradient; fill v x = zero_gradient, y = 0; run k; "
                           "swap u, un; swap v, vn }",
       {{"u", "v"}, {"nu"}}},
      {"two stages periodic", 1,
       two_stages + "program p { fill u periodic; fill kappa periodic; run s1; fill w periodic; run s2; swap u, v }",
       {{"u", "kappa"}, {"a"}}},
      {"two stages bounded", 1,
       two_stages + "program p { fill u x = 1.2; fill kappa x = zero_gradient; run s1; fill w x.low = 0.7, x.high = zero_gradient; "
                    "run s2; swap u, v }",
       {{"u", "kappa"}, {"a"}}},
      {"interp periodic", 1, interp_kernels + "program p { fill u periodic; run s1; fill w periodic; run s2; swap u, v }",
       {{"u"}, {"nu", "c"}}},
      {"interp bounded", 1, interp_kernels + "program p { fill u x = 0.4; run s1; fill w x.low = 0.4, x.high = zero_gradient; run s2; swap u, v }",
       {{"u"}, {"nu", "c"}}},
      {"interp 2-D periodic", 2,
       interp_2d_kernels + "program p { fill w periodic; fill q periodic; run s2; keep v }", {{"w", "q"}, {"c"}}},
      {"interp 2-D bounded", 2,
       interp_2d_kernels + "program p { fill w x = 0.3, y periodic; fill q x = zero_gradient, y periodic; run s2; keep v }",
       {{"w", "q"}, {"c"}}},
      {"heat 3-D", 3, heat_3d_kernel + "program p { fill u x periodic, y.low = 1, y.high = zero_gradient, z = 0; run k; swap u, v }",
       {{"u"}, {"nu"}}},
      {"halo read by the adjoint only", 1,
       "kernel k(d: field halo 1, u: field, q: field, out v: field, c: param) { v = d*q^2 - c*min(u, 1)*(d[+1] - d)*u }\n"
       "program p { fill d periodic; run k; swap d, v }", {{"d", "u", "q"}, {"c"}}},
      {"scalar parameter only", 1, burgers_kernel + "program p { fill u x = 0.2; run k; keep v }", {{}, {"nu", "dt"}}},
      {"kinks", 1, kinks + "program p { fill u periodic; run k; keep v }", {{"u"}, {"c"}}},
      {"kinks bounded", 1, kinks + "program p { fill u x.low = 0.6, x.high = 1.3; run k; keep v }", {{"u"}, {"c"}}},
  };
}

std::vector<stencil::Grid> grids(int rank) {
  std::vector<stencil::Grid> result;
  if (rank == 1) {
    for (int n = 1; n <= 7; ++n) result.push_back({1, {n, 1, 1}});
    return result;
  }
  for (int nx = 1; nx <= 4; ++nx) {
    for (int ny = 1; ny <= 4; ++ny) {
      if (rank == 2) result.push_back({2, {nx, ny, 1}});
      if (rank == 3) result.push_back({3, {nx, ny, 5 - nx}});
    }
  }
  return result;
}

void expect_right(const Case& c, const stencil::Module& module, const std::string& program, const Activity& wrt, bool differences) {
  double magnitude = 0;  // a departure point beyond a boundary may leave nothing to differentiate on one grid
  for (const stencil::Grid& grid : grids(c.rank)) {
    SCOPED_TRACE(c.name + " " + program + " on " + std::to_string(grid.cells[0]) + " x " + std::to_string(grid.cells[1]));
    const auto check = check_derivatives(module, program, wrt, grid, 1234 + grid.cells[0]);
    EXPECT_LT(check.dot_product, 1e-12) << stencil::print(module);
    if (differences) EXPECT_LT(check.finite_difference, 1e-6);
    magnitude = std::max(magnitude, check.magnitude);
    if (::testing::Test::HasFailure()) return;
  }
  EXPECT_GT(magnitude, 0.1) << c.name;
}

TEST(Adjoint, IsTheTransposeOfTheTangentOnEverySmallExtent) {
  for (const Case& c : cases()) expect_right(c, parse_module(c.text), "p", c.wrt, true);
}

/// Activity of a derived program: all its inputs that can vary.
Activity inputs_of(const adjoint::Derivative& derived, const Activity& wrt) {
  Activity all = wrt;
  const stencil::Program& program = *derived.module.find_program(derived.program);
  for (const stencil::Swap& swap : program.swaps) all.fields.insert(swap.state);
  return all;
}

TEST(Adjoint, IsClosedUnderItself) {
  for (const Case& c : cases()) {
    const stencil::Module module = parse_module(c.text);
    DiagnosticSink sink;
    const adjoint::Derivative first = adjoint::adjoint(module, "p", c.wrt, sink);
    ASSERT_FALSE(sink.has_errors()) << c.name;
    expect_right(c, first.module, first.program, inputs_of(first, c.wrt), false);
    if (HasFailure()) return;
  }
}

TEST(Tangent, IsClosedUnderItself) {
  for (const Case& c : cases()) {
    const stencil::Module module = parse_module(c.text);
    DiagnosticSink sink;
    const adjoint::Derivative first = adjoint::tangent(module, "p", c.wrt, sink);
    ASSERT_FALSE(sink.has_errors()) << c.name;
    expect_right(c, first.module, first.program, inputs_of(first, c.wrt), false);
    if (HasFailure()) return;
  }
}

/// The three closed forms of one upwind step at negative velocity: dP_i/du_i = (dt/dx)(d_i - d_{i+1}),
/// dP_i/dd_i = 1 + u_i dt/dx, dP_i/dd_{i+1} = -u_i dt/dx (gather: the last one is read at i - 1).
TEST(Adjoint, OfUpwindTransportIsTheClosedForm) {
  const stencil::Module module = parse_module(R"(
kernel step(d: field halo 1, u: field, out p: field, dt, hx: param) {
  p = d - dt*min(u, 0)*(d[+1] - d)/hx
}
program transport { fill d periodic; run step; swap d, p }
)");
  DiagnosticSink sink;
  const adjoint::Derivative derived = adjoint::adjoint(module, "transport", {{"d", "u"}, {}}, sink);
  stencil::State state({1, {5, 1, 1}}, 2);
  const std::vector<double> d{1, 3, 2, 5, 4}, u{-1, -2, -0.5, -3, -1.5}, seed{0.3, -0.7, 1.1, 0.2, -0.9};
  const double dt = 0.1, dx = 0.25;
  state.set("d", d);
  state.set("u", u);
  state.set("p_bar", seed);
  stencil::interpret(derived.module, *derived.module.find_program(derived.program), state, {{"dt", dt}, {"hx", dx}});
  const std::vector<double> d_bar = state.get("p_bar"), u_bar = state.get("u_bar");  // swapped: p_bar holds d_bar
  for (int i = 0; i < 5; ++i) {
    const int before = (i + 4) % 5, after = (i + 1) % 5;
    EXPECT_NEAR(u_bar[i], dt / dx * (d[i] - d[after]) * seed[i], 1e-14);
    EXPECT_NEAR(d_bar[i], (1 + u[i] * dt / dx) * seed[i] - u[before] * dt / dx * seed[before], 1e-14);
  }
}

TEST(Adjoint, OfALinearStepRecomputesNothing) {
  const stencil::Module module = parse_module(R"(
kernel step(u: field halo 1, out v: field, c: param) { v = u + c*(u[-1] - 2*u + u[+1]) }
program heat { fill u periodic; run step; swap u, v }
)");
  DiagnosticSink sink;
  const adjoint::Derivative derived = adjoint::adjoint(module, "heat", {{"u"}, {}}, sink);
  EXPECT_EQ(stencil::print(derived.module), R"(kernel step_adjoint(v_bar: field halo 1, out u_bar: field, c: param) {
  u_bar = v_bar[-1]*c + (v_bar - v_bar*c*2) + v_bar[+1]*c
}

program heat_adjoint {
  fill v_bar periodic
  run step_adjoint
  swap v_bar, u_bar
}
)");
}

std::string code_of_error(const std::string& text, const Activity& wrt) {
  const stencil::Module module = parse_module(text);
  DiagnosticSink forward, reverse;
  adjoint::tangent(module, "p", wrt, forward);
  adjoint::adjoint(module, "p", wrt, reverse);
  EXPECT_TRUE(reverse.has_errors());
  return reverse.has_errors() ? std::string(reverse.all()[0].kind->code) : "";
}

TEST(Adjoint, RefusesWhatItCannotDifferentiate) {
  EXPECT_EQ(code_of_error("kernel k(u: field, out v: field) { v = floor(u) }\nprogram p { run k; keep v }", {{"u"}, {}}), "E0601");
  EXPECT_EQ(code_of_error(R"(
kernel a(u: field, out w: field) { w = u^2 }
kernel b(w: field, out v: field) { v = w^2 }
kernel c(u: field, inout w: field) { w += u }
program p { run a; run b; run c; keep v, w }
)", {{"u"}, {}}), "E0603");
  EXPECT_EQ(code_of_error(R"(
kernel k(u: field halo 1, out v: field) { v = u[+1]*u }
program p { fill u x = nu; run k; keep v }
)", {{"u"}, {"nu"}}), "E0604");
}

}  // namespace
}  // namespace dpde
