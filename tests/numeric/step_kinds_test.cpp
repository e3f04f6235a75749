// SPDX-License-Identifier: Apache-2.0
// Gradients of steps of each kind combined with other features of a scene, against secants of runs that choose their
// substeps anew. Certificates keep the substeps of one run and would miss dependence on them.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "support/scene_run.h"
#include "support/setting.h"

namespace dpde::testing {
namespace {

struct Kind {
  const char *name, *scheme, *steps;
};
constexpr Kind step_kinds[] = {{"equal steps", "time = rk4", "step 1/32"},
                               {"a Courant number", "time = rk4", "step 1/8, courant 0.3, speed 1 + 0*u"},
                               {"dopri5 under a tolerance", "time = dopri5", "step 1/8, tolerance 1e-10"},
                               {"bs32 under a tolerance", "time = bs32", "step 1/8, tolerance 1e-9"},
                               {"ars443 under a tolerance", "time = ars443", "step 1/8, tolerance 1e-8"}};

/// Additional lines of a model and a scene.
struct Feature {
  const char *name, *declaration, *rate, *item, *held;
};
constexpr Feature step_features[] = {
    {"nothing", "", "", "", ""},
    {"an event at intervals", "", "", "every 1/4: u += 0.1*u^2", ""},
    {"an event at times", "", "", "at t = 1/8, 1/2: u = 0.5*u + 0.2*k", ""},
    {"an event behind each step", "", "", "after step: u = u/(1 + 0.002*k*mean(u))", ""},
    {"a held value", "mask b", "", "b = x < 0.3", "u = 0.4 + k*v inside b"},
    {"a moving mask", "mask b", "", "b = abs(x - 0.3 - 0.2*t) < 0.2", "u = 0.4 + k*v inside b"},
    {"a control", "control F", "F*v + ", "F = sin(3*t) every 1/4", ""},
    {"forcing", "", "sin(4*t)*v*k + ", "", ""},
    {"a solve", "solve lap(psi) - psi = k*u for psi", "0.3*psi + ", "", ""},
    {"a mean", "", "mean(u*v) + ", "", ""},
    {"a network", "", "n(u) + ", "", ""},
    {"an injection", "", "inject(0.3*k*exp(-t), at = 0.4) + ", "", ""}};

constexpr const char* step_losses[] = {"mean(u^2)",
                                       "mean(u^2*v), mean over time",
                                       "mean(u^2), integral over time",
                                       "mean(u^2), sum over time",
                                       "sample(u, at = 0.41)^2 at t = 1/4, 1/2",
                                       "(mean(u^2) - mean(v^2))^2 at t = 3/8"};

std::string scene_of(const Kind& kind, const Feature& feature, const char* loss, double k) {
  return fmt::format(
      "network n(a) {{ real f64; initial xavier, seed 3; dense 4; tanh; dense out }}\n"
      "model m {{\n  field u, v\n  param k\n  {}\n  dt(u) = {}-k*u + 0.02*lap(u) - 0.5*dx(u)\n  dt(v) = u - v\n  "
      "{}\n}}\n"
      "scheme q {{ {} }}\nscene s : m with q {{\n  grid x = 0 .. 1, cells 10, periodic\n  k = {:.17g}\n"
      "  initial u = 1 + 0.3*sin(2*pi*x)\n  initial v = 0.5 + 0.2*cos(2*pi*x)\n  time 0 .. 1, {}\n  {}\n}}\n"
      "task t : s {{ unknown k; minimise {} }}\n",
      feature.declaration, feature.rate, feature.held, kind.scheme, k, kind.steps, feature.item, loss);
}

TEST(StepKinds, GradientsAreThoseOfRunsThatChooseTheirParts) {
  std::size_t count = 0;
  for (const Kind& kind : step_kinds) {
    for (const Feature& feature : step_features) {
      for (const char* loss : step_losses) {
        if (!is_tried(count++, 37)) continue;
        // There, mask values that depend on other fields are refused (E0555).
        if (std::string(kind.scheme).find("ars443") != std::string::npos && feature.held[0] != 0) continue;
        constexpr double k = 0.7, h = 1e-3;
        const auto secant = [&](double width) {
          return (task_loss(scene_of(kind, feature, loss, k + width), "t") -
                  task_loss(scene_of(kind, feature, loss, k - width), "t")) /
                 (2 * width);
        };
        const double slope = (4 * secant(h / 2) - secant(h)) / 3;  // the omitted terms fall as h^4
        const double found = task_gradient(scene_of(kind, feature, loss, k), "t").gradient.at("k").front();
        EXPECT_NEAR(found, slope, 2e-5 * std::max(std::abs(slope), 0.01))
            << kind.name << ", " << feature.name << ", " << loss;
      }
    }
  }
}

}  // namespace
}  // namespace dpde::testing
