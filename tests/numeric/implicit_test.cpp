// SPDX-License-Identifier: Apache-2.0
// Implicit time schemes: orders, stability functions, steps far beyond the explicit limit, agreement of back ends,
// derivatives. A wave sin(k x) of a grid is an eigenvector of the second difference with eigenvalue -(2 - 2 cos(k
// h))/h^2, also between walls where it is the mean of the values on both sides.
#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "../driver/driver_support.h"
#include "support/scene_run.h"
#include "support/setting.h"

namespace dpde::testing {
namespace {

/// Exact in space: the whole error is in time.
const std::string exact_in_space = R"(
function rate(nu, k, h) = 4*nu/h^2*sin(k*h/2)^2
model heat { field u; param nu, k, h; dt(u) = nu*lap(u) }
model heat_on_faces { field u on faces.x; param nu, k, h; dt(u) = nu*lap(u) }
model heated { field u; param nu; dt(u) = nu*lap(u) + cos(t)*x + t*sin(t) }
model carry { field u; param nu, h; dt(u) = -advect(1, u) + nu*lap(u) }
model waves { field e; field u on faces.x; dt(e) = -dx(u); dt(u) = -dx(e) }
model burgers { vector u; param nu; dt(u) = -advect(u, u) + nu*lap(u) }
scheme s { time = ars222 }
scene rod : heat with s {
  grid x = 0 .. 1, cells 6
  nu = 0.1; k = 3; h = 1/6
  boundary u: x.low = exp(-rate(nu, k, h)*t)*sin(0.7)*cos(k*h/2)
  boundary u: x.high = exp(-rate(nu, k, h)*t)*sin(k + 0.7)*cos(k*h/2)
  initial u = sin(k*x + 0.7)
  exact u = exp(-rate(nu, k, h)*t)*sin(k*x + 0.7)
  time 0 .. 1, step 1/8
}
scene rod_of_faces : heat_on_faces with s {
  grid x = 0 .. 1, cells 6
  nu = 0.1; k = 3; h = 1/6
  boundary u: x.low = exp(-rate(nu, k, h)*t)*sin(0.7), x.high = exp(-rate(nu, k, h)*t)*sin(k + 0.7)
  initial u = sin(k*x + 0.7)
  exact u = exp(-rate(nu, k, h)*t)*sin(k*x + 0.7)
  time 0 .. 1, step 1/8
}
scene source : heated with s {
  grid x = 0 .. 1, cells 6
  nu = 0.02
  boundary u: x.low = sin(t) - t*cos(t), x.high = gradient(sin(t))
  initial u = 0
  exact u = sin(t)*(x + 1) - t*cos(t)
  time 0 .. 1, step 1/8
}
scene ring : carry with s {
  grid x = 0 .. 2*pi, cells 16, periodic
  nu = 0.2; h = 2*pi/16
  initial u = sin(x)
  exact u = exp(-rate(nu, 1, h)*t)*sin(x - sin(h)/h*t)
  time 0 .. 1, step 1/8
}
scene sea : waves with s {
  grid x = 0 .. 2*pi, cells 128, periodic
  initial e = cos(x); initial u = 0
  exact e = cos(x)*cos(2*sin(pi/128)/(2*pi/128)*t)
  exact u = sin(x)*sin(2*sin(pi/128)/(2*pi/128)*t)
  time 0 .. 1, step 1/8
}
scene line : burgers with s {
  grid x = 0 .. 2*pi, cells 64, periodic
  nu = 0.3
  initial u = 2*nu*sin(x)/(2 + cos(x))
  exact   u = 2*nu*exp(-nu*t)*sin(x)/(2 + exp(-nu*t)*cos(x))
  time 0 .. 1, step 1/8
}
scene plane : burgers with s {
  grid x = 0 .. 2*pi, cells 32, periodic
  grid y = 0 .. 2*pi, cells 32, periodic
  nu = 0.3
  initial u = (2*nu*sin(x)*cos(y)/(2 + cos(x)*cos(y)), 2*nu*cos(x)*sin(y)/(2 + cos(x)*cos(y)))
  exact u.x = 2*nu*exp(-2*nu*t)*sin(x)*cos(y)/(2 + exp(-2*nu*t)*cos(x)*cos(y))
  exact u.y = 2*nu*exp(-2*nu*t)*cos(x)*sin(y)/(2 + exp(-2*nu*t)*cos(x)*cos(y))
  time 0 .. 1, step 1/8
}
)";

/// From steps of 1/16, 1/32 and 1/64.
void expect_order_in_time(const std::string& scene, const std::string& time, double order, double finest_bound,
                          Overrides overrides = {}) {
  std::vector<double> errors;
  overrides["time"] = time;
  for (const char* step : {"1/16", "1/32", "1/64"}) {
    overrides["step"] = step;
    errors.push_back(run_scene(exact_in_space, scene, overrides).l2.begin()->second);
  }
  const std::string text = fmt::format("{} {}: errors {}", scene, time, fmt::join(errors, " "));
  EXPECT_NEAR(std::log2(errors[0] / errors[1]), order, 0.2) << text;
  EXPECT_NEAR(std::log2(errors[1] / errors[2]), order, 0.15) << text;
  EXPECT_LT(errors[2], finest_bound) << text;
}

/// At centres, and on faces with the last one on a wall.
TEST(ImplicitOrder, OfHeatBetweenWallsThatVaryInTime) {
  for (const char* scene : {"rod", "rod_of_faces"}) {
    expect_order_in_time(scene, "backward_euler", 1, 1e-2);
    expect_order_in_time(scene, "imex_euler", 1, 1e-2);
    expect_order_in_time(scene, "crank_nicolson", 2, 1e-4);
    expect_order_in_time(scene, "ars222", 2, 1e-4);
    expect_order_in_time(scene, "ars443", 3, 1e-6);
  }
}

TEST(ImplicitOrder, OfHeatWithASource) {
  expect_order_in_time("source", "backward_euler", 1, 1e-1);
  expect_order_in_time("source", "crank_nicolson", 2, 1e-3);
  expect_order_in_time("source", "ars222", 2, 1e-3);
  expect_order_in_time("source", "ars443", 3, 1e-5);
}

TEST(ImplicitOrder, OfAdvectionAndDiffusion) {
  expect_order_in_time("ring", "imex_euler", 1, 1e-2);
  expect_order_in_time("ring", "ars222", 2, 1e-4);
  expect_order_in_time("ring", "ars443", 3, 1e-6);
}

TEST(ImplicitOrder, OfBurgersEquation) {
  const Overrides fine{{"advect", "central8"}, {"lap", "central8"}};
  for (const char* scene : {"line", "plane"}) {
    expect_order_in_time(scene, "imex_euler", 1, 1e-2, fine);
    expect_order_in_time(scene, "ars222", 2, 1e-4, fine);
  }
  expect_order_in_time("line", "ars443", 3, 1e-6, fine);
}

/// Steps of up to 1.3 cells, beyond the explicit limit of the shortest waves.
TEST(ImplicitOrder, OfWaves) {
  const Overrides all{{"implicit", "all"}};
  expect_order_in_time("sea", "backward_euler", 1, 1e-2, all);
  expect_order_in_time("sea", "crank_nicolson", 2, 1e-4, all);
  expect_order_in_time("sea", "ars222", 2, 1e-4, all);
  expect_order_in_time("sea", "ars443", 3, 1e-6, all);
}

const std::string heated_ring = R"(
model heat { field u; dt(u) = lap(u) }
scene ring : heat {
  grid x = 0 .. 1, cells 64, periodic
  initial u = sin(2*pi*x)
  time 0 .. 10, step 1
}
)";

/// Amplification factor of a step for dt(u) = z*u/h.
double left_by(const std::string& scheme, double z) {
  if (scheme == "crank_nicolson") return (1 + z / 2) / (1 - z / 2);
  if (scheme == "ars222") {
    const double g = 1 - std::sqrt(0.5), first = 1 / (1 - g * z);
    return (1 + (1 - g) * z * first) / (1 - g * z);
  }
  if (scheme == "ars443") {
    const double d = 1 - z / 2, a = 1 / d, b = (1 + z * a / 6) / d, c = (1 - z * a / 2 + z * b / 2) / d;
    return (1 + 1.5 * z * a - 1.5 * z * b + z * c / 2) / d;
  }
  return 1 / (1 - z);
}

/// Steps from 1e-3 to more than 50 times the explicit limit; also on grids of few cells.
TEST(ImplicitHeat, DampsAWaveAsTheStabilityFunctionSays) {
  for (const std::string scheme : {"backward_euler", "imex_euler", "crank_nicolson", "ars222", "ars443"}) {
    for (const int cells : {1, 2, 3, 8, 64}) {
      const double lambda = (2 - 2 * std::cos(2 * std::numbers::pi / cells)) * cells * cells;
      for (const double step : {1e-6, 50 / (2.0 * cells * cells), 1.0}) {
        const Overrides overrides{{"time", scheme},
                                  {"cells", std::to_string(cells)},
                                  {"step", fmt::format("{}", step)},
                                  {"end", fmt::format("{}", 4 * step)}};
        const double left = std::pow(left_by(scheme, -lambda * step), 4);
        for (const auto backend : {driver::Backend::jit, driver::Backend::interpreter, driver::Backend::cpp}) {
          if (backend == driver::Backend::cpp && (cells != 8 || step != 1.0 || scheme != "ars443")) continue;  // slow
          const std::vector<double> u = run_scene(heated_ring, "ring", overrides, backend).state.at("u");
          for (int i = 0; i < cells; ++i) {
            const double x = (i + 0.5) / cells;
            EXPECT_NEAR(u[static_cast<std::size_t>(i)], left * std::sin(2 * std::numbers::pi * x), 1e-12)
                << scheme << " " << cells << " " << step;
          }
        }
      }
    }
  }
}

double largest_size(const std::vector<double>& values) {
  double result = 0;
  for (const double value : values) result = std::max(result, std::abs(value));
  return result;
}

/// A jump, which contains all waves, at 50 times the explicit limit of diffusion: nothing grows, and L-stable schemes
/// remove the shortest waves. Advection keeps its own limit.
TEST(ImplicitStability, IsNotLimitedByDiffusion) {
  const std::string text = R"(
model carry { field u; param v; dt(u) = -advect(v, u) + lap(u) }
scene jump : carry {
  grid x = 0 .. 1, cells 32
  grid y = 0 .. 1, cells 32
  v = (0, 0)
  boundary u: all = 0
  initial u = if(x < 0.4 and y > 0.3, 1, 0)
  time 0 .. 100*50/(4*32^2), step 50/(4*32^2)
}
)";
  std::string still = text, moving = text;
  still.replace(still.find("-advect(v, u) + "), 16, "").replace(still.find("param v; "), 9, "");
  still.erase(still.find("  v = (0, 0)\n"), 13);
  moving.replace(moving.find("param v; "), 9, "").replace(moving.find("advect(v, u)"), 12, "advect((3, 3), u)");
  moving.erase(moving.find("  v = (0, 0)\n"), 13);
  for (const char* scheme : {"backward_euler", "crank_nicolson", "ars222", "ars443"}) {
    const std::vector<double> u = run_scene(still, "jump", {{"time", scheme}}).state.at("u");
    EXPECT_LT(largest_size(u), std::string(scheme) == "crank_nicolson" ? 1.0 : 1e-9) << scheme;
  }
  for (const char* scheme : {"imex_euler", "ars222", "ars443"}) {
    const std::vector<double> u = run_scene(moving, "jump", {{"time", scheme}}).state.at("u");
    EXPECT_LT(largest_size(u), 1e-10) << scheme;
  }
}

std::string implicit_task(const std::string& time, int rank, bool periodic) {
  std::string text =
      "model m { vector u; field q; coefficient k; param c; dt(u) = -c*advect(u, u) + k*lap(u) - dot(u, u)*u\n"
      "  dt(q) = -advect(u, q) + c*0.01*(div(k*grad(q)) + dx(u.x)) + sin(3*t)*x }\n";
  if (time == "crank_nicolson" || time == "backward_euler")
    text =
        "model m { vector u; field q; coefficient k; param c; dt(u) = k*lap(u); dt(q) = c*div(k*grad(q)) + cos(t)*x "
        "}\n";
  text += "scheme p { time = " + time + " }\nscene s : m with p {\n  c = 0.9\n  k = 0.02 + 0.01*sin(2*pi*x)\n";
  for (int axis = 0; axis < rank; ++axis)
    text += "  " + grid(std::string(1, "xy"[axis]), axis == 0 ? 9 : 6, periodic || axis > 0);
  const std::string low = rank == 1 ? "0.2*cos(t)" : "(0.2*cos(t), 0.1)";
  if (!periodic)
    text += "  boundary u: x.low = " + low +
            ", x.high = zero_gradient\n  boundary q: x.low = mixed(1, c, t), x.high = 0.1\n";
  text += rank == 1 ? "  initial u = 0.3*sin(4*pi*x + 0.3) + 0.07\n"
                    : "  initial u = (0.3*sin(4*pi*x + 0.3) + 0.07, 0.2*cos(2*pi*y*40/6) + 0.03)\n";
  return text +
         "  initial q = 0.5 + 0.4*cos(4*pi*x + 1)\n  time 0 .. 0.05, step 0.01\n}\n"
         "task t : s {\n  unknown c\n  unknown k\n  unknown initial u\n  unknown initial q\n"
         "  minimise mean(dot(u, u) + q^2)\n}\n";
}

/// Walls with values and slopes that vary in time and along the walls, for each component.
std::string staggered_task(const std::string& time, const std::string& cells) {
  return "model m { vector u on faces; field w on nodes; coefficient k; param c\n"
         "  dt(u) = -advect(u, u) + c*lap(u) - grad(dot(interpolate(u), interpolate(u)))\n"
         "  dt(w) = c*lap(w) + dx(u.y) }\n"
         "scheme p { time = " +
         time +
         " }\nscene s : m with p {\n  c = 0.03\n  k = 0.05 + 0.01*x\n"
         "  grid x = 0 .. 1, cells " +
         cells + "\n  grid y = 0 .. 1, cells " + cells +
         "\n"
         "  boundary u.x: x.low = 0.2*cos(t)*y, x.high = zero_gradient, y = 0.1\n"
         "  boundary u.y: x.low = 0.3, x.high = gradient(t), y.low = c*x, y.high = 0\n"
         "  boundary w: x = 0, y.low = zero_gradient, y.high = sin(t)\n"
         "  initial u = (0.2*y + 0.3*x*sin(4*y), 0.2*sin(3*x)*y)\n  initial w = x*y\n"
         "  time 0 .. 0.25, step 0.05\n}\n"
         "task t : s {\n  unknown c\n  unknown initial u\n  unknown initial w\n"
         "  minimise mean(dot(interpolate(u), interpolate(u)) + interpolate(w)^2)\n}\n";
}

TEST(ImplicitSchemes, SolveForWhatLiesOnWalls) {
  const std::string text = staggered_task("ars222", "5");
  const SceneResult exact = run_scene(text, "s", {{"time", "rk4"}, {"step", "1/400"}});
  const SceneResult found = run_scene(text, "s", {{"time", "ars443"}, {"step", "1/400"}});
  const SceneResult interpreted =
      run_scene(text, "s", {{"time", "ars443"}, {"step", "1/400"}}, driver::Backend::interpreter);
  for (const char* field : {"u.x", "u.y", "w"}) {
    for (std::size_t i = 0; i < 25; ++i) {
      EXPECT_NEAR(found.state.at(field)[i], exact.state.at(field)[i], 1e-6) << field << i;
      EXPECT_NEAR(interpreted.state.at(field)[i], found.state.at(field)[i], 1e-12) << field << i;
    }
  }
  for (const char* time : {"imex_euler", "ars222"}) expect_certified(staggered_task(time, "4"), false);
}

TEST(ImplicitCertificate, OfAllSchemes) {
  for (std::size_t count = 0;
       const char* scheme : {"backward_euler", "crank_nicolson", "imex_euler", "ars222", "ars443"}) {
    for (const bool periodic : {true, false}) {
      for (const int rank : {1, 2}) {
        if (rank == 2 && periodic && !testing::is_thorough()) continue;
        if (!testing::is_tried(count++, 2)) continue;
        SCOPED_TRACE(fmt::format("{} {} {}", scheme, periodic, rank));
        expect_certified(implicit_task(scheme, rank, periodic), rank == 1);
      }
    }
  }
}

/// In combination with explicit terms: a wave on staggered fields, on a stretched axis, with a Courant number, in f32.
TEST(ImplicitSchemes, GoTogetherWithTheRestOfTheLanguage) {
  const std::string text = R"(
model mixed_up {
  field u, w; field v on faces.x
  param nu
  dt(u) = -dx(v) + nu*lap(u)
  dt(v) = -dx(u)
  dt(dt(w)) = lap(w) - u
}
scheme p { time = ars222; lap = central(4) }
scene s : mixed_up with p {
  grid x = 0 .. 1, cells 24, stretched x + 0.05*sin(2*pi*x)
  nu = 0.3
  boundary u: x = zero_gradient
  boundary v: x = 0
  boundary w: x = 0
  initial u = cos(pi*x)
  initial v = 0
  initial w = sin(pi*x)
  initial dt(w) = 0
  time 0 .. 0.25, step 1/200, courant 0.4, speed 1
}
task t : s { unknown nu; unknown initial u; minimise mean(u^2 + w^2) }
)";
  const std::vector<double> exact = run_scene(text, "s", {{"time", "rk4"}, {"step", "1/20000"}}).state.at("u");
  const std::vector<double> found = run_scene(text, "s").state.at("u");
  const std::vector<double> single = run_scene(text, "s", {{"real", "f32"}}).state.at("u");
  for (std::size_t i = 0; i < exact.size(); ++i) {
    EXPECT_NEAR(found[i], exact[i], 1e-4);
    EXPECT_NEAR(single[i], exact[i], 1e-3);
  }
  expect_certified(text, false);
}

}  // namespace
}  // namespace dpde::testing
