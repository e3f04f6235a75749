// SPDX-License-Identifier: Apache-2.0
// Descending axes: a scene and its mirror image give equal arrays, up to the sign of the velocity along the axis;
// outflow is at the low side. The same for gradients, on all back ends.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "../driver/driver_support.h"
#include "support/flow_texts.h"
#include "support/scene_run.h"

namespace dpde::testing {
namespace {

/// Differences between a flow to the right on 0 .. 2 and its mirror image: `s` is x or 2 - x, `v` a velocity along x.
struct Direction {
  bool falls;
  std::string grid() const { return falls ? "x = 2 .. 0" : "x = 0 .. 2"; }
  std::string in() const { return falls ? "x.high" : "x.low"; }
  std::string out() const { return falls ? "x.low" : "x.high"; }
  std::string s() const { return falls ? "(2 - x)" : "x"; }
  std::string v() const { return falls ? "-" : ""; }
  std::string plus() const { return falls ? "-" : "+"; }
  std::string place(double x) const { return fmt::format("{}", falls ? 2 - x : x); }
};
constexpr Direction rightwards{false}, leftwards{true};

/// Flow past a warm obstacle with everything that depends on position and direction: transport, slopes, point sources.
std::string wake(const Direction& d, const std::string& scheme) {
  return fmt::format(R"(
model wake {{
  vector u on faces
  field p, T
  param nu
  param q
  coefficient k
  mask solid
  dt(u) = -advect(u, u) - grad(p) + nu*lap(u)
  dt(T) = -advect(u, T) + div(k*grad(T)) + inject(q, at = ({place}, 0.3)) {plus} 0.1*dx(T)
  0 = div(u) gives p
  u = 0 inside solid
}}
scheme c {{ {scheme} }}
scene s : wake with c {{
  grid {grid}, cells 20
  grid y = 0 .. 1, cells 10
  nu = 0.02
  q = 0.5
  k = 0.01 + 0.004*sin({s} + y)
  solid = ({s} - 0.6)^2 + (y - 0.5)^2 < 0.15^2
  initial u = ({v}6*y*(1 - y), 0)
  initial T = exp(-20*(({s} - 0.3)^2 + (y - 0.4)^2))
  boundary u.x: {in} = {v}6*y*(1 - y)*(1 + 0.2*sin(3*t)), {out} = outflow, y = 0
  boundary u.y: {in} = 0, {out} = outflow, y = 0
  boundary T: {in} = y, {out} = gradient(0.1*y), y = mixed(1, 0.5, 0.2)
  time 0 .. 1/4, step 1/64
}}
task t : s {{
  unknown initial u
  unknown initial T
  unknown q
  unknown k
  minimise mean(T^2) + sample(T, at = ({sampled}, 0.4)) {plus} sample(u.x, at = ({near}, 0.5)) {plus} sample(u.x, at = (
    {far}, 0.5)) {plus} integral(dx(T), at = {out}) + integral(u.x^2, at = {out}) {plus} integral(u.x, at = {in}) +
    integral(dx(u.x), at = {in}) {plus} 0.1*force_on(solid, u.x) + mean(u.y^2*{s})
}}
)",
                     fmt::arg("place", d.place(0.83)), fmt::arg("sampled", d.place(1.37)),
                     fmt::arg("near", d.place(0.03)), fmt::arg("far", d.place(1.98)), fmt::arg("grid", d.grid()),
                     fmt::arg("in", d.in()), fmt::arg("out", d.out()), fmt::arg("s", d.s()), fmt::arg("v", d.v()),
                     fmt::arg("plus", d.plus()), fmt::arg("scheme", scheme));
}

/// The largest difference between the fields of the two runs, relative to the largest value.
double difference(const std::map<std::string, std::vector<double>>& right,
                  const std::map<std::string, std::vector<double>>& left) {
  double worst = 0;
  for (const auto& [name, values] : right) {
    const std::vector<double>& image = left.at(name);
    const double sign = name.ends_with(".x") ? -1 : 1;  // also in stored values of a scheme
    double most = 1e-3, apart = 0;
    for (std::size_t i = 0; i < values.size(); ++i) {
      most = std::max(most, std::abs(values[i]));
      apart = std::max(apart, std::abs(values[i] - sign * image[i]));
    }
    worst = std::max(worst, apart / most);
  }
  return worst;
}

const std::vector<std::string> wake_schemes{
    "time = rk4",
    "time = ab2; advect = upwind3",
    "time = rk2; advect = central(4); lap = central(4)",
    "time = ars222; implicit = linear",
    "time = euler; advect = semi_lagrangian",
    "time = ssp_rk3; advect = upwind5",
};

TEST(FallingAxis, MirrorImagesAreTheSameFlow) {
  for (const std::string& scheme : wake_schemes) {
    const auto right = run_scene(wake(rightwards, scheme), "s").state,
               left = run_scene(wake(leftwards, scheme), "s").state;
    EXPECT_LT(difference(right, left), 1e-11) << scheme;
    EXPECT_GT(*std::ranges::max_element(right.at("u.x")), 1.5);  // the fluid moves
  }
}

TEST(FallingAxis, MirrorImagesHaveTheSameGradient) {
  for (const std::string& scheme : {wake_schemes[0], wake_schemes[3], wake_schemes[4]}) {
    const TaskResult right = task_gradient(wake(rightwards, scheme), "t"),
                     left = task_gradient(wake(leftwards, scheme), "t");
    EXPECT_NEAR(right.loss, left.loss, 1e-11 * std::abs(right.loss)) << scheme;
    EXPECT_LT(difference(right.gradient, left.gradient), 1e-10) << scheme;
  }
}

TEST(FallingAxis, BackEndsAgree) {
  const Overrides small{{"cells.x", "8"}, {"cells.y", "5"}};
  const std::string text = wake(leftwards, wake_schemes[0]);
  const auto expected = run_scene(text, "s", small, driver::Backend::interpreter).state;
  for (const auto backend : {driver::Backend::jit, driver::Backend::cpp}) {
    for (const auto& [name, values] : run_scene(text, "s", small, backend).state) {
      for (std::size_t i = 0; i < values.size(); ++i) EXPECT_NEAR(values[i], expected.at(name)[i], 1e-11) << name;
    }
  }
}

/// Poiseuille flow to the left, against the formula: order 2.
TEST(FallingAxis, ChannelFlowGoesOutAtTheLowSide) {
  const std::string text = incompressible_flow + std::string(R"(
scene channel : flow {
  grid x = 2 .. 0, cells 16
  grid y = 0 .. 1, cells 8
  nu = 0.05
  initial u = (-6*y*(1 - y), 0)
  boundary u.x: x.high = -6*y*(1 - y), x.low = outflow, y = 0
  boundary u.y: x.high = 0, x.low = outflow, y = 0
  exact u = (-6*y*(1 - y), 0)
  exact p = 12*nu*x
  time 0 .. 2, step 1/128
}
)");
  std::vector<double> u, p;
  for (const int n : {8, 16, 32}) {
    const auto cells = [&](int count) { return std::to_string(count); };
    const SceneResult run = run_scene(
        text, "channel", {{"cells.x", cells(2 * n)}, {"cells.y", cells(n)}, {"step", n == 32 ? "1/512" : "1/128"}});
    u.push_back(run.l2.at("u.x"));
    p.push_back(run.l2.at("p"));
  }
  EXPECT_LT(u[2], 2e-3);
  EXPECT_NEAR(std::log2(u[1] / u[2]), 2, 0.2);
  EXPECT_NEAR(std::log2(p[1] / p[2]), 2, 0.3);
}

TEST(FallingAxis, IsCertified) {
  const auto certificate = certificate_of(wake(leftwards, wake_schemes[0]), false);
  ASSERT_TRUE(certificate);
  EXPECT_TRUE(certificate->passed());
  EXPECT_LT(certificate->worst(), 1e-11);
}

}  // namespace
}  // namespace dpde::testing
