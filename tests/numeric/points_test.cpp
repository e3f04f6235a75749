// SPDX-License-Identifier: Apache-2.0
// Point sources and receivers: the source's amount arrives, the reading is the multilinear value, and positions have
// exact derivatives.
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "support/scene_run.h"

namespace dpde {
namespace {

using testing::run_scene;
using testing::task_gradient;
using testing::task_loss;

double total(const std::vector<double>& values) { return std::accumulate(values.begin(), values.end(), 0.0); }

std::string growth(const std::string& grid, const std::string& place) {
  return "model m { field u; dt(u) = inject(3, at = " + place +
         ") }\nscheme s { time = euler }\nscene s : m with s {\n" + grid +
         "\nboundary u: x = zero_gradient\ninitial u = 0\ntime 0 .. 1, step 1/4\n}\n";
}

/// 3 per unit time for one unit of time, wherever the source is, divided between the neighbouring cells.
TEST(Points, SourcesBringInWhatTheySay) {
  for (const char* place : {"0", "0.05", "0.24", "0.5", "0.97", "1"}) {
    const std::vector<double> u = run_scene(growth("grid x = 0 .. 1, cells 5", place), "s").state.at("u");
    EXPECT_NEAR(total(u) / 5, 3, 1e-12) << place;
  }
  const std::vector<double> u = run_scene(growth("grid x = 0 .. 1, cells 5", "0.34"), "s").state.at("u");
  EXPECT_NEAR(u[1], 3 * 0.8 / 0.2, 1e-12);  // centres 0.3 and 0.5
  EXPECT_NEAR(u[2], 3 * 0.2 / 0.2, 1e-12);
  for (const char* place : {"(0, 0.3)", "(0.99, 0.02)", "(0.4, 1)", "(0.55, 0.51)"}) {
    for (const char* cells : {"1", "2", "7"}) {
      std::string text =
          growth(std::string("grid x = 0 .. 1, cells 3, periodic\ngrid y = 0 .. 1, cells ") + cells, place);
      text.replace(text.find("boundary u: x"), 13, "boundary u: y");
      const std::vector<double> plane = run_scene(text, "s").state.at("u");
      EXPECT_NEAR(total(plane) / static_cast<double>(plane.size()), 3, 1e-12) << place << cells;
    }
  }
}

/// A decaying mode at a position between centres: the error is of order 2 in the cells.
TEST(Points, ReceiversReadBetweenTheCells) {
  const auto loss = [](const std::string& cells) {
    const std::string text = R"(
model m { field u; param kappa; dt(u) = kappa*lap(u) }
scheme s { time = rk4 }
scene s : m with s {
  grid x = 0 .. 2*pi, cells )" +
                             cells + R"(, periodic
  grid y = 0 .. 1, cells 8
  boundary u: y = zero_gradient
  kappa = 0.5
  initial u = sin(x)
  time 0 .. 0.25, step 1/1024
}
task t : s { unknown initial u; minimise (sample(u, at = (1.3, 0.41)) - exp(-0.125)*sin(1.3))^2 }
)";
    return std::sqrt(task_loss(text, "t"));
  };
  const double coarse = loss("20"), fine = loss("40"), finest = loss("80");
  EXPECT_LT(finest, 1e-3);
  EXPECT_GT(coarse / finest, 8) << coarse << " " << fine << " " << finest;
}

/// Losses quadratic in the strength, and central differences in the positions.
TEST(Points, GradientsOfStrengthAndPlaces) {
  for (const char* cells : {"1", "2", "3", "9"}) {
    for (const char* kind : {"", ", periodic"}) {
      const auto text = [&](double q, double a, double b) {
        const auto number = [](double v) { return std::to_string(v); };
        return "model m { field u; param q, a, b; dt(u) = 0.02*lap(u) - dx(u) + inject(q*cos(t), at = (a, b)) "
               "}\nscheme s { time = rk2 }\n" +
               std::string("scene s : m with s {\ngrid x = 0 .. 1, cells ") + cells + kind +
               "\ngrid y = 0 .. 1, cells 4\n" +
               (*kind ? "boundary u: y = zero_gradient" : "boundary u: x = 0, y = zero_gradient") +
               "\nq = " + number(q) + "\na = " + number(a) + "\nb = " + number(b) +
               "\ninitial u = x*y\ntime 0 .. 0.25, step 1/32\n}\ntask t : s {\nunknown q from " + number(q) +
               "\nunknown a from " + number(a) + "\nunknown b from " + number(b) +
               "\nminimise (sample(u, at = (0.61, 0.3)) - 0.4)^2 + sample(u, at = (0.2, b)), sum over time\n}\n";
      };
      const auto here = task_gradient(text(1.3, 0.43, 0.55), "t");
      const auto loss = [&](double q, double a, double b) { return task_loss(text(q, a, b), "t"); };
      const double h = 1e-4;
      EXPECT_NEAR(here.gradient.at("q")[0], (loss(2.3, 0.43, 0.55) - loss(0.3, 0.43, 0.55)) / 2, 1e-10)
          << cells << kind;
      EXPECT_NEAR(here.gradient.at("a")[0], (loss(1.3, 0.43 + h, 0.55) - loss(1.3, 0.43 - h, 0.55)) / (2 * h), 1e-6)
          << cells << kind;
      EXPECT_NEAR(here.gradient.at("b")[0], (loss(1.3, 0.43, 0.55 + h) - loss(1.3, 0.43, 0.55 - h)) / (2 * h), 1e-6)
          << cells << kind;
    }
  }
}

/// At a cell's centre the slope is the right-hand one, as for interp.
TEST(Points, AtACentreTheSlopeIsTheOneToTheRight) {
  const auto gradient = [](const std::string& a) {
    return task_gradient(
               "model m { field u; param a; dt(u) = inject(1, at = a) }\nscheme s { time = euler }\nscene s : m with s "
               "{\n"
               "grid x = 0 .. 8, cells 8\nboundary u: x = zero_gradient\na = " +
                   a +
                   "\ninitial u = 0\ntime 0 .. 1, step 1\n}\n"
                   "task t : s { unknown a from " +
                   a + "; minimise sum(x^2*u) }\n",
               "t")
        .gradient.at("a")[0];
  };
  EXPECT_EQ(gradient("3.5"), 4.5 * 4.5 - 3.5 * 3.5);
  EXPECT_EQ(gradient("3.75"), 4.5 * 4.5 - 3.5 * 3.5);
  EXPECT_EQ(gradient("0.25"), 0);  // within half a cell of the wall the cell there takes all
}

}  // namespace
}  // namespace dpde
