// SPDX-License-Identifier: Apache-2.0
// sample of formulas, lets, vectors, derivatives and solutions, with arrays of receivers: orders, gradients.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <map>
#include <string>

#include "../driver/driver_support.h"
#include "dpde/runtime/npy.h"
#include "support/scene_run.h"

namespace dpde::testing {
namespace {

std::string pool(const std::string& observed, const std::string& grid_y = "cells 24, periodic") {
  return R"(
model pool {
  vector v on faces
  field q
  param X[3] = (0.21, 0.5, 0.93), a
  solve lap(psi) = q for psi
  let flux = q*dx(psi)
  dt(v) = 0
  dt(q) = 0
}
scheme s { time = rk2 }
scene basin : pool with s {
  grid x = 0 .. 1, cells 24, periodic
  grid y = 0 .. 1, )" +
         grid_y + R"(
  let w = 2*pi
  a = 0.3
  initial v = (1 + 0.5*sin(w*x)*cos(w*y), 0.5*cos(w*x))
  initial q = sin(w*x)*cos(w*y)
  time 0 .. 0.02, step 0.01
  )" + observed +
         "\n}\n";
}

double at_end(const std::string& formula, int cells) {
  const std::string task = "task t : basin {\n  unknown a from 0.3\n  minimise " + formula + " + 0*a\n}\n";
  return task_loss(pool("") + task, "t", {{"cells", std::to_string(cells)}});
}

TEST(FormulaPoints, FieldsAreWhatTheyAreThere) {
  const double w = 2 * M_PI, x = 0.37, y = 0.61;
  const double vx = 1 + 0.5 * std::sin(w * x) * std::cos(w * y), vy = 0.5 * std::cos(w * x);
  const double q = std::sin(w * x) * std::cos(w * y), psi_x = -std::cos(w * x) * std::cos(w * y) / (2 * w);
  const std::string at = ", at = (0.37, 0.61))";
  const std::vector<std::pair<std::string, double>> cases{
      {"sample(q^2 + x" + at, q * q + x},
      {"sample(|v|" + at, std::hypot(vx, vy)},
      {"dot(sample(v" + at + ", (1, 2))", vx + 2 * vy},
      {"sample(dx(q)" + at, w * std::cos(w * x) * std::cos(w * y)},
      {"sample(div(v)" + at, 0.5 * w * std::cos(w * x) * std::cos(w * y)},
      {"sample(psi" + at, -q / (2 * w * w)},
      {"sample(flux" + at, q * psi_x},
      {"sample(mean(v.x) - y" + at, 1 - y}};
  for (const auto& [formula, exact] : cases) {
    const double coarse = std::abs(at_end(formula, 40) - exact), fine = std::abs(at_end(formula, 160) - exact);
    EXPECT_LT(fine, 2e-3) << formula;
    if (coarse > 1e-10) EXPECT_GT(std::log2(coarse / fine), 2.5) << formula;  // over two halvings
  }
}

TEST(FormulaPoints, OfReceiversInAnArray) {
  const std::string text = pool("observe gauge[i] = sample(q, at = (X[i], 0.4))") + R"(
scene truth = basin { a = 0.5; initial q = 0.7*sin(2*pi*x) }
task find : basin {
  data d[i] = gauge[i] from scene truth over time
  unknown initial q
  unknown X[2]
  minimise sum((sample(q, at = (X[i], 0.4)) - d[i])^2, i), sum over time
}
)";
  const TaskResult result = task_gradient(text, "find");
  EXPECT_TRUE(std::isfinite(result.loss));
  EXPECT_GT(result.loss, 0);
  ASSERT_EQ(result.gradient.at("X_2").size(), 1u);
  EXPECT_NE(result.gradient.at("X_2").front(), 0);
}

/// On a cell centre slopes jump. The loss has one of the two slopes, however the centre is rounded: the slopes of all
/// hat functions add up to 0.
TEST(FormulaPoints, SlopesOnCellsAreThoseOfOneSide) {
  const std::string text = R"(
model m { field u, q; param a; dt(u) = inject(1, at = a); dt(q) = 0*q }
scheme s { time = euler; dx = central(2) }
scene s : m with s {
  GRID
  initial u = 0
  initial q = sin(3*x) + x^3
  time 0 .. 1, step 1
}
task source : s { unknown a; minimise mean(u*(sin(3*x) + x^2)) }
task receiver : s { unknown a; minimise sample(x*dx(q), at = a) }
)";
  const auto with = [&](const std::string& grid, bool has_walls) {
    std::string one = text;
    one.replace(one.find("GRID"), 4, grid + (has_walls ? "\n  boundary u = zero_gradient\n  boundary q = linear" : ""));
    return one;
  };
  const std::string ring = with("grid x = 0 .. 1, cells 5, periodic", false),
                    walls = with("grid x = 0 .. 1, cells 5", true),
                    stretched = with("grid x = 0 .. 1, cells 7, stretched x + 0.1*sin(2*pi*x)/pi", true);
  const auto check = [](const std::string& of, const std::string& task, double a, int cells) {
    const std::map<std::string, std::string> here{{"a", fmt::format("{:.17g}", a)}, {"cells", std::to_string(cells)}};
    const TaskResult result = task_gradient(of, task, here);
    const auto slope = [&](double step) {
      std::map<std::string, std::string> there = here;
      there["a"] = fmt::format("{:.17g}", a + step);
      return (task_loss(of, task, there) - result.loss) / step;
    };
    const double right = slope(1e-7), found = result.gradient.at("a").front(), least = 1e-4 * std::abs(right) + 1e-6;
    if (std::abs(found - right) > least) EXPECT_NEAR(found, slope(-1e-7), least) << right << task << " " << a << of;
  };
  for (const char* task : {"source", "receiver"}) {
    for (const int cells : {3, 5, 7}) {
      for (int i = 0; i < cells; ++i) {
        check(ring, task, (i + 0.5) / cells, cells);
        if (cells == 5) check(walls, task, (i + 0.5) / cells, cells);
      }
    }
    const double xi = 1.5 / 7;
    check(stretched, task, xi + 0.1 * std::sin(2 * M_PI * xi) / M_PI, 7);
  }
}

/// In curvilinear coordinates expressions of neighbours are read with the metric factors at the point.
TEST(FormulaPoints, OfDifferencesInCurvesAreThoseOfAField) {
  for (const char* formula : {"lap(q)", "div(v)", "curl(v)", "grad(q).x", "2*lap(q)*q", "div(q*grad(q))"}) {
    const std::string text = std::string(R"(
model m { vector v; field q, r; param a = 0; dt(v) = 0*v; dt(q) = 0*q; dt(r) = )") +
                             formula + R"( + 0*a }
scheme s { time = euler }
scene s : m with s {
  coordinates sphere(2)
  grid lon = 0 .. 2*pi, cells 8, periodic
  grid lat = -pi/2 .. pi/2, cells 4
  boundary v: lat = pole
  boundary q: lat = pole
  boundary r: lat = pole
  initial v = (sin(lon + 0.3), cos(2*lat))
  initial q = cos(lat)*cos(lon) + sin(lat)
  initial r = 0
  time 0 .. 1, step 1
}
task formula : s { unknown a; minimise sample(FORMULA, at = (0.3, 1.1)) }
task field : s { unknown a; minimise sample(r, at = (0.3, 1.1)) at t = 1 }
)";
    std::string one = text;
    one.replace(one.find("FORMULA"), 7, formula);
    EXPECT_NEAR(task_loss(one, "formula"), task_loss(one, "field"), 1e-12) << formula;
  }
}

/// Fields that only the sample reads are provided.
TEST(FormulaPoints, ReadCoefficientsAndDataOfTheirOwn) {
  const std::string text = R"(
model m {
  field u
  coefficient c, e[2]
  coefficient vector q
  coefficient f on faces.x
  control field G
  mask k
  param b = 0.5
  let w = b*c
  dt(u) = -b*u
}
scene s : m {
  grid x = 0 .. 1, cells 4, periodic
  c = 0.5 + x; e[i] = i + x; q = 1 + x; f = 3; G = 2 + x every 0.05; k = x > 0.1
  initial u = 1
  time 0 .. 0.1, step 0.05
}
task t : s { data d = load("d.npy"); unknown b; minimise b*sample(FORMULA, at = 0.3) }
)";
  const std::vector<std::pair<std::string, double>> cases{{"c", 0.4}, {"w", 0.2},  {"e[2]", 1.15}, {"q.x", 0.65},
                                                          {"f", 1.5}, {"G", 1.15}, {"k", 0.5},     {"d", 1.1}};
  const std::filesystem::path folder = ::testing::TempDir() + "dpde_points";
  std::filesystem::create_directories(folder);
  write_npy(folder / "d.npy", std::vector<std::int64_t>{4}, std::vector<double>(4, 2.2));
  for (const auto& [formula, exact] : cases) {
    std::string one = text;
    one.replace(one.find("FORMULA"), 7, formula);
    const TaskResult result = task_gradient(one, "t", {}, folder / "test.dpde");
    EXPECT_NEAR(result.loss, exact, 1e-12) << formula;
    EXPECT_NEAR(result.gradient.at("b").front(), formula == "w" ? 4 * exact : 2 * exact, 1e-12) << formula;
  }
}

/// A source and a receiver that go around a periodic axis many times.
TEST(FormulaPoints, GoAroundRings) {
  const std::string text = R"(
model m { field u, w; param v; dt(u) = inject(1, at = 0.3 + v*t); dt(w) = 0*w + 0*v }
scene s : m {
  grid x = -1 .. 1, cells 16, periodic
  v = 3
  initial u = 0
  initial w = sin(pi*x)
  time 0 .. 1, step 1/64
}
task mass : s { unknown v; minimise integral(u) at t = 1 }
task slope : s { unknown v; minimise sample(dx(w), at = 0.3 + v*t) at t = 1 }
)";
  for (const char* v : {"0.7", "7.1", "-12.3", "1000"}) EXPECT_NEAR(task_loss(text, "mass", {{"v", v}}), 1, 1e-12) << v;
  const TaskResult once = task_gradient(text, "slope", {{"v", "0.4"}}),
                   often = task_gradient(text, "slope", {{"v", "14.4"}});
  EXPECT_NEAR(once.loss, often.loss, 1e-12);
  EXPECT_NE(once.gradient.at("v").front(), 0);
  EXPECT_NEAR(once.gradient.at("v").front(), often.gradient.at("v").front(), 1e-11);
}

TEST(FormulaPoints, DerivativesAreCertified) {
  for (const char* grid : {"cells 6, periodic",
                           "cells 5\n  boundary v.x: y = zero_gradient\n  boundary v.y: y = "
                           "0.1\n  boundary q: y = linear\n  boundary psi: y = 0"}) {
    const std::string text = pool("", grid) + R"(
task t : basin {
  unknown initial q
  unknown initial v
  unknown a from 0.3
  minimise (sample(|v|^2*q + dx(q), at = (a, 0.4)) - 0.1)^2 + sample(flux, at = (0.6, a))^2 + sample(dy(v.x), at = (a, a))
}
)";
    const auto certificate = certificate_of(text, false);
    ASSERT_TRUE(certificate);
    EXPECT_TRUE(certificate->passed());
    EXPECT_LT(certificate->worst(), 1e-11);
  }
}

}  // namespace
}  // namespace dpde::testing
