// SPDX-License-Identifier: Apache-2.0
// Semi-Lagrangian transport of fields on faces and nodes: orders against closed forms, also between walls, flows with a
// constraint, bit-identical back ends, certified derivatives.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "../driver/driver_support.h"
#include "support/flow_texts.h"
#include "support/scene_run.h"
#include "support/setting.h"

namespace dpde::testing {
namespace {

/// The order between two runs, the second with twice the cells and half the step.
double order(const std::string& text, const std::string& scene, const std::string& field, int cells, int parts,
             Overrides overrides) {
  const auto error = [&](int level) {
    overrides["cells"] = std::to_string(cells << level);
    overrides["step"] = "pi/" + std::to_string(parts << level);
    return run_scene(text, scene, overrides).l2.at(field);
  };
  return std::log2(error(0) / error(1));
}

const Overrides linear{{"advect", "semi_lagrangian"}}, cubic{{"advect", "semi_lagrangian(cubic)"}},
    maccormack{{"advect", "maccormack"}}, steady{{"advect", "maccormack_steady"}};

/// v = sin(pi x) vanishes at both walls; along its characteristics tan(pi x/2) grows as exp(pi t).
std::string between_walls(const std::string& on) {
  const std::string text = R"(
function origin(x, t) = 2/pi*atan(tan(pi*x/2)*exp(-pi*t))
model slow { field u ON; dt(u) = -advect(sin(pi*x), u) }
model along { field u ON; dt(u) = -advect((1, sin(pi*y)), u) }
scene even : slow {
  grid x = 0 .. 1, cells 20
  boundary u: x.low = 1, x.high = -1
  initial u = cos(pi*x)
  exact u = cos(pi*origin(x, t))
  time 0 .. pi/8, step pi/64
}
scene odd : slow {
  grid x = 0 .. 1, cells 20
  boundary u: x = 0
  initial u = sin(pi*x)
  exact u = sin(pi*origin(x, t))
  time 0 .. pi/8, step pi/64
}
scene stretched : slow {
  grid x = 0 .. 1, cells 20, stretched (exp(x) - 1)/(exp(1) - 1)
  boundary u: x = 0
  initial u = sin(pi*x)
  exact u = sin(pi*origin(x, t))
  time 0 .. pi/8, step pi/64
}
scene channel : along {
  grid x = 0 .. 2*pi, cells 20, periodic
  grid y = 0 .. 1, cells 20
  boundary u: y.low = 0, y.high = 0
  initial u = sin(x)*sin(pi*y)
  exact u = sin(x - t)*sin(pi*origin(y, t))
  time 0 .. pi/8, step pi/64
}
)";
  std::string result;
  for (std::size_t at = 0; at < text.size(); ++at) {
    const bool is_mark = text.compare(at, 2, "ON") == 0;
    result += is_mark ? on : std::string(1, text[at]);
    at += is_mark;
  }
  return result;
}

TEST(CarriedFaces, AreOfTheOrderOfTheSchemeBetweenWalls) {
  const std::string faces = between_walls("on faces.x"), nodes = between_walls("on nodes");
  for (const char* scene : {"even", "odd", "stretched"}) {
    EXPECT_NEAR(order(faces, scene, "u", 80, 128, linear), 1, 0.15) << scene;
    EXPECT_NEAR(order(faces, scene, "u", 80, 128, maccormack), 2, 0.2) << scene;
    EXPECT_NEAR(order(faces, scene, "u", 80, 128, steady), 2, 0.2) << scene;
  }
  EXPECT_NEAR(order(nodes, "channel", "u", 40, 64, linear), 1, 0.2);
  EXPECT_NEAR(order(nodes, "channel", "u", 40, 64, maccormack), 2, 0.3);
}

/// With short steps only the interpolation error matters; with longer ones also the departure points.
TEST(CarriedFaces, CubicsHoldUpToWalls) {
  const std::string faces = between_walls("on faces.x"), nodes = between_walls("on nodes");
  const auto interpolation = [](const std::string& text, const char* scene) {
    const auto error = [&](const char* cells) {
      Overrides overrides = cubic;
      overrides["cells"] = cells;
      overrides["step"] = "pi/8192";
      return run_scene(text, scene, overrides).l2.at("u");
    };
    return std::log2(error("16") / error("32"));
  };
  for (const char* scene : {"even", "odd", "stretched"}) {
    EXPECT_NEAR(interpolation(faces, scene), scene == std::string("stretched") ? 2.5 : 3, 0.3) << scene;
    EXPECT_GT(order(faces, scene, "u", 40, 64, cubic), 1.9) << scene;
  }
  EXPECT_NEAR(interpolation(nodes, "channel"), 3, 0.3);
  EXPECT_GT(order(nodes, "channel", "u", 40, 64, cubic), 1.9);
}

/// Long steps lead beyond both walls from every point: the value there is the one on the wall.
TEST(CarriedFaces, BeyondWallsFindWhatLiesOnThem) {
  const std::string text = R"(
model m { field u on faces.x; param v; dt(u) = -advect(v, u) }
scene s : m {
  grid x = 0 .. 1, cells 5
  boundary u: x.low = 3, x.high = 7
  initial u = 1 + x
  v = 1
  time 0 .. 1, step 1
}
)";
  for (const Overrides& scheme : {linear, maccormack, cubic}) {
    for (const auto& [v, wall] : {std::pair{"100", 3.0}, std::pair{"-100", 7.0}}) {
      Overrides overrides = scheme;
      overrides["v"] = v;
      const std::vector<double> u = run_scene(text, "s", overrides).state.at("u");
      for (std::size_t i = 0; i + 1 < u.size(); ++i) EXPECT_DOUBLE_EQ(u[i], wall) << i;
      EXPECT_DOUBLE_EQ(u.back(), 7);
    }
  }
  // half a cell from the low wall: first the mean of the wall and the first inner face, then of the first two faces
  Overrides half = linear;
  half["v"] = "0.1";
  const std::vector<double> u = run_scene(text, "s", half).state.at("u");
  EXPECT_NEAR(u[0], (3 + 1.2) / 2, 1e-14);
  EXPECT_NEAR(u[1], (1.2 + 1.4) / 2, 1e-14);
}

const std::string flow = incompressible_flow + std::string(R"(
model flow_around {
  vector u on faces
  field p, T
  mask solid
  dt(u) = -advect(u, u) - grad(p) + 0.02*lap(u)
  dt(T) = -advect(u, T)
  0 = div(u) gives p
  u = 0 inside solid
}
scheme at_once { advect = semi_lagrangian; time = euler }
scheme in_parts { advect = semi_lagrangian; time = euler; split = lie(advect, sources, diffusion) }
scheme solving { advect = semi_lagrangian; time = imex_euler; split = lie(advect, sources, diffusion) }
scene taylor_green : flow {
  grid x = 0 .. 2*pi, cells 64, periodic
  grid y = 0 .. 2*pi, cells 64, periodic
  nu = 0.01
  initial u = (sin(x)*cos(y), -cos(x)*sin(y))
  exact u = (sin(x)*cos(y)*exp(-2*nu*t), -cos(x)*sin(y)*exp(-2*nu*t))
  time 0 .. pi/4, step pi/64
}
scene channel : flow {
  grid x = 0 .. 2, cells 16
  grid y = 0 .. 1, cells 8
  nu = 0.05
  initial u = (6*y*(1 - y), 0)
  boundary u.x: x.low = 6*y*(1 - y), x.high = outflow, y = 0
  boundary u.y: x.low = 0, x.high = outflow, y = 0
  time 0 .. 2, step 1/16
}
scene around : flow_around {
  grid x = 0 .. 2, cells 20
  grid y = 0 .. 1, cells 10
  solid = (x - 0.6)^2 + (y - 0.5)^2 < 0.2^2
  initial u = 0
  initial T = y
  boundary u.x: x.low = 6*y*(1 - y), x.high = outflow, y = 0
  boundary u.y: x.low = 0, x.high = outflow, y = 0
  boundary T: x.low = y, x.high = outflow, y = zero_gradient
  observe divergence = max(abs(div(u)))
  time 0 .. 1, step 1/20
}
)");

std::string by(const std::string& scheme, const std::string& scene) {
  std::string text = flow;
  const std::size_t at = text.find("scene " + scene + " : "), end = text.find(" {", at);
  return text.insert(end, " with " + scheme);
}

/// The projection at the end of the step causes this error; interpolation errors have the same order only in the linear
/// case.
TEST(CarriedFaces, VorticesAreOfOrderOneInTime) {
  for (const char* scheme : {"at_once", "in_parts", "solving"}) {
    const std::string text = by(scheme, "taylor_green");
    for (const Overrides& advect : {linear, cubic, maccormack})
      EXPECT_NEAR(order(text, "taylor_green", "u.x", 32, 32, advect), 1, 0.1) << scheme;
    const auto error = [&](const Overrides& advect) { return run_scene(text, "taylor_green", advect).l2.at("u.x"); };
    EXPECT_LT(error(cubic), 0.5 * error(linear));
    EXPECT_LT(error(maccormack), 0.5 * error(linear));
  }
}

/// Inflow equals outflow, and the profile stays except for the effect of the projection at the end of the step on
/// walls.
TEST(CarriedFaces, ChannelFlowGoesOut) {
  for (const char* scheme : {"at_once", "in_parts", "solving"}) {
    const auto error = [&](int cells, const char* step) {
      const auto u =
          run_scene(by(scheme, "channel"), "channel",
                    {{"cells.x", std::to_string(2 * cells)}, {"cells.y", std::to_string(cells)}, {"step", step}})
              .state.at("u.x");
      double largest = 0, out = 0;
      for (std::size_t i = 0; i < u.size(); ++i) {
        const double y = (static_cast<double>(i / (2 * cells)) + 0.5) / cells;
        largest = std::max(largest, std::abs(u[i] - 6 * y * (1 - y)));
        if (static_cast<int>(i) % (2 * cells) == 2 * cells - 1) out += (u[i] - 6 * y * (1 - y)) / cells;
      }
      EXPECT_LT(std::abs(out), 1e-12) << scheme;
      return largest;
    };
    EXPECT_LT(error(16, "1/64"), 0.55 * error(8, "1/32")) << scheme;
  }
}

/// Around an obstacle: the mask's values and the constraint hold at the end of each step.
TEST(CarriedFaces, GoRoundObstacles) {
  for (const char* scheme : {"at_once", "in_parts", "solving"}) {
    for (const Overrides& advect : {linear, maccormack}) {
      const auto state = run_scene(by(scheme, "around"), "around", advect).state;
      const std::vector<double>&x = state.at("u.x"), &y = state.at("u.y");
      double divergence = 0, held = 0;
      for (int j = 0; j < 10; ++j) {
        for (int i = 0; i < 20; ++i) {
          const std::size_t at = static_cast<std::size_t>(j * 20 + i);
          const double low = (j + 0.5) / 10, in = 6 * low * (1 - low), west = i > 0 ? x[at - 1] : in,
                       south = j > 0 ? y[at - 20] : 0;
          const bool solid = std::hypot((i + 0.5) / 10 - 0.6, low - 0.5) < 0.2;
          divergence = std::max(divergence, std::abs(x[at] - west + y[at] - south));
          if (solid) held = std::max({held, std::abs(x[at]), std::abs(west), std::abs(y[at]), std::abs(south)});
        }
      }
      EXPECT_LT(divergence, 1e-12) << scheme;
      EXPECT_EQ(held, 0) << scheme;
      EXPECT_GT(*std::ranges::max_element(x), 1.5) << scheme;
      EXPECT_LE(*std::ranges::max_element(state.at("T")), 1) << scheme;
    }
  }
}

TEST(CarriedFaces, AreTheSameOnAllBackEnds) {
  for (std::size_t count = 0; const Overrides& advect : {linear, cubic, maccormack, steady}) {
    for (const auto& [text, scene] :
         {std::pair{by("in_parts", "around"), "around"}, std::pair{between_walls("on nodes"), "channel"}}) {
      if (advect == cubic && scene == std::string("around")) continue;  // many kernels with many terms
      if (!testing::is_tried(count++, 2)) continue;
      Overrides small = advect;
      small["cells.x"] = "8";
      small["cells.y"] = "5";
      const auto expected = run_scene(text, scene, small, driver::Backend::interpreter).state;
      for (const auto backend : {driver::Backend::jit, driver::Backend::cpp}) {
        for (const auto& [name, values] : run_scene(text, scene, small, backend).state) {
          for (std::size_t i = 0; i < values.size(); ++i) EXPECT_NEAR(values[i], expected.at(name)[i], 1e-12) << name;
        }
      }
    }
  }
}

/// Tangent against adjoint on all small grids, and slopes of the loss.
void expect_certified_but_for_kinks(const std::string& text) {
  const auto certificate = certificate_of(text, false);
  ASSERT_TRUE(certificate);
  EXPECT_TRUE(certificate->passed()) << text;
  EXPECT_LT(certificate->worst(), 1e-11) << text;
}

TEST(CarriedFaces, AreCertified) {
  for (std::size_t count = 0; const char* on : {"on faces.x", "on nodes"}) {
    for (const char* advect : {"semi_lagrangian", "maccormack", "maccormack(steady)"}) {
      if (advect == std::string("maccormack") && !testing::is_thorough()) continue;
      if (!testing::is_tried(count++, 2)) continue;
      const std::string text = fmt::format(
          "model m {{ vector u on faces; field q {}; param c; dt(u) = -advect(c*u, u) + 0.002*lap(u); dt(q) = "
          "-advect(u, q) "
          "+ c*q }}\nscheme p {{ advect = {}; time = euler }}\nscene s : m with p {{\n  c = 1\n  {}  {}"
          "  boundary u: x.low = (0.2, 0.1), x.high = (0, 0)\n  boundary q: x.low = 0.3, x.high = zero_gradient\n"
          "  initial u = (0.3*sin(4*pi*x + 0.3) + 0.07, 0.2*cos(2*pi*y*40/6) + 0.03)\n"
          "  initial q = 0.5 + 0.4*cos(4*pi*x + 1)\n  time 0 .. 0.2, step 0.05\n}}\n"
          "task t : s {{ unknown initial u; unknown initial q; unknown c; minimise mean(u.x^2) + mean(u.y^2) + "
          "mean(q^2) }}\n",
          on, advect, grid("x", 20, false), grid("y", 6));
      expect_certified_but_for_kinks(text);
    }
  }
  expect_certified_but_for_kinks(
      between_walls("on faces.x").replace(0, 0, "scheme q { advect = semi_lagrangian(cubic); time = euler }\n") +
      "task t : odd with q { unknown initial u; minimise mean(u^4) }\n");
  for (const char* scheme : {"at_once", "in_parts", "solving"})
    expect_certified_but_for_kinks(
        by(scheme, "around") +
        "task t : around { unknown initial u; unknown initial T; minimise mean(u.x^2) + mean(u.y^2) + mean(T^2) }\n");
}

}  // namespace
}  // namespace dpde::testing
