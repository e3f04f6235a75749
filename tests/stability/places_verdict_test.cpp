// SPDX-License-Identifier: Apache-2.0
// Limits of scenes where the step is limited at some places or some times alone: inside of masks of all sizes and
// places, by what is held there, solved for, set by events or tied together by means and extremes. Beside each limit a
// run goes on and a run blows up, and the scene's own step has no part in it.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "stability/stability_report.h"
#include "stability_support.h"
#include "support/setting.h"

namespace dpde::stability {
namespace {

/// u' = -v u + w by rk4, where v becomes large somewhere; `length` and the mask `b` are the scene's.
struct Rate {
  std::string name, model, scene = "";
};

const std::string helmholtz = "  solve lap(phi) - phi = -1 for phi\n", still = "  dt(v) = 0\n";

const std::vector<Rate> rates{
    {"held", still + "  v = 100 inside b\n"},
    {"held, of what is solved for", helmholtz + still + "  v = 100*phi inside b\n"},
    {"held, of its square", helmholtz + still + "  v = 100*phi^2 inside b\n"},
    {"held, of its mean", helmholtz + still + "  v = 100*mean(phi) inside b\n"},
    {"held, of a let of it", helmholtz + "  let a = 100*phi\n" + still + "  v = a inside b\n"},
    {"held, of a state that an event sets", "  field c\n  dt(c) = 0\n" + still + "  v = 100*c inside b\n",
     "  initial c = 0\n  after step: c = 1\n"},
    {"held, of a solution of a state that an event sets",
     "  field c\n  dt(c) = 0\n  solve lap(phi) - phi = -c for phi\n" + still + "  v = 100*phi inside b\n",
     "  initial c = 0\n  after step: c = 1\n"},
    {"held, of what is held", "  field c\n  dt(c) = 0\n" + still + "  v = 100*c inside b\n  c = 1 inside b\n",
     "  initial c = 0\n"},
    {"held, of what is held of what is held",
     "  field c, d\n  dt(c) = 0\n  dt(d) = 0\n" + still +
         "  v = 100*c inside b\n  c = d/2 inside b\n  d = 2 inside b\n",
     "  initial c = 0\n  initial d = 0\n"},
    {"held, later", "  param length = 1\n" + still + "  v = 100*min(1, 2*t/length) inside b\n",
     "  length = length_of_run\n"},
    {"set by an event, later", still, "  after step: v = 100*b*min(1, 2*t/length_of_run)\n"},
    {"a solution that the mask makes",
     "  solve lap(phi) - 100*phi = -100*b for phi\n" + still + "  let v2 = 100*phi\n"},
    {"a solution that comes later",
     "  param length = 1\n  solve lap(phi) - 100*phi = -100*b*min(1, 2*t/length) for phi\n" + still +
         "  let v2 = 100*phi\n",
     "  length = length_of_run\n"},
};

struct Place {
  std::string mask;
  int rank, cells;
};

std::vector<Place> places() {
  std::vector<Place> all;
  for (const int cells : {8, 16, 32, 64}) {
    for (const char* mask : {"x < 0.1", "x < 0.3", "x < 0.5", "x < 0.7", "x < 0.9", "x > 0.5", "x > 0.9",
                             "abs(x - 0.4) < 0.07", "abs(x - 0.62) < 0.1", "abs(x - 0.5) > 0.43"})
      all.push_back({mask, 1, cells});
  }
  for (const int cells : {8, 16}) {
    for (const char* centre : {"(x - 0.5)^2 + (y - 0.5)^2", "(x - 0.3)^2 + (y - 0.6)^2", "(x - 0.8)^2 + (y - 0.2)^2"}) {
      for (const double radius : {0.1, 0.2, 0.4}) all.push_back({fmt::format("{} < {}^2", centre, radius), 2, cells});
    }
  }
  return all;
}

std::string text_of(const Rate& rate, const Place& place, double step) {
  const bool is_let = rate.model.find("let v2") != std::string::npos;
  std::string text = "model m {\n  field u, v, w\n  mask b\n" + rate.model;
  text += fmt::format("  dt(u) = -{}*u + w\n  dt(w) = 0\n}}\nscheme r {{ time = rk4 }}\nscene s : m with r {{\n",
                      is_let ? "v2" : "v");
  text += fmt::format("  let length_of_run = 600*{}\n", step) + rate.scene;
  for (int axis = 0; axis < place.rank; ++axis)
    text += fmt::format("  grid {} = 0 .. 1, cells {}, periodic\n", "xy"[axis], place.cells);
  return text +
         fmt::format("  b = {}\n  initial u = 1; initial v = 0; initial w = 1 + x\n  time 0 .. {}, step {}\n}}\n",
                     place.mask, 600 * step, step);
}

double largest_after_run(const std::string& text) {
  const auto session = open_scene(text);
  session->rollout().run();
  double largest = 0;
  for (const double value : session->final_state(0)) largest = std::max(largest, std::abs(value));
  return std::isfinite(largest) ? largest : 1e300;
}

TEST(PlacesVerdict, LimitsAreThoseOfRunsWhereverTheMaskIs) {
  std::size_t count = 0;
  for (const Place& place : places()) {
    for (const Rate& rate : rates) {
      if (!testing::is_tried(count++, 97)) continue;
      const std::string what = fmt::format("{}: {}, {} cells, rank {}", rate.name, place.mask, place.cells, place.rank);
      const StabilityReport verdict = verdict_of(*open_scene(text_of(rate, place, 0.001)));
      ASSERT_EQ(verdict.limit.kind, StepLimit::Kind::limit) << what << verdict.why;
      const double limit = verdict.limit.step;
      EXPECT_LT(largest_after_run(text_of(rate, place, 0.97 * limit)), 1e4) << what << limit;
      EXPECT_GT(largest_after_run(text_of(rate, place, 1.05 * limit)), 1e4) << what << limit;
      for (const double step : {1.01 * limit, 0.1}) {
        const StabilityReport again = verdict_of(*open_scene(text_of(rate, place, step)));
        EXPECT_NEAR(again.limit.step, limit, 2e-3 * limit) << what << " at " << step;
      }
    }
  }
}

/// The derivative of a largest value is that of the cell where it is.
TEST(PlacesVerdict, ExtremesOfAllCellsFeedBack) {
  std::size_t count = 0;
  for (const char* rate : {"100*max(u)", "100*min(u)", "50*(max(u) + min(u))", "40*max(u) + 60*mean(u)"}) {
    for (const char* start : {"1 + 0.3*sin(2*pi*x + 0.1)", "1 + x^2", "1 + 0.2*noise(3)"}) {
      for (const int cells : {8, 64}) {
        if (!testing::is_tried(count++, 5)) continue;
        const auto text = [&](double step) {
          return fmt::format(
              "model m {{ field u; dt(u) = -({}) + 1 }}\nscheme r {{ time = rk4 }}\nscene s : m with r {{\n"
              "  grid x = 0 .. 1, cells {}, periodic\n  initial u = {}\n  time 0 .. {}, step {}\n}}\n",
              rate, cells, start, 600 * step, step);
        };
        const StabilityReport verdict = verdict_of(*open_scene(text(0.001)));
        ASSERT_EQ(verdict.limit.kind, StepLimit::Kind::limit) << rate << verdict.why;
        EXPECT_NEAR(verdict.limit.step, 2.78529356 / 100, 1e-2 * 2.78529356 / 100) << rate << start << cells;
        EXPECT_LT(largest_after_run(text(0.97 * verdict.limit.step)), 1e4) << rate << start << cells;
        EXPECT_GT(largest_after_run(text(1.05 * verdict.limit.step)), 1e4) << rate << start << cells;
      }
    }
  }
}

}  // namespace
}  // namespace dpde::stability
