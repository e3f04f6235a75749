// SPDX-License-Identifier: Apache-2.0
// White noise: pinned values, statistics within bounds for the chosen seeds, equality on every back end, and gradients
// through it.
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "../driver/driver_support.h"
#include "dpde/runtime/random.h"
#include "support/scene_run.h"

namespace dpde::testing {
namespace {

using Values = std::vector<double>;

std::string scene(const std::string& initial, const std::vector<int>& cells,
                  const std::string& scheme = "time = euler") {
  std::string grid;
  for (std::size_t axis = 0; axis < cells.size(); ++axis)
    grid += std::string("  grid ") + "xyz"[axis] + " = 0 .. 1, cells " + std::to_string(cells[axis]) + ", periodic\n";
  return "model m { field u; dt(u) = 0 }\nscheme c { " + scheme + " }\nscene s : m with c {\n" + grid +
         "  initial u = " + initial + "\n  time 0 .. 1, step 1\n}\n";
}

Values noise(const std::string& seed, const std::vector<int>& cells, driver::Backend backend = driver::Backend::jit) {
  return run_scene(scene("noise(" + seed + ")", cells), "s", {}, backend).state.at("u");
}

/// The mean of a[i]*b[i + shift], cyclic.
double correlation(const Values& a, const Values& b, std::size_t shift = 0) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[(i + shift) % b.size()];
  return sum / static_cast<double>(a.size());
}

double moment(const Values& u, int order) {
  double sum = 0;
  for (const double value : u) sum += std::pow(value, order);
  return sum / static_cast<double>(u.size());
}

/// Known-answer tests of Random123, the authors' library (kat_vectors).
TEST(Philox, GivesTheKnownAnswers) {
  using Words = std::array<std::uint32_t, 4>;
  EXPECT_EQ(philox({0, 0, 0, 0}, {0, 0}), (Words{0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8}));
  EXPECT_EQ(philox({~0u, ~0u, ~0u, ~0u}, {~0u, ~0u}), (Words{0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd}));
  EXPECT_EQ(philox({0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344}, {0xa4093822, 0x299f31d0}),
            (Words{0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1}));
}

/// Computed from the published description by a program in another language.
TEST(Noise, IsWhatItAlwaysWas) {
  const Values seven = noise("7", {4}), eight = noise("8", {2, 2});
  const Values expected_seven{0.6510652288674289, 0.6532465416483482, 1.7953132971132886, 1.0690206628926218};
  const Values expected_eight{-0.8193490960356807, 1.1052438510612628, -1.7390442428200714, 0.3599555393047092};
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_NEAR(seven[i], expected_seven[i], 1e-14);
    EXPECT_NEAR(eight[i], expected_eight[i], 1e-14);
  }
  EXPECT_EQ(noise("7", {2, 1, 2}), seven);  // depends on the cell number
}

/// Four standard deviations of each estimate for n independent numbers: 1/sqrt(n) for means and correlations, sqrt(2/n)
/// for the variance, sqrt(15/n) for the third moment, sqrt(96/n) for the fourth.
TEST(Noise, IsStandardNormalAndIndependent) {
  for (const auto& cells : std::vector<std::vector<int>>{{20000}, {160, 125}, {25, 40, 20}}) {
    const Values u = noise("3", cells), other = noise("4", cells);
    const double unit = 4 / std::sqrt(static_cast<double>(u.size()));
    EXPECT_NEAR(moment(u, 1), 0, unit);
    EXPECT_NEAR(moment(u, 2), 1, std::sqrt(2) * unit);
    EXPECT_NEAR(moment(u, 3), 0, std::sqrt(15) * unit);
    EXPECT_NEAR(moment(u, 4), 3, std::sqrt(96) * unit);
    std::size_t stride = 1;
    for (const int n : cells) {  // neighbours along each axis
      EXPECT_NEAR(correlation(u, u, stride), 0, unit);
      stride *= static_cast<std::size_t>(n);
    }
    EXPECT_NEAR(correlation(u, other), 0, unit);
    EXPECT_NEAR(correlation(u, other, 1), 0, unit);
    const auto below = [&](double x) {
      return static_cast<double>(std::ranges::count_if(u, [&](double v) { return v < x; })) /
             static_cast<double>(u.size());
    };
    for (const double x : {-2.0, -1.0, -0.3, 0.0, 0.5, 1.5})
      EXPECT_NEAR(below(x), std::erfc(-x / std::sqrt(2)) / 2, unit / 2);
  }
}

TEST(Noise, IsTheSameOnEveryBackEnd) {
  const Values jit = noise("5", {7, 3});
  EXPECT_EQ(noise("5", {7, 3}, driver::Backend::interpreter), jit);
  EXPECT_EQ(noise("5", {7, 3}, driver::Backend::cpp), jit);
  const Values single = run_scene(scene("noise(5)", {7, 3}, "time = euler; real = f32"), "s").state.at("u");
  for (std::size_t i = 0; i < jit.size(); ++i) EXPECT_EQ(single[i], static_cast<double>(static_cast<float>(jit[i])));
}

/// In functions of the file, for staggered fields and on stretched axes: one number per cell.
TEST(Noise, StandsInFormulas) {
  const SceneResult result = run_scene(
      "function rough(a, s) = a*noise(11) + s\n"
      "model m { vector u on faces; dt(u.x) = 0; dt(u.y) = 0 }\nscheme c { time = euler }\nscene s : m with c {\n"
      "  grid x = 0 .. 1, cells 4, periodic\n  grid y = 0 .. 1, cells 3, periodic, stretched y + "
      "0.1*sin(2*pi*y)/(2*pi)\n"
      "  initial u = (rough(2, x), noise(12) - noise(11))\n  time 0 .. 1, step 1\n}\n",
      "s");
  for (std::size_t i = 0; i < 12; ++i) {
    EXPECT_NEAR(result.state.at("u.x")[i], 2 * normal(11, i) + static_cast<double>(i % 4 + 1) / 4, 1e-14);
    EXPECT_NEAR(result.state.at("u.y")[i], normal(12, i) - normal(11, i), 1e-14);
  }
}

/// u = a*noise, so d mean(u^2)/da = 2a*mean(noise^2); also through a coefficient.
TEST(Noise, GradientByItsAmplitude) {
  const std::string text =
      "model m { field u; coefficient f; param a, b; dt(u) = f }\nscheme c { time = euler }\nscene s : m with c {\n  "
      "grid x = 0 .. 1, cells 9, periodic\n"
      "  a = 0.5\n  b = 0.25\n  f = b*noise(2)\n  initial u = a*noise(1)\n  time 0 .. 1, step 1/4\n}\n"
      "task t : s {\n  unknown a from 0.5\n  unknown b from 0.25\n  minimise mean(u^2)\n}\n";
  double by_a = 0, by_b = 0;
  for (std::size_t i = 0; i < 9; ++i) {
    const double u = 0.5 * normal(1, i) + 0.25 * normal(2, i);
    by_a += 2 * u * normal(1, i) / 9;
    by_b += 2 * u * normal(2, i) / 9;
  }
  const TaskResult result = task_gradient(text, "t");
  EXPECT_NEAR(result.gradient.at("a")[0], by_a, 1e-14);
  EXPECT_NEAR(result.gradient.at("b")[0], by_b, 1e-14);
}

TEST(Noise, DerivativesAreCertified) {
  expect_certified(
      "model m { field u; coefficient f; param a, k; dt(u) = k*lap(u) + f*u^2 }\nscheme c { time = rk2 }\nscene s : m "
      "with c {\n"
      "  grid x = 0 .. 1, cells 9\n  boundary u: x = zero_gradient\n  a = 0.3\n  k = 0.002\n  f = a*noise(5)\n  "
      "initial u = 1 + a*noise(6)\n  time 0 .. 1/4, step 1/64\n}\n"
      "task t : s {\n  unknown a\n  unknown initial u from a*noise(9)\n  unknown k\n  minimise mean(u^2)\n}\n",
      true);
}

}  // namespace
}  // namespace dpde::testing
