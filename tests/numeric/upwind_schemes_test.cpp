// SPDX-License-Identifier: Apache-2.0
// Upwind differences of order 5 and 7, weno and muscl: orders against closed forms, behaviour at jumps, and
// conservation, on the compiled kernels.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "support/scene_run.h"
#include "support/setting.h"

namespace dpde {
namespace {

using driver::Backend;
using testing::run_scene;

/// A ring of length 1 that turns at speed c; `profile` is a formula of s.
std::string scene_on_ring(const std::string& profile, const std::string& advect, int cells, double courant, double end,
                          double c = 1, const std::string& time = "ssp_rk3") {
  const double step = courant / cells / std::abs(c);
  return fmt::format(
      "function p(s) = {}\nmodel m {{ field u; dt(u) = -advect({}, u) }}\nscheme q {{ advect = {}; time = {} }}\n"
      "scene s : m with q {{\n  grid x = 0 .. 1, cells {}, periodic\n  initial u = p(x)\n  exact u = p(x - ({})*t)\n"
      "  time 0 .. {}, step {}\n}}\n",
      profile, c, advect, time, cells, c, end, end / std::ceil(end / step - 1e-9));
}

const std::string two_waves = "sin(2*pi*s) + 0.3*cos(4*pi*s)";
const std::string square = "if(fraction(s) > 0.2, if(fraction(s) < 0.55, 1, 0), 0)";

std::vector<double> end_of(const std::string& text, Backend backend = Backend::jit) {
  return run_scene(text, "s", {}, backend).state.at("u");
}

/// Mean and largest difference from the formula at the end.
struct Errors {
  double mean = 0, largest = 0;
};
Errors errors_of(const std::string& text, const std::function<double(double)>& exact) {
  const std::vector<double> u = end_of(text);
  Errors errors;
  for (std::size_t i = 0; i < u.size(); ++i) {
    const double error = std::abs(u[i] - exact((static_cast<double>(i) + 0.5) / static_cast<double>(u.size())));
    errors.mean += error / static_cast<double>(u.size());
    errors.largest = std::max(errors.largest, error);
  }
  return errors;
}

double wave_at(double s) { return std::sin(2 * M_PI * s) + 0.3 * std::cos(4 * M_PI * s); }

struct Design {
  std::string advect;
  double order;
  int cells;       // of the coarser grid
  double courant;  // small if the order in space exceeds that in time
};

/// A quarter of a turn, in both directions.
TEST(UpwindSchemes, HaveTheirOrders) {
  for (const double c : {1.0, -1.0}) {
    for (const Design& d : {Design{"upwind(3)", 3, 64, 0.2},
                            {"upwind(5)", 5, 24, 0.02},
                            {"upwind(7)", 7, 24, 0.02},
                            {"weno(3)", 3, 256, 0.2},
                            {"weno(5)", 5, 64, 0.05}}) {
      const auto exact = [&](double x) { return wave_at(x - c * 0.25); };
      const double coarse =
          errors_of(scene_on_ring(two_waves, d.advect, d.cells, d.courant, 0.25, c, "rk4"), exact).mean;
      const double fine =
          errors_of(scene_on_ring(two_waves, d.advect, 2 * d.cells, d.courant, 0.25, c, "rk4"), exact).mean;
      EXPECT_NEAR(std::log2(coarse / fine), d.order, 0.15) << d.advect << " " << c << " " << coarse << " " << fine;
      EXPECT_GT(fine, 1e-12) << d.advect;
    }
  }
}

/// numerics.md, 17: order about 2 in the mean, about 1 at extrema.
TEST(UpwindSchemes, LimitersLeaveTwoOrdersInTheMean) {
  for (const auto& [advect, mean, largest] :
       {std::tuple{"muscl(minmod)", 1.8, 1.2}, {"muscl(van_leer)", 2.0, 1.3}, {"muscl(mc)", 2.0, 1.3}}) {
    const auto exact = [](double x) { return wave_at(x - 0.25); };
    const Errors coarse = errors_of(scene_on_ring(two_waves, advect, 128, 0.4, 0.25), exact),
                 fine = errors_of(scene_on_ring(two_waves, advect, 256, 0.4, 0.25), exact);
    EXPECT_NEAR(std::log2(coarse.mean / fine.mean), mean, 0.25) << advect;
    EXPECT_NEAR(std::log2(coarse.largest / fine.largest), largest, 0.25) << advect;
  }
}

double variation(const std::vector<double>& u) {
  double sum = 0;
  for (std::size_t i = 0; i < u.size(); ++i) sum += std::abs(u[(i + 1) % u.size()] - u[i]);
  return sum;
}

/// Two turns of a square wave with SSP Runge-Kutta, up to the Courant numbers at which limiters are total variation
/// diminishing: 2/3 for minmod, 1/2 for the others (Harten's theorem: slopes of at most 1 or 2 times a difference).
TEST(UpwindSchemes, LimitersMakeNoNewExtrema) {
  for (const double c : {1.0, -1.0}) {
    for (const auto& [advect, courant] :
         {std::pair{"muscl(minmod)", 0.66}, {"muscl(van_leer)", 0.5}, {"muscl(mc)", 0.5}}) {
      for (const std::string time : {"ssp_rk3", "euler"}) {
        const std::vector<double> u = end_of(scene_on_ring(square, advect, 100, courant, 2, c, time));
        EXPECT_GE(*std::ranges::min_element(u), -1e-14) << advect << time;
        EXPECT_LE(*std::ranges::max_element(u), 1 + 1e-14) << advect << time;
        EXPECT_LE(variation(u), 2 + 1e-12) << advect << time;
      }
    }
  }
}

TEST(UpwindSchemes, WenoHardlyMakesNewExtrema) {
  for (const std::string advect : {"weno(3)", "weno(5)"}) {
    const std::vector<double> u = end_of(scene_on_ring(square, advect, 100, 0.4, 2));
    EXPECT_GE(*std::ranges::min_element(u), -1e-3) << advect;
    EXPECT_LE(*std::ranges::max_element(u), 1 + 1e-3) << advect;
    EXPECT_LE(variation(u), 2 + 4e-3) << advect;
  }
  // upwind(5) does: some 10 % beyond both.
  const std::vector<double> u = end_of(scene_on_ring(square, "upwind(5)", 100, 0.4, 2));
  EXPECT_LT(*std::ranges::min_element(u), -0.05);
  EXPECT_GT(variation(u), 2.2);
}

/// The step is independent of units and offsets: u -> a + b*u.
TEST(UpwindSchemes, DoNotKnowUnits) {
  for (const std::string advect : {"weno(3)", "weno(5)", "muscl(minmod)", "muscl(van_leer)", "muscl(mc)"}) {
    const std::vector<double> plain = end_of(scene_on_ring(square, advect, 50, 0.4, 0.3));
    const std::vector<double> scaled = end_of(scene_on_ring("1e-8*(" + square + ")", advect, 50, 0.4, 0.3));
    for (std::size_t i = 0; i < plain.size(); ++i) EXPECT_NEAR(scaled[i], 1e-8 * plain[i], 1e-16) << advect << i;
  }
}

/// So are gradients of losses linear in u: products of differences and squares of their sums stay within range.
TEST(UpwindSchemes, LimitersKnowNoRange) {
  if (!testing::is_thorough()) GTEST_SKIP() << "at night";
  const auto task = [](const std::string& advect, const std::string& real, double height) {
    std::string text = scene_on_ring(fmt::format("{}*({})", height, two_waves), advect, 50, 0.4, 0.3);
    text.insert(text.find("time = "), "real = " + real + "; ");
    return text + "task t : s { unknown initial u; minimise mean(u*cos(2*pi*x)) }\n";
  };
  for (const std::string advect : {"muscl(minmod)", "muscl(van_leer)", "muscl(mc)"}) {
    for (const auto& [real, height, tolerance] :
         {std::tuple{"f64", 1e-25, 1e-12}, {"f64", 1e100, 1e-12}, {"f32", 1e-18, 1e-4}, {"f32", 1e20, 1e-4}}) {
      const std::vector<double> plain = end_of(task(advect, "f64", 1)), high = end_of(task(advect, real, height));
      const auto expected = testing::task_gradient(task(advect, "f64", 1), "t").gradient.at("u"),
                 gradient = testing::task_gradient(task(advect, real, height), "t").gradient.at("u");
      for (std::size_t i = 0; i < plain.size(); ++i) {
        EXPECT_NEAR(high[i] / height, plain[i], tolerance) << advect << real << height << " " << i;
        EXPECT_NEAR(50 * gradient[i], 50 * expected[i], 10 * tolerance) << advect << real << height << " " << i;
      }
    }
  }
}

/// Weno's weights, too, for values from 1e-27 to 1e30 in both precisions: it limits jumps and keeps its order.
TEST(UpwindSchemes, WenoKnowsNoRange) {
  if (!testing::is_thorough()) GTEST_SKIP() << "at night: seven seconds";
  const auto scene = [](const std::string& profile, const std::string& advect, const std::string& real, double height) {
    std::string text = scene_on_ring(fmt::format("{}*({})", height, profile), advect, 50, 0.4, 0.3);
    text.insert(text.find("time = "), "real = " + real + "; ");
    return text + "task t : s { unknown initial u; minimise mean(u*cos(2*pi*x)) }\n";
  };
  for (const std::string advect : {"weno(3)", "weno(5)"}) {
    for (const std::string& profile : {two_waves, square}) {
      const std::string plain_scene = scene(profile, advect, "f64", 1);
      const std::vector<double> plain = end_of(plain_scene);
      const auto expected = testing::task_gradient(plain_scene, "t").gradient.at("u");
      for (const std::string real : {"f64", "f32"}) {
        const double tolerance = real == "f64" ? 1e-11 : 2e-4;
        for (std::size_t count = 0; const double height : {1e-27, 1e-9, 1e5, 5e19, 1e30}) {
          if (!testing::is_tried(count++, 2)) continue;
          const std::string text = scene(profile, advect, real, height);
          const std::vector<double> high = end_of(text);
          for (std::size_t i = 0; i < plain.size(); ++i)
            EXPECT_NEAR(high[i] / height, plain[i], tolerance) << advect << real << height << " " << i;
          // On plateaus differences are rounding, and so are slopes of the weights. Those of tiny and huge values
          // exceed the range of f32.
          if (profile == square || (real == "f32" && (height < 1e-18 || height > 1e20))) continue;
          const auto gradient = testing::task_gradient(text, "t").gradient.at("u");
          for (std::size_t i = 0; i < plain.size(); ++i)
            EXPECT_NEAR(50 * gradient[i], 50 * expected[i], 20 * tolerance) << advect << real << height << " " << i;
        }
      }
    }
  }
}

/// In a constant wind the advection of limiters, as of linear schemes, is a difference of face values. That of weno is
/// not.
TEST(UpwindSchemes, KeepMass) {
  const auto drift = [](const std::string& advect) {
    const std::vector<double> u = end_of(scene_on_ring(square, advect, 100, 0.4, 2));
    return std::accumulate(u.begin(), u.end(), 0.0) / static_cast<double>(u.size()) - 0.35;
  };
  for (const std::string advect : {"upwind(5)", "upwind(7)", "muscl(minmod)", "muscl(van_leer)", "muscl(mc)"})
    EXPECT_NEAR(drift(advect), 0, 1e-13) << advect;
  EXPECT_NEAR(drift("weno(3)"), 0, 1e-3);
  EXPECT_NEAR(drift("weno(5)"), 0, 1e-4);
}

/// The difference of a constant is exactly 0.
TEST(UpwindSchemes, LeaveAConstantAlone) {
  for (const std::string advect :
       {"upwind(5)", "upwind(7)", "weno(3)", "weno(5)", "muscl(minmod)", "muscl(van_leer)", "muscl(mc)"}) {
    for (const double u : end_of(scene_on_ring("0.1 + 0*s", advect, 10, 0.4, 1))) EXPECT_EQ(u, 0.1) << advect;
    for (const double u : end_of(scene_on_ring("0*s", advect, 10, 0.4, 1))) EXPECT_EQ(u, 0.0) << advect;
  }
}

/// A wind of both signs, walls, two axes, grids narrower than the stencil, single precision.
TEST(UpwindSchemes, BackEndsAgree) {
  for (std::size_t count = 0; const std::string advect : {"upwind(5)", "upwind(7)", "weno(3)", "weno(5)",
                                                          "muscl(minmod)", "muscl(van_leer)", "muscl(mc)"}) {
    for (const std::string real : {"f64", "f32"}) {
      for (const int cells : {1, 2, 3, 13}) {
        if (real == "f32" && cells < 13 && !testing::is_thorough()) continue;
        if (real == "f64" && !testing::is_tried(count++, 2)) continue;
        const std::string text = fmt::format(
            "model m {{ vector u; field q; dt(u) = -advect(u, u); dt(q) = -advect(u, q) }}\n"
            "scheme c {{ advect = {}; time = ssp_rk3; real = {} }}\nscene s : m with c {{\n"
            "  grid x = 0 .. 1, cells {}\n  grid y = 0 .. 1, cells 5, periodic\n"
            "  boundary u: x.low = (0.2, 0.1), x.high = zero_gradient\n  boundary q: x = 0\n"
            "  initial u = (sin(5*x) + 0.1, cos(2*pi*y) + 0.3)\n  initial q = if(x < 0.5, 1, 0)*sin(2*pi*y)\n"
            "  time 0 .. 0.05, step 0.01\n}}\n",
            advect, real, cells);
        const auto expected = run_scene(text, "s", {}, Backend::interpreter).state;
        std::vector<Backend> backends{Backend::jit};
        if (cells == 13 && (advect == "weno(5)" || testing::is_thorough())) backends.push_back(Backend::cpp);
        for (const Backend backend : backends) {
          const auto got = run_scene(text, "s", {}, backend).state;
          for (const auto& [field, values] : expected) {
            for (std::size_t i = 0; i < values.size(); ++i)
              EXPECT_NEAR(got.at(field)[i], values[i], real == "f64" ? 1e-13 : 1e-5) << advect << cells << field << i;
          }
        }
      }
    }
  }
}

}  // namespace
}  // namespace dpde
