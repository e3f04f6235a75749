// SPDX-License-Identifier: Apache-2.0
// Limits against all eigenvalues of a step. Its matrix is formed column by column on a few cells. By definition a step
// of length dt is stable where
//   g(dt) <= 2 max(0, r),   g = max ln |eigenvalue of G| ,
// and r is the growth of the equations in the same time: 4 g(dt/4) about the state in the middle of the step. About an
// unsteady state L(t) changes during a step. G is the exponential of its integral, dt L(dt/2) + O(dt^3).
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "stability/eigenvalues/eigenvalues.h"
#include "stability/frozen/frozen_points.h"
#include "stability/stability_report.h"
#include "stability/stability_support.h"
#include "stability/step/compiled_tangent.h"
#include "support/setting.h"

namespace dpde::stability {
namespace {

/// Of one group of states.
class AllEigenvalues {
 public:
  explicit AllEigenvalues(driver::Session& session) : session_(session), linear_(*linear_step(session, why_)) {
    tangent_ = CompiledTangent::of_coupled(linear_);
    params_ = frozen_points(session, linear_).front().point.params;
  }
  /// ln |g| beyond twice the physical growth.
  double beyond(double step) const {
    const double by_right = 4 * growth(*inputs_after(session_, linear_, 3.0 / 8 * step), step / 4);
    return growth(initial_inputs(session_, linear_), step) - 2 * std::max(0.0, by_right);
  }

 private:
  double growth(const stencil::State& inputs, double step) const {
    stencil::Params params = params_;
    params["dt"] = step;
    return std::log(eigenvalues(tangent_->matrix(inputs, params)).cwiseAbs().maxCoeff());
  }

  driver::Session& session_;
  std::string why_;
  LinearStep linear_;
  std::unique_ptr<CompiledTangent> tangent_;
  stencil::Params params_;
};

struct SmallScene {
  std::string name, text;
  double below = 0;  // how far waves that are frozen beside a pole put the limit too low
  bool is_long = false;
};

constexpr const char* broad = "initial u = (20*cos(lat), 0); initial h = 5000 - 935*sin(lat)^2;";
/// As in the scene galewsky.
constexpr const char* narrow =
    "initial u = (jet(lat), 0); initial h = 10158 - integral(slope(s), s, from = pi/7, to = max(pi/7, min(5*pi/14, "
    "lat)));";

/// A rotation in balance about an axis that is tilted by 45 degrees, with what turns it.
constexpr const char* over_poles =
    "initial u = (28*(cos(lat) + sin(lat)*cos(lon)), -28*sin(lon)); "
    "initial h = 2998 - (6.4e6*0.7e-4*39.6 + 39.6^2/2)/9.8*(sin(lat) - cos(lon)*cos(lat))^2/2;";
constexpr const char* tilted = "1e-4*(sin(lat) - cos(lon)*cos(lat))";

/// A jet in balance, but for errors of differences. `is_filtered`: waves along longitude are slowed down where cells
/// are narrow.
std::string jet_of(int cells, bool is_filtered, const char* initial = broad, const char* f = "1.4e-4*sin(lat)") {
  const std::string solves =
      "solve push + r^4*short(push) = 9.8*h + 0.5*dot(u, u) for push; solve gain + r^4*short(gain) = -div(flux) for "
      "gain;";
  return fmt::format(
      "operator short(p) order 4 = p[+2, 0] - 4*p[+1, 0] + 6*p - 4*p[-1, 0] + p[-2, 0]"
      " + hx^2*(p[+1, 0] - 2*p + p[-1, 0])\n"
      "function jet(s) = 80*exp(4/(3*pi/14)^2 - 1/max(1e-3, (s - pi/7)*(5*pi/14 - s)))\n"
      "function slope(s) = jet(s)*(9e2*sin(s) + jet(s)*tan(s))/9.8\n"
      "model m {{ vector u on faces; field h; let flux = interpolate(h)*u; let r = 1/(8*cos(lat)); {}"
      " dt(u) = -cross((curl(u) + {})/interpolate(h), flux) - grad({}); dt(h) = {} }}\n"
      "scheme c {{ dx = central(2); lap = central(2); time = rk4 }}\n"
      "scene s : m with c {{ coordinates sphere(6.4e6)\n"
      "grid lon = 0 .. 2*pi, cells {}, periodic; grid lat = -pi/2 .. pi/2, cells {}\n"
      "boundary u.x: lat = pole; boundary u.y: lat = 0; boundary h: lat = pole; {}"
      " {} time 0 .. 432000, step 100 }}\n",
      is_filtered ? solves : "", f, is_filtered ? "push" : "9.8*h + 0.5*dot(u, u)", is_filtered ? "gain" : "-div(flux)",
      cells, cells / 2, is_filtered ? "boundary push: lat = pole; boundary gain: lat = pole;" : "", initial);
}

std::string scene_of(const std::string& model, const std::string& scheme, const std::string& rest) {
  return fmt::format("model m {{ {} }}\nscheme c {{ {} }}\nscene s : m with c {{ {} }}\n", model, scheme, rest);
}

std::vector<SmallScene> small_scenes() {
  const std::string globe =
      "coordinates sphere(1); grid lon = 0 .. 2*pi, cells 12, periodic; grid lat = -pi/2 .. pi/2, cells 6; "
      "boundary u: lat = pole; initial u = cos(lat)^2*sin(lat)*cos(2*lon); time 0 .. 1/16, step 1/8192";
  const std::string ring = "grid x = 0 .. 1, cells 24, periodic; initial u = 1; time 0 .. 1, step 1/1000",
                    line = "grid x = 0 .. 1, cells 20; boundary u: all = {}; initial u = {}; time 0 .. 1, step 1/1000";
  const std::string string_of =
      "grid x = 0 .. 1, cells {}, periodic; initial u = 0; initial dt(u) = 0; time 0 .. 1, step 1/2000";
  return {
      {"heat on a globe", scene_of("field u; dt(u) = lap(u)", "time = rk4", globe)},
      {"heat on a globe, euler", scene_of("field u; dt(u) = lap(u)", "time = euler", globe)},
      {"carried over a globe",
       scene_of("field u; dt(u) = -div((cos(lat), 0)*u) + 0.01*lap(u)", "dx = central(2); time = rk4", globe)},
      {"heat between walls",
       scene_of("field u; dt(u) = lap(u)", "time = rk2", fmt::format(fmt::runtime(line), "0", "sin(pi*x)"))},
      {"waves between walls", scene_of("field u; dt(dt(u)) = lap(u)", "time = rk4",
                                       fmt::format(fmt::runtime(line), "0", "sin(pi*x); initial dt(u) = 0"))},
      {"a string and its mean", scene_of("field u; dt(dt(u)) = (1 + 2*mean(dx(u)^2))*lap(u)", "time = verlet",
                                         fmt::format(fmt::runtime(string_of), 12))},
      {"burgers on a ring", scene_of("field u; dt(u) = -u*dx(u) + 0.02*lap(u)", "dx = central(2); time = rk4", ring)},
      {"burgers on a ring, upwind",
       scene_of("field u; dt(u) = -advect(u, u)", "advect = upwind(3); time = ssp_rk3", ring)},
      {"burgers that its mean square slows down",
       scene_of("field u; dt(u) = -u*dx(u) + 0.02*lap(u) - mean(u^2)*u + 1", "dx = central(2); time = rk4", ring)},
      {"a filtered jet", jet_of(12, true), 1e-2},
      {"a narrow jet, filtered", jet_of(12, true, narrow), 0, true},
      {"a filtered jet, more cells", jet_of(24, true), 1e-2, true},
      {"over poles of few cells", jet_of(12, false, over_poles, tilted)},
      {"a jet, more cells", jet_of(24, false), 1e-2, true}};
}

/// The search bisects to a thousandth, and detects growth from half a thousandth above the limit.
TEST(DenseLimits, AreThoseOfVerdicts) {
  constexpr double precision = 1.5e-3, rounding = 1e-6;  // the root of it, of double eigenvalues
  std::size_t count = 0;
  for (const SmallScene& each : small_scenes()) {
    if (!testing::is_tried(count++, 3) || (each.is_long && !testing::is_thorough())) continue;
    const auto session = open_scene(each.text);
    const StabilityReport verdict = verdict_of(*session);
    const double limit = verdict.limit.step;
    EXPECT_EQ(verdict.limit.kind, StepLimit::Kind::limit) << each.name;
    const AllEigenvalues all(*session);
    for (const double factor : {0.25, 0.5, 0.75, 0.9, 1 - precision})
      EXPECT_LE(all.beyond(factor * limit), rounding) << each.name << " " << factor * limit;
    EXPECT_GT(all.beyond((1 + each.below + precision) * limit), rounding) << each.name << " " << limit;
  }
}

/// Such steps make every advected disturbance grow, by little a step: runs of a few hundred steps do not show it.
TEST(DenseLimits, AreNoneWhereAllStepsGrow) {
  const auto kind_of = [](const std::string& time, const std::string& rate, const std::string& scene) {
    return verdict_of(*open_scene(scene_of("field u; dt(u) = " + rate, "dx = central(2); time = " + time, scene)))
        .limit.kind;
  };
  const std::string sphere =
      "coordinates sphere(1); grid lon = 0 .. 2*pi, cells CELLS, periodic; grid lat = -pi/2 .. "
      "pi/2, cells 32; boundary u: lat = pole; initial u = 2 + cos(lat)^2*sin(lat)*cos(2*lon); "
      "time 0 .. 1/16, step 1/1024";
  const std::string ring =
      "coordinates polar; grid r = 0.5 .. 1.5, cells 48; grid theta = 0 .. 2*pi, cells CELLS, "
      "periodic; boundary u: r = linear; initial u = 2 + sin(pi*(r - 0.5))*cos(2*theta); "
      "time 0 .. 1/16, step 1/1024";
  for (const char* const time : {"euler", "rk2", "ab2"}) {
    for (const char* const power : {"u", "u*u"}) {
      for (const char* const cells : {"48", "50"}) {
        const auto with = [&](std::string scene) { return scene.replace(scene.find("CELLS"), 5, cells); };
        EXPECT_EQ(kind_of(time, std::string("-div((cos(lat), 0)*") + power + ")", with(sphere)), StepLimit::Kind::never)
            << time << power << cells;
        EXPECT_EQ(kind_of(time, std::string("-div((1e-9, r)*") + power + ")", with(ring)), StepLimit::Kind::never)
            << time << power << cells;
      }
    }
  }
  const std::string globe =
      "coordinates sphere(1); grid lon = 0 .. 2*pi, cells 32, periodic; grid lat = -pi/2 .. pi/2, "
      "cells 16; boundary u: lat = pole; initial u = cos(lat)^2*sin(lat)*cos(2*lon); "
      "time 0 .. 1/16, step 1/128";
  EXPECT_EQ(kind_of("euler", "-div((cos(lat), 0)*u)", globe), StepLimit::Kind::never);  // runs have the last word
}

}  // namespace
}  // namespace dpde::stability
