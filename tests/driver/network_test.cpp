// SPDX-License-Identifier: Apache-2.0
// Derivatives through networks and steps together, also second ones: tangent against adjoint and Taylor slopes, by
// weights, parameters and states.
#include "driver_support.h"

namespace dpde {
namespace {

using testing::expect_certified;

const std::string corrector = R"(
network corrector(u, nu) {
  initial he, seed 7
  padding replicate
  conv 6, 5; tanh
  residual { conv 6, 3; silu }
  conv out, 3, gain = 0.1
}
)";

TEST(Networks, CorrectAStepBetweenWalls) {
  expect_certified(corrector + R"(
model m { field u; param nu; dt(u) = -u*dx(u) + nu*lap(u) }
scheme s { time = rk2; networks = f64 }
scene r : m with s {
  grid x = 0 .. 1, cells 9
  boundary u: x.low = 0.2, x.high = zero_gradient
  nu = 0.05
  initial u = x
  time 0 .. 0.2, step 0.02
  after step: u += corrector(u, nu)
}
task t : r { learn corrector; unknown nu; unknown initial u; minimise mean((u - 0.5)^2) over time })",
                   true);
}

/// Outputs are read at neighbours and midway between cells; arguments contain derivatives.
TEST(Networks, StandInsideOfEquations) {
  expect_certified(R"(
network law(s, g) -> k, q { initial xavier, seed 1; dense 5; tanh; dense out; softplus; scale 0.1 }
model m { field u; dt(u) = dx(law(u, dx(u)).k*dx(u)) + dy(law(u, dx(u)).q) - advect((law(u, 1).k, law(u, 1).q), u) }
scheme s { time = rk4; networks = f64 }
scene r : m with s {
  grid x = 0 .. 1, cells 6
  grid y = 0 .. 1, cells 5, periodic
  boundary u: x = gradient(0.1)
  initial u = sin(2*pi*y) + x
  time 0 .. 0.1, step 0.02
}
task t : r { learn law; unknown initial u; minimise mean(u^2) })",
                   true);
}

/// The copies of a symmetric network, and velocities relative to their mean.
TEST(Networks, WithSymmetries) {
  expect_certified(R"(
network push(u: vector, s) -> vector {
  initial he, seed 3
  symmetric flips, rotations, galilean
  repeat 2 shared { conv in, 3; tanh }
  conv out, 3, gain = 0.3
}
model m { vector u; field s; dt(u) = -advect(u, u) + 0.1*lap(u) + push(u, s); dt(s) = -s }
scheme c { time = rk2; networks = f64 }
scene r : m with c {
  grid x = 0 .. 1, cells 5, periodic
  grid y = 0 .. 1, cells 5, periodic
  initial u = (sin(2*pi*y) + 1, cos(2*pi*x)); initial s = sin(2*pi*(x + y))
  time 0 .. 0.04, step 0.02
  after step: u += 0.1*push(u, 2*s)
}
task t : r { learn push; unknown initial u; minimise mean(dot(u, u)) + mean(push(u, s).x*u.y) })",
                   true);
}

/// Inputs known before the first step: coordinates and parameters. The step contains the network, too.
TEST(Networks, GiveInitialStates) {
  expect_certified(R"(
network start(x, a) -> u, v { initial he, seed 4; conv 5, 3; tanh; conv out, 3 }
model m { field u, v; param a; dt(u) = -v*dx(u) + 0.1*start(u, v).u; dt(v) = 0.1*lap(v) }
scheme c { time = rk2; networks = f64 }
scene r : m with c {
  grid x = 0 .. 1, cells 7
  boundary u = zero_gradient; boundary v = 0.1
  a = 0.4
  initial u = 1 + a*start(sin(2*pi*x), a).u; initial v = start(x, a).v*x
  time 0 .. 0.06, step 0.02
}
task t : r { learn start; unknown a; minimise mean(u^2) + mean((v - 0.1)^2) })",
                   true);
}

/// A network of coordinates only; the initial state of another field is unknown.
TEST(Networks, GiveCoefficientsAndBoundaryValues) {
  expect_certified(R"(
network law(x, y) -> k, w { initial he, seed 4; dense 5; tanh; dense out; scale 0.5 }
model m { field u; coefficient k, wall; dt(u) = div((1 + k)*grad(u)) }
scheme c { time = euler; networks = f64 }
scene r : m with c {
  grid x = 0 .. 1, cells 5
  grid y = 0 .. 1, cells 4, periodic
  boundary u: x.low = wall, x.high = 0
  k = law(x, sin(2*pi*y)).k; wall = law(x, cos(2*pi*y)).w
  initial u = x*(1 - x)
  time 0 .. 0.02, step 0.004
}
task t : r { learn law; unknown initial u; minimise mean(u^2) })",
                   true);
}

/// Velocities on faces; the network is at the centres.
TEST(Networks, OnStaggeredGrids) {
  expect_certified(R"(
network push(u: vector, p) -> vector { initial he, seed 2; conv 4, 3; gelu; conv out, 3, gain = 0.3 }
model m {
  vector u on faces
  field p
  dt(u) = -grad(p) + interpolate(push(interpolate(u), p))
  dt(p) = -div(u)
}
scheme s { time = ssp_rk3; networks = f64 }
scene r : m with s {
  grid x = 0 .. 1, cells 6, periodic
  grid y = 0 .. 1, cells 4, periodic
  initial u = (0.1*sin(2*pi*y), 0)
  initial p = 0.3*cos(2*pi*x)
  time 0 .. 0.1, step 0.02
}
task t : r { learn push; unknown initial p; minimise mean(p^2) + mean(u.x^2) over time })",
                   true);
}

/// A controller: its inputs are means, its output is uniform and constant until the next decision.
TEST(Networks, ControlByObservations) {
  expect_certified(R"(
network controller(left, right) { initial xavier, seed 4; dense 6; tanh; dense out }
model m { field u, knob; dt(u) = 0.05*lap(u) + u - u^3 + knob; dt(knob) = 0 }
scheme s { time = rk2; networks = f64 }
scene r : m with s {
  grid x = 0 .. 1, cells 8, periodic
  initial u = 0.3*sin(2*pi*x)
  initial knob = 0
  time 0 .. 0.6, step 0.05
  every 0.2: knob = controller(mean(if(x < 0.5, u, 0)), mean(if(x < 0.5, 0, u)))
}
task t : r { learn controller; minimise mean(u^2 + 0.1*knob^2) over time })",
                   true);
}

TEST(Networks, InThreeDimensionsWithALossOfTheirOwn) {
  expect_certified(R"(
network pressure(d) {
  initial he, seed 9
  conv 3, 3; leaky_relu(0.1)
  skip { mean_pool 2; conv 4, 3; tanh; upsample 2 }
  conv out, 3
}
model m { vector v; dt(v) = 0*v }
scheme s { time = euler; networks = f64 }
scene r : m with s {
  grid x = 0 .. 1, cells 4, periodic
  grid y = 0 .. 1, cells 3, periodic
  grid z = 0 .. 1, cells 5, periodic
  initial v = (sin(2*pi*y), cos(2*pi*z), sin(2*pi*x))
  time 0 .. 0.1, step 0.1
}
task t : r { learn pressure; unknown initial v; minimise mean((div(v) - lap(pressure(div(v))))^2) at t = 0 })",
                   true);
}

}  // namespace
}  // namespace dpde
