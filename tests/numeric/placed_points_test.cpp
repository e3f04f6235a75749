// SPDX-License-Identifier: Apache-2.0
// Point sources and receivers at special points: of fields staggered between walls, and on stretched axes.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "../driver/driver_support.h"
#include "support/scene_run.h"

namespace dpde::testing {
namespace {

const std::string to_the_low_wall = ", stretched (exp(2*x) - 1)/(exp(2) - 1)";
const std::string around = ", periodic, stretched x + 0.1*sin(2*pi*x)";

/// A scene of one field on 0 .. 1 with a source of 3 per unit time for one unit of time, and its integral as the loss.
std::string growth(const std::string& field, const std::string& grid, const std::string& place) {
  const bool periodic = grid.find("periodic") != std::string::npos;
  return "model m { field " + field + "; dt(u) = inject(3, at = " + place +
         ") }\nscheme s { time = euler }\nscene s : m with s {\n  grid x = 0 .. 1, cells " + grid +
         (periodic ? "" : "\n  boundary u: x = 0") +
         "\n  initial u = 0\n  time 0 .. 1, step 1/4\n}\ntask t : s { unknown initial u; minimise integral(u) }\n";
}

TEST(PlacedPoints, SourcesBringInWhatTheySay) {
  for (const char* field : {"u", "u on faces.x"}) {
    for (const std::string& kind : {std::string(), to_the_low_wall, around}) {
      for (const char* cells : {"1", "2", "8"}) {
        if (std::string(cells) == "1" && std::string(field) != "u" && kind != around)
          continue;  // there is no face between the walls
        std::string text = growth(field, cells + kind, "0");
        for (const char* place : {"0.003", "0.24", "0.5", "0.97", "1", "0.2 + t/2"})
          text.insert(text.find("inject"), "inject(0.1 + 4*(" + std::string(place) + "), at = " + place + ") + ");
        // of 0.2 + t/2 the mean over the four steps is 0.3875
        EXPECT_NEAR(task_loss(text, "t"), 3 + 0.6 + 4 * (0.003 + 0.24 + 0.5 + 0.97 + 1 + 0.3875), 1e-12)
            << field << " " << kind << " " << cells;
      }
    }
  }
}

/// Between two points the weights add up to 1.
TEST(PlacedPoints, ASourceIsSharedByThePointsBesideIt) {
  const std::vector<double> faces =
      run_scene(growth("u on faces.x", "5", "0.34"), "s").state.at("u");  // 0.2, 0.4, 0.6, 0.8 and the wall
  EXPECT_NEAR(faces[0], 3 * 0.3 / 0.2, 1e-12);
  EXPECT_NEAR(faces[1], 3 * 0.7 / 0.2, 1e-12);
  EXPECT_EQ(faces[2], 0);
  EXPECT_EQ(faces[4], 0);
  const std::vector<double> at_the_wall = run_scene(growth("u on faces.x", "5", "0.9"), "s").state.at("u");
  EXPECT_NEAR(at_the_wall[3], 3 / 0.2, 1e-12);
  for (const bool on_faces : {false, true}) {
    const double h = 1.0 / 8, x = 0.23, first = on_faces ? h : h / 2;
    const auto map = [](double s) { return (std::exp(2 * s) - 1) / (std::exp(2.0) - 1); };
    const auto slope = [](double s) { return 2 * std::exp(2 * s) / (std::exp(2.0) - 1); };
    double mean = 0;
    for (int i = 0; i < 8; ++i) mean += slope(first + i * h) / 8;
    const auto size = [&](int i) { return h * slope(first + i * h) / mean; };
    int below = 0;
    while (map(first + (below + 1) * h) < x) ++below;
    const double from = map(first + below * h), to = map(first + (below + 1) * h);
    const std::vector<double> u =
        run_scene(growth(on_faces ? "u on faces.x" : "u", "8" + to_the_low_wall, "0.23"), "s").state.at("u");
    for (int i = 0; i < 8; ++i) {
      const double wanted = i == below       ? 3 * (to - x) / (to - from) / size(i)
                            : i == below + 1 ? 3 * (x - from) / (to - from) / size(i)
                                             : 0;
      EXPECT_NEAR(u[static_cast<std::size_t>(i)], wanted, 1e-12) << on_faces << " " << i;
    }
  }
}

/// Nothing moves: a linear field is read exactly at every position, on walls, before the first point and after the
/// last.
TEST(PlacedPoints, ReceiversReadWhatIsLinearExactly) {
  for (const char* on : {"", " on faces.x", " on faces.y", " on nodes"}) {
    for (const std::string& kind : {std::string(), to_the_low_wall}) {
      // On a stretched axis ghost cells assume that cells beyond the wall are as wide as inside.
      const bool has_corner = std::string(on) != " on faces.y" || kind.empty();
      std::string loss;
      for (const std::string x : {"0", "0.01", "0.3", "1/3", "0.5", "0.875", "0.99", "1", "a", "a + t"}) {
        loss += (loss.empty() ? "" : " + ") + ("(sample(u, at = (" + x + ", 1.3)) - 0.7 - 3*(" + x + "))^2");
        if (has_corner) loss += " + (sample(u, at = (" + x + ", 0.4)) - 1.6 - 3*(" + x + "))^2";
      }
      for (const char* cells : {"1", "2", "8"}) {
        const std::string text =
            std::string("model m { field u") + on +
            "; param a; dt(u) = 0*u }\nscheme s { time = euler }\nscene s : m with s {\n  grid x = 0 .. 1, cells " +
            cells + kind +
            "\n  grid y = 0 .. 2, cells 3\n  a = 0.21\n  boundary u: x.low = 2 - y, x.high = 5 - y, y.low = 2 + 3*x, "
            "y.high = 3*x\n"
            "  initial u = 2 + 3*x - y\n  time 0 .. 0.5, step 0.5\n}\ntask t : s { unknown initial u; minimise " +
            loss + " at t = 0.5 }\n";
        EXPECT_LT(task_loss(text, "t"), 1e-25) << on << kind << " " << cells;
      }
    }
  }
}

/// The ghost cell next to a wall with a slope is not on the line: receivers extrapolate from the first centre with the
/// slope itself.
TEST(PlacedPoints, ReceiversBesideSlopesReadWhatIsLinearExactly) {
  const std::string narrow = ", stretched (exp(2*x) - 1)/(exp(2) - 1)", wide = ", stretched tanh(2*x)/tanh(2)";
  for (const std::string& kind : {narrow, wide}) {
    for (const std::string boundary : {"x.low = gradient(-3), x.high = gradient(3)", "x.low = 2, x.high = gradient(3)",
                                       "x.low = gradient(-3), x.high = 5"}) {
      for (const char* cells : {"1", "10"}) {
        const auto task = [&](const std::string& wanted) {
          return "model m { field u; param a; dt(u) = 0*u }\nscheme s { time = euler }\nscene s : m with s {\n  grid x "
                 "= 0 .. 1, cells " +
                 std::string(cells) + kind + "\n  a = 0.01\n  boundary u: " + boundary +
                 "\n  initial u = 2 + 3*x\n  time 0 .. 0.5, step 0.5\n}\ntask t : s { unknown a; minimise " + wanted +
                 " }\n";
        };
        std::string loss;
        for (const std::string x : {"0", "0.01", "0.03", "0.3", "0.5", "0.875", "0.99", "1", "a", "1 - a", "0.4 + a"}) {
          loss += (loss.empty() ? "" : " + ") + ("(sample(u, at = " + x + ") - 2 - 3*(" + x + "))^2");
        }
        EXPECT_LT(task_loss(task(loss), "t"), 1e-25) << kind << boundary << cells;
        if (boundary.find(", x.high = gradient(3)") == std::string::npos) continue;
        for (const std::string x : {"a", "1 - a"}) {
          const double slope = task_gradient(task("sample(u, at = " + x + ")"), "t").gradient.at("a")[0];
          EXPECT_NEAR(slope, x == "a" ? 3 : -3, 1e-12) << kind << boundary << cells;
        }
      }
    }
  }
}

/// Around a stretched ring: the piecewise linear interpolant of sin between the points, written out here.
TEST(PlacedPoints, ReceiversOnStretchedRingsReadBetweenThePoints) {
  for (const bool on_faces : {false, true}) {
    const double h = 1.0 / 6, pi = std::acos(-1.0), first = on_faces ? h : h / 2;
    const auto map = [&](double s) { return s + 0.1 * std::sin(2 * pi * s); };
    std::string loss;
    for (const double x : {0.0, 0.02, 0.3, 0.77, 0.98, 1.0}) {
      int below = -1;
      while (map(first + (below + 1) * h) <= x) ++below;
      const double from = map(first + below * h), to = map(first + (below + 1) * h);
      const double wanted =
          std::sin(2 * pi * from) + (x - from) / (to - from) * (std::sin(2 * pi * to) - std::sin(2 * pi * from));
      for (const std::string& place : {std::to_string(x), std::to_string(x) + " + 0*a", std::to_string(x - 1) + " + a",
                                       std::to_string(x + 1) + " - a"}) {
        loss +=
            (loss.empty() ? "(" : " + (") + ("sample(u, at = " + place + ") - (" + fmt::format("{}", wanted) + "))^2");
      }
    }
    const std::string text =
        std::string("model m { field u") + (on_faces ? " on faces.x" : "") +
        "; param a; dt(u) = 0*u }\nscheme s { time = euler }\nscene s : m with s {\n  grid x = 0 .. 1, cells 6" +
        around +
        "\n  a = 1\n  initial u = sin(2*pi*x)\n  time 0 .. 1, step 1\n}\ntask t : s { unknown initial u; unknown a; "
        "minimise " +
        loss + " }\n";
    EXPECT_LT(task_loss(text, "t"), 1e-25) << on_faces;
  }
}

/// Exchanging source and receiver gives the same reading, as diffusion is symmetric and both use the same weights.
TEST(PlacedPoints, SourcesAndReceiversAreTransposes) {
  const auto reading = [](const std::string& on, const std::string& kind, const char* from, const char* to) {
    const std::string walls = kind == around ? ""
                              : on.empty()   ? "\n  boundary u: x.low = 0, x.high = mixed(1, 0.5, 0)"
                                             : "\n  boundary u: x = 0";
    const std::string text = "model m { field u" + on + "; dt(u) = lap(u) + inject(1, at = " + from +
                             ") }\nscheme s { time = euler; lap = central(2) }\nscene s : m with s {\n"
                             "  grid x = 0 .. 1, cells 9" +
                             kind + walls +
                             "\n  initial u = 0\n  time 0 .. 1/64, step 1/4096\n}\n"
                             "task t : s { unknown initial u; minimise sample(u, at = " +
                             to + ") }\n";
    return task_loss(text, "t");
  };
  const auto expect_same = [&](const std::string& on, const std::string& kind) {
    const double there = reading(on, kind, "0.3", "0.64");
    EXPECT_GT(there, 1e-3);
    EXPECT_NEAR(there, reading(on, kind, "0.64", "0.3"), 1e-13) << on << kind;
  };
  expect_same("", "");
  expect_same("", around);
  expect_same("", to_the_low_wall);
  expect_same(" on faces.x", "");
}

TEST(PlacedPoints, DerivativesAreCertified) {
  const auto text = [](const std::string& x, const std::string& y) {
    return "model m {\n  vector u on faces\n  field p\n  param q, a, b\n  dt(u) = 0.02*lap(u) - grad(p) + "
           "inject(q*cos(t), at = (a, b))*(1, 1)\n"
           "  dt(p) = -div(u) + inject(q, at = (b, a + t))\n}\nscheme c { time = rk2 }\nscene s : m with c {\n  grid x "
           "= 0 .. 1, cells " +
           x + "\n  grid y = 0 .. 1, cells " + y + "\n  q = 1.3\n  a = 0.43\n  b = 0.57\n" +
           (x.ends_with(around)
                ? "  boundary u.x: y = zero_gradient\n"
                : "  boundary u.x: x.low = b, x.high = zero_gradient" +
                      std::string(y.find("periodic") == std::string::npos ? ", y = zero_gradient\n" : "\n")) +
           "  boundary u.y = zero_gradient\n  boundary p = zero_gradient\n  initial u = (x, y)\n  initial p = x*y\n  "
           "time 0 .. 1/8, step 1/64\n}\n"
           "task t : s {\n  unknown q\n  unknown a\n  unknown b\n  unknown initial u\n"
           "  minimise (sample(u.x, at = (0.61, 0.3)) - 0.4)^2 + sample(u.y, at = (a, 0.9*b))^2 + sample(p, at = (b, "
           "0.05)), sum over time\n}\n";
  };
  for (const std::string x : {"1", "3"}) {
    expect_certified(text(x, "2"), x == "3");
    expect_certified(text(x + to_the_low_wall, "3, periodic"), x == "3");
  }
  expect_certified(text("5" + around, "4, stretched tanh(2*y)/tanh(2)"), true);
}

TEST(PlacedPoints, BackEndsAgree) {
  for (const std::string& kind : {std::string(), to_the_low_wall, around}) {
    for (const char* cells : {"2", "7"}) {
      const std::string text =
          "model m { field u on faces.x; param a; dt(u) = 0.1*lap(u) + inject(cos(t), at = a + t/4) }\nscheme s { time "
          "= rk2; lap = central(2) }\nscene s : m with s {\n  grid x = 0 .. 1, cells " +
          (cells + kind) + "\n  a = 0.3\n" + (kind == around ? "" : "  boundary u: x = mixed(1, 0.3, a)\n") +
          "  initial u = 0\n  time 0 .. 1, step 1/64\n}\n";
      const auto wanted = run_scene(text, "s", {}, driver::Backend::interpreter).state.at("u");
      for (const driver::Backend backend : {driver::Backend::jit, driver::Backend::cpp}) {
        const auto got = run_scene(text, "s", {}, backend).state.at("u");
        for (std::size_t i = 0; i < wanted.size(); ++i)
          EXPECT_NEAR(got[i], wanted[i], 1e-13 * (1 + std::abs(wanted[i]))) << kind << cells << " " << i;
      }
    }
  }
}

}  // namespace
}  // namespace dpde::testing
