// SPDX-License-Identifier: Apache-2.0
// Rounding over many steps: schemes with several stages store states instead of right-hand sides, without loss of
// accuracy. Compared with the textbook forms of the same schemes in long doubles.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "support/scene_run.h"

namespace dpde::testing {
namespace {

using Real = long double;
using RealValues = std::vector<Real>;
using Rate = std::function<RealValues(const RealValues&)>;

/// a + c*b
RealValues moved(RealValues a, Real c, const RealValues& b) {
  for (std::size_t i = 0; i < a.size(); ++i) a[i] += c * b[i];
  return a;
}

RealValues textbook_step(const std::string& scheme, const RealValues& u, Real dt, const Rate& rate) {
  const RealValues k_1 = rate(u);
  if (scheme == "rk2") return moved(u, dt, rate(moved(u, dt / 2, k_1)));
  if (scheme == "rk4") {
    const RealValues k_2 = rate(moved(u, dt / 2, k_1)), k_3 = rate(moved(u, dt / 2, k_2)),
                     k_4 = rate(moved(u, dt, k_3));
    return moved(moved(moved(moved(u, dt / 6, k_1), dt / 3, k_2), dt / 3, k_3), dt / 6, k_4);
  }
  const RealValues k_2 = rate(moved(u, dt, k_1)), k_3 = rate(moved(moved(u, dt / 4, k_1), dt / 4, k_2));  // ssp_rk3
  return moved(moved(moved(u, dt / 6, k_1), dt / 6, k_2), 2 * dt / 3, k_3);
}

double largest_error(const std::vector<double>& values, const RealValues& exact) {
  Real error = 0;
  EXPECT_EQ(values.size(), exact.size());
  for (std::size_t i = 0; i < values.size(); ++i)
    error = std::max(error, std::abs(static_cast<Real>(values[i]) - exact[i]));
  return static_cast<double>(error);
}

struct Errors {
  double carried, oscillator;
};

constexpr int cells_of_one_axis = 64;

/// Right-hand side of advection by this number of cells per unit time.
Rate carried_by(int speed) {
  return [speed](const RealValues& values) {
    RealValues rate(cells_of_one_axis);
    for (int i = 0; i < cells_of_one_axis; ++i) {
      const Real west = values[(i + cells_of_one_axis - 1) % cells_of_one_axis],
                 east = values[(i + 1) % cells_of_one_axis];
      rate[i] = speed * (west - east) / 2 + (west - 2 * values[i] + east) / 256;
    }
    return rate;
  };
}

/// Errors after `steps` steps of an advected profile with slight diffusion and constant mean, and of an oscillator at
/// each point. Spacing and step are powers of two.
Errors errors_after(int steps, const std::string& scheme, const std::string& real) {
  const std::string text =
      "model m { field u, q, p\n  param nu\n  dt(u) = -dx(u) + nu*lap(u)\n  dt(q) = p\n  dt(p) = -q }\nscheme s { time "
      "= " +
      scheme + "; real = " + real +
      " }\nscene run : m with s {\n  grid x = 0 .. 64, cells 64, periodic\n  nu = 1/256\n"
      "  initial u = 1.3 + 0.5*sin(2*pi*x/64) + 0.2*cos(6*pi*x/64)\n  initial q = 1.25\n  initial p = 0.5 + x/256\n  "
      "time 0 .. " +
      std::to_string(steps) + "/4, step 1/4\n}\n";
  RealValues u(cells_of_one_axis), qp(2 * cells_of_one_axis);
  const Real pi = std::acos(Real(-1));
  for (int i = 0; i < cells_of_one_axis; ++i) {
    const Real x = i + 0.5L;
    u[i] = 1.3L + 0.5L * std::sin(2 * pi * x / 64) + 0.2L * std::cos(6 * pi * x / 64);
    qp[i] = 1.25L;
    qp[cells_of_one_axis + i] = 0.5L + x / 256;
  }
  const Rate oscillator = [](const RealValues& values) {
    RealValues rate(2 * cells_of_one_axis);
    for (int i = 0; i < cells_of_one_axis; ++i) {
      rate[i] = values[cells_of_one_axis + i];
      rate[cells_of_one_axis + i] = -values[i];
    }
    return rate;
  };
  for (int n = 0; n < steps; ++n) {
    u = textbook_step(scheme, u, 0.25L, carried_by(1));
    qp = textbook_step(scheme, qp, 0.25L, oscillator);
  }
  const SceneResult found = run_scene(text, "run");
  const RealValues q(qp.begin(), qp.begin() + cells_of_one_axis);
  return {largest_error(found.state.at("u"), u), largest_error(found.state.at("q"), q)};
}

struct Bound {
  const char* scheme;
  double single, twice;
};

/// With (u_1 + 2*u_2 + u_3 - u)/3 + ... as last stage of rk4 single precision loses 6e-5, double 5e-12; ssp_rk3 in the
/// same form 5e-5 and 1e-11.
TEST(Rounding, OfStatesOverManySteps) {
  for (const Bound& bound :
       {Bound{"rk2", 3.5e-6, 1e-13}, Bound{"rk4", 3.5e-6, 8e-13}, Bound{"ssp_rk3", 3.5e-6, 2.5e-12}}) {
    const Errors single = errors_after(1000, bound.scheme, "f32"), twice = errors_after(100000, bound.scheme, "f64");
    EXPECT_LT(single.carried, bound.single) << bound.scheme;
    EXPECT_GT(single.carried, 1e-8) << "or these were doubles";
    EXPECT_LT(twice.carried, bound.twice) << bound.scheme;
    EXPECT_GT(twice.carried, 0) << "or nothing ran";
    if (bound.scheme != std::string("rk4")) continue;  // with the other schemes oscillators grow or decay
    EXPECT_LT(single.oscillator, 1e-5);
    EXPECT_LT(twice.oscillator, 1.5e-12);
  }
}

/// The adjoint of advection is advection backwards. With the old last stages 3e-5, and in double 3e-12 (rk4), 7e-12
/// (ssp_rk3).
TEST(Rounding, OfGradientsOverManySteps) {
  for (const Bound& bound : {Bound{"rk2", 2e-6, 1e-13}, Bound{"rk4", 2e-5, 2.5e-12}, Bound{"ssp_rk3", 2e-5, 3.5e-12}}) {
    for (const auto& [real, steps, most] : {std::tuple("f32", 1000, bound.single), {"f64", 100000, bound.twice}}) {
      const std::string text =
          std::string("model m { field u\n  param nu\n  dt(u) = -dx(u) + nu*lap(u) }\nscheme s { time = ") +
          bound.scheme + "; real = " + real +
          " }\nscene run : m with s {\n  grid x = 0 .. 64, cells 64, periodic\n  nu = 1/256\n"
          "  initial u = 1.3\n  time 0 .. " +
          std::to_string(steps) +
          "/4, step 1/4\n}\n"
          "task t : run { unknown initial u; minimise sum((0.7 + 0.3*sin(2*pi*x/64))*u) }\n";
      RealValues bar(cells_of_one_axis);
      for (int i = 0; i < cells_of_one_axis; ++i)
        bar[i] = 0.7L + 0.3L * std::sin(2 * std::acos(Real(-1)) * (i + 0.5L) / 64);
      for (int n = 0; n < steps; ++n) bar = textbook_step(bound.scheme, bar, 0.25L, carried_by(-1));
      const double error = largest_error(task_gradient(text, "t").gradient.at("u"), bar);
      EXPECT_LT(error, most) << bound.scheme << " " << real;
    }
  }
}

}  // namespace
}  // namespace dpde::testing
