// SPDX-License-Identifier: Apache-2.0
// Every scheme and time method converges at its design order against closed forms, on the compiled kernels.
#include <gtest/gtest.h>

#include <cmath>

#include "support/scene_run.h"

namespace dpde {
namespace {

using testing::Overrides;
using testing::run_scene;

const std::string advection = R"(
model advection { field u; param c; dt(u) = -advect(c, u) }
scheme s { advect = central(2); time = rk4 }
scene ring : advection with s {
  grid x = 0 .. 2*pi, cells 32, periodic
  c = 1
  initial u = sin(x) + 0.3*cos(2*x)
  exact   u = sin(x - c*t) + 0.3*cos(2*(x - c*t))
  time 0 .. 1.5707963267948966, step 1.5707963267948966/64
}
)";

const std::string heat_equation = R"(
model heat { field u; param kappa; dt(u) = kappa*lap(u) }
scheme s { lap = central(2); time = rk4 }
scene rod : heat with s {
  grid x = 0 .. 2*pi, cells 32, periodic
  kappa = 0.5
  initial u = sin(x) + 0.5*cos(2*x)
  exact   u = exp(-kappa*t)*sin(x) + 0.5*exp(-4*kappa*t)*cos(2*x)
  time 0 .. 0.5, step 1/512
}
scene plate : heat with s {
  grid x = 0 .. 1, cells 8
  grid y = 0 .. 2*pi, cells 16, periodic
  boundary u: x = 0
  kappa = 0.1
  initial u = sin(pi*x)*cos(y)
  exact   u = exp(-kappa*(pi^2 + 1)*t)*sin(pi*x)*cos(y)
  time 0 .. 0.5, step 1/1024
}
scene block : heat with s {
  grid x = 0 .. 2*pi, cells 8, periodic
  grid y = 0 .. 2*pi, cells 8, periodic
  grid z = 0 .. 1, cells 8
  boundary u: z.low = zero_gradient, z.high = 0
  kappa = 0.2
  initial u = sin(x)*cos(y)*cos(pi*z/2)
  exact   u = exp(-kappa*(2 + pi^2/4)*t)*sin(x)*cos(y)*cos(pi*z/2)
  time 0 .. 0.25, step 1/512
}
)";

const std::string decay = R"(
model decay { field u; dt(u) = -u*(1 + 0.5*t) }
scheme s { time = euler }
scene one : decay with s {
  grid x = 0 .. 1, cells 1, periodic
  initial u = 1
  exact   u = exp(-t - 0.25*t^2)
  time 0 .. 1, step 1/16
}
)";

/// Burgers' equation of a vector: -2*nu*grad(phi)/phi is a solution if phi solves the heat equation.
const std::string burgers = R"(
model burgers { vector u; param nu; dt(u) = -advect(u, u) + nu*lap(u) }
scheme s { advect = central(2); lap = central(2); time = rk4 }
scene line : burgers with s {
  grid x = 0 .. 2*pi, cells 8, periodic
  nu = 0.3
  initial u = 2*nu*sin(x)/(2 + cos(x))
  exact   u = 2*nu*exp(-nu*t)*sin(x)/(2 + exp(-nu*t)*cos(x))
  time 0 .. 0.5, step 1/64
}
scene plane : burgers with s {
  grid x = 0 .. 2*pi, cells 8, periodic
  grid y = 0 .. 2*pi, cells 8, periodic
  nu = 0.3
  initial u = (2*nu*sin(x)*cos(y)/(2 + cos(x)*cos(y)), 2*nu*cos(x)*sin(y)/(2 + cos(x)*cos(y)))
  exact u.x = 2*nu*exp(-2*nu*t)*sin(x)*cos(y)/(2 + exp(-2*nu*t)*cos(x)*cos(y))
  exact u.y = 2*nu*exp(-2*nu*t)*cos(x)*sin(y)/(2 + exp(-2*nu*t)*cos(x)*cos(y))
  time 0 .. 0.5, step 1/64
}
scene space : burgers with s {
  grid x = 0 .. 2*pi, cells 8, periodic
  grid y = 0 .. 2*pi, cells 8, periodic
  grid z = 0 .. 2*pi, cells 8, periodic
  nu = 0.3
  initial u = (2*nu*sin(x)/(3 + cos(x) + cos(z)), 0, 2*nu*sin(z)/(3 + cos(x) + cos(z)))
  exact u = (2*nu*sin(x)/(3*exp(nu*t) + cos(x) + cos(z)), 0, 2*nu*sin(z)/(3*exp(nu*t) + cos(x) + cos(z)))
  time 0 .. 0.5, step 1/64
}
)";

struct Level {
  Overrides overrides;
  double refinement;  // of this level relative to the one before
};

/// The observed order between the last two of three levels; both pairs must be within 0.15 of `design`.
void expect_order(const std::string& text, const std::string& scene, const std::vector<Level>& levels, double design,
                  double finest_bound, const std::string& field = "u") {
  std::vector<double> errors;
  for (const Level& level : levels) errors.push_back(run_scene(text, scene, level.overrides).l2.at(field));
  const size_t n = errors.size();
  const double order = std::log(errors[n - 2] / errors[n - 1]) / std::log(levels[n - 1].refinement);
  EXPECT_NEAR(order, design, 0.15) << scene << ": errors " << errors[n - 3] << " " << errors[n - 2] << " "
                                   << errors[n - 1];
  EXPECT_LT(errors[n - 1], finest_bound);
  EXPECT_GT(errors[n - 1], 1e-13);  // rounding errors have no order
}

std::vector<Level> with(const Overrides& common, const std::vector<Overrides>& levels) {
  std::vector<Level> result;
  for (Overrides level : levels) {
    level.insert(common.begin(), common.end());
    result.push_back({level, 2});
  }
  return result;
}

TEST(Order, OfAdvectionInSpace) {
  const std::vector<Overrides> cells{{{"cells", "32"}}, {{"cells", "64"}}, {{"cells", "128"}}};
  expect_order(advection, "ring", with({{"advect", "central2"}}, cells), 2, 1e-2);
  expect_order(advection, "ring", with({{"advect", "central4"}}, cells), 4, 1e-4);
  expect_order(advection, "ring", with({{"advect", "upwind3"}, {"step", "pi/512"}}, cells), 3, 1e-3);
  const std::vector<Overrides> coarse{{{"cells", "12"}}, {{"cells", "24"}}, {{"cells", "48"}}};
  expect_order(advection, "ring", with({{"advect", "central6"}, {"step", "pi/1024"}}, coarse), 6, 1e-5);
  expect_order(advection, "ring", with({{"advect", "central8"}, {"step", "pi/2048"}}, coarse), 8, 1e-7);
  // explicit first derivatives follow the key dx
  const std::string plain = std::string(advection).replace(advection.find("-advect(c, u)"), 13, "-c*dx(u)");
  expect_order(plain, "ring", with({{"dx", "central2"}}, cells), 2, 1e-2);
  expect_order(plain, "ring", with({{"dx", "central4"}}, cells), 4, 1e-4);
  expect_order(plain, "ring", with({{"dx", "central6"}, {"step", "pi/1024"}}, coarse), 6, 1e-5);
  expect_order(plain, "ring", with({{"dx", "central8"}, {"step", "pi/2048"}}, coarse), 8, 1e-7);
}

/// Upwind 1 and linear semi-Lagrangian interpolation err by h per unit time at a fixed Courant number: order 1.
TEST(Order, OfUpwindAndSemiLagrangianAtAFixedCourantNumber) {
  const std::vector<Overrides> both{{{"cells", "256"}, {"step", "pi/256"}},
                                    {{"cells", "512"}, {"step", "pi/512"}},
                                    {{"cells", "1024"}, {"step", "pi/1024"}}};
  const std::string whole = std::string(advection).replace(
      advection.find("time 0 .. 1.5707963267948966, step 1.5707963267948966/64"), 57, "time 0 .. pi/2, step pi/64 ");
  expect_order(whole, "ring", with({{"advect", "upwind1"}, {"time", "euler"}}, both), 1, 2e-2);
  expect_order(whole, "ring", with({{"advect", "semi_lagrangian"}, {"time", "euler"}}, both), 1, 2e-2);
}

/// Cubic interpolation errs by h^4 per step: order 3 at a fixed Courant number, here 1.3, and 0.7 along two axes.
TEST(Order, OfCubicSemiLagrangianAtAFixedCourantNumber) {
  const std::vector<Overrides> both{{{"cells", "26"}, {"step", "pi/20"}},
                                    {{"cells", "52"}, {"step", "pi/40"}},
                                    {{"cells", "104"}, {"step", "pi/80"}}};
  std::string text = advection;
  text.replace(text.find("time 0 .. 1.5707963267948966, step 1.5707963267948966/64"), 57,
               "time 0 .. pi/2, step pi/64 ");
  expect_order(text, "ring", with({{"advect", "semi_lagrangian(cubic)"}, {"time", "euler"}}, both), 3, 1e-4);
  const std::string plane = R"(
model carry { field u; dt(u) = -advect((1, -1), u) }
scene torus : carry {
  grid x = 0 .. 2*pi, cells 14, periodic
  grid y = 0 .. 2*pi, cells 14, periodic
  initial u = sin(x)*cos(y)
  exact   u = sin(x - t)*cos(y + t)
  time 0 .. pi/2, step pi/20
}
)";
  const std::vector<Overrides> planes{
      {{"cells", "14"}, {"step", "pi/10"}}, {{"cells", "28"}, {"step", "pi/20"}}, {{"cells", "56"}, {"step", "pi/40"}}};
  expect_order(plane, "torus", with({{"advect", "semi_lagrangian_cubic"}, {"time", "euler"}}, planes), 3, 1e-3);
}

/// Whole cells per step: the semi-Lagrangian scheme is a shift.
TEST(Order, SemiLagrangianIsExactAtWholeCourantNumbers) {
  const std::string whole = std::string(advection).replace(
      advection.find("time 0 .. 1.5707963267948966, step 1.5707963267948966/64"), 57, "time 0 .. pi/2, step pi/8  ");
  const double error = run_scene(whole, "ring", {{"advect", "semi_lagrangian"}, {"time", "euler"}}).l2.at("u");
  EXPECT_LT(error, 1e-13);
}

TEST(Order, OfDiffusionInSpace) {
  const std::vector<Overrides> cells{{{"cells", "16"}}, {{"cells", "32"}}, {{"cells", "64"}}};
  expect_order(heat_equation, "rod", with({{"lap", "central2"}}, cells), 2, 1e-3);
  expect_order(heat_equation, "rod", with({{"lap", "central4"}}, cells), 4, 1e-5);
  const std::vector<Overrides> coarse{{{"cells", "10"}}, {{"cells", "20"}}, {{"cells", "40"}}};
  expect_order(heat_equation, "rod", with({{"lap", "central6"}}, coarse), 6, 1e-6);
  expect_order(heat_equation, "rod", with({{"lap", "central8"}}, coarse), 8, 1e-8);
}

TEST(Order, OfDiffusionIn2DAnd3DWithWalls) {
  const std::vector<Overrides> cells{{{"cells", "8"}}, {{"cells", "16"}}, {{"cells", "32"}}};
  expect_order(heat_equation, "plate", with({}, cells), 2, 2e-3);
  expect_order(heat_equation, "block", with({}, cells), 2, 2e-3);
}

TEST(Order, OfAVectorOnOneTwoAndThreeAxes) {
  const std::vector<Overrides> cells{{{"cells", "16"}}, {{"cells", "32"}}, {{"cells", "64"}}};
  const std::vector<Overrides> coarse{{{"cells", "12"}}, {{"cells", "24"}}, {{"cells", "48"}}};
  expect_order(burgers, "line", with({}, cells), 2, 1e-2, "u.x");
  expect_order(burgers, "line", with({{"advect", "central4"}, {"lap", "central4"}}, cells), 4, 1e-4, "u.x");
  expect_order(burgers, "plane", with({{"step", "1/256"}}, cells), 2, 1e-2, "u.x");
  expect_order(burgers, "plane", with({{"step", "1/256"}}, cells), 2, 1e-2, "u.y");
  expect_order(burgers, "space", with({{"step", "1/256"}}, coarse), 2, 1e-2, "u.z");
}

/// Operators of the file have their declared order.
TEST(Order, OfOperatorsOfTheFile) {
  const std::string text = R"(
operator lap9(u) order 2 = (4*(u[+1, 0] + u[-1, 0] + u[0, +1] + u[0, -1]) + u[+1, +1] + u[+1, -1] + u[-1, +1] + u[-1, -1] - 20*u[0, 0])/(6*hx*hy)
operator slope4(u) order 4 = (u[-2, 0] - 8*u[-1, 0] + 8*u[+1, 0] - u[+2, 0])/(12*hx)
function mode(x, y) = sin(x)*cos(y)
model m { field u, v; dt(u) = 0.25*lap9(u); dt(v) = -slope4(v) }
scheme s { time = rk4 }
scene plate : m with s {
  grid x = 0 .. 2*pi, cells 8, periodic
  grid y = 0 .. 2*pi, cells 8, periodic
  initial u = mode(x, y)
  initial v = mode(x, y)
  exact u = exp(-0.5*t)*mode(x, y)
  exact v = mode(x - t, y)
  time 0 .. 0.5, step 1/128
}
)";
  const std::vector<Overrides> cells{{{"cells", "16"}}, {{"cells", "32"}}, {{"cells", "64"}}};
  expect_order(text, "plate", with({}, cells), 2, 1e-2, "u");
  expect_order(text, "plate", with({}, cells), 4, 1e-4, "v");
}

TEST(Order, OfTheTimeSchemes) {
  const std::vector<Overrides> steps{{{"step", "1/16"}}, {{"step", "1/32"}}, {{"step", "1/64"}}};
  expect_order(decay, "one", with({{"time", "euler"}}, steps), 1, 1e-2);
  expect_order(decay, "one", with({{"time", "rk2"}}, steps), 2, 1e-4);
  expect_order(decay, "one", with({{"time", "leapfrog"}}, steps), 2, 1e-3);
  for (const model::TimeMethod& method : model::time_methods()) {
    if (model::is_adams_bashforth(&method))
      expect_order(decay, "one", with({{"time", method.name}}, steps), method.order, method.order < 3 ? 1e-3 : 1e-4);
  }
  expect_order(decay, "one", with({{"time", "ssp_rk3"}}, steps), 3, 1e-6);
  expect_order(decay, "one", with({{"time", "rk4"}}, steps), 4, 1e-8);
}

}  // namespace
}  // namespace dpde
