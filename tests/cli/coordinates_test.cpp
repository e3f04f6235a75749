// SPDX-License-Identifier: Apache-2.0
// Messages about curvilinear coordinates: conservation, effect of a pole on the step, and points that are not mirrored.
#include <fmt/format.h>

#include "command_support.h"

namespace dpde::testing {
namespace {

class CurvedCoordinates : public Command {};

constexpr const char* globe_text = R"(
model heat {
  field u
  coefficient k
  dt(u) = div(k*grad(u))
}
scheme s { dx = central(2); time = rk4 }
scene s : heat with s {
  coordinates sphere(1)
  grid lon = 0 .. 2*pi, cells 32, periodic
  grid lat = -pi/2 .. pi/2, cells 16
  k = 1 + 0.1*sin(lat)
  boundary u: lat = pole
  initial u = 2 + cos(lat)^2*sin(lat)*cos(2*lon)
  time 0 .. 1/64, step 1/8192
  observe total = integral(u)
}
)";

TEST_F(CurvedCoordinates, CheckNamesThePole) {
  write("globe.dpde", globe_text);
  const Outcome outcome = dpde("check globe.dpde --all s");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  for (const char* said : {"sphere coordinates", "order: 2 in space", "the narrow cells around the pole at lat.",
                           "fewer cells along lon", "an estimate", "conserved: integral(u), total"})
    EXPECT_NE(outcome.out.find(said), std::string::npos) << said << "\n" << outcome.out;
}

/// Runs below and above the limit agree with the reported limit.
TEST_F(CurvedCoordinates, TheLimitAtAPoleIsThatOfRuns) {
  write("globe.dpde", globe_text);
  const double limit = dpde("check globe.dpde s --json").json()["stability"]["max_step"].get<double>();
  const auto status_at = [&](double factor) {
    const std::string step = fmt::format("{:.17g}", factor * limit);
    return dpde("run globe.dpde s --quiet --force --set step=" + step + " --set end=1000*" + step).status;
  };
  EXPECT_EQ(status_at(0.98), 0);
  EXPECT_NE(status_at(1.3), 0);
}

constexpr const char* wind_text = R"(
model wind { vector u on faces; dt(u) = 0*u }
model waves { vector u on faces; field h; dt(u) = -grad(h); dt(h) = -div(u) }
operator bend(p) order 2 = (p[+1, 0] - 2*p + p[-1, 0])/hx^2
model filtered {
  vector u on faces
  field h
  solve rate - 0.1*bend(rate)/cos(lat)^2 = -div(u) for rate
  dt(u) = -grad(h)
  dt(h) = rate
}
scene over_poles : wind {
  coordinates sphere(1)
  grid lon = 0 .. 2*pi, cells 16, periodic
  grid lat = -pi/2 .. pi/2, cells 8
  boundary u.x: lat = pole
  boundary u.y: lat = 0
  initial u = (sin(lat)*cos(lon), -sin(lon))
  exact u = (sin(lat)*cos(lon), -sin(lon))
  time 0 .. 1, step 1
}
scene water : waves {
  coordinates sphere(1)
  grid lon = 0 .. 2*pi, cells 32, periodic
  grid lat = -pi/2 .. pi/2, cells 16
  boundary u.x: lat = pole
  boundary u.y: lat = 0
  boundary h: lat = pole
  initial u = 0
  initial h = sin(lat)
  time 0 .. 10, step 1
}
scene smooth : filtered {
  coordinates sphere(1)
  grid lon = 0 .. 2*pi, cells 32, periodic
  grid lat = -pi/2 .. pi/2, cells 16
  boundary u.x: lat = pole
  boundary u.y: lat = 0
  boundary h: lat = pole
  boundary rate: lat = pole
  initial u = 0
  initial h = sin(lat)
  time 0 .. 10, step 1
}
)";

/// There the boundary sets 0, whatever flows over the pole.
TEST_F(CurvedCoordinates, ErrorsLeaveFacesOnPolesOut) {
  write("wind.dpde", wind_text);
  const Json error = dpde("run wind.dpde over_poles --json").json()["error"];
  EXPECT_EQ(error["u.y"]["linf"].get<double>(), 0) << error;
  EXPECT_EQ(error["u.y"]["l2"].get<double>(), 0) << error;
}

/// A filter is suggested if the limit comes from waves without one.
TEST_F(CurvedCoordinates, ALimitOfWavesHasTheirRemedy) {
  write("wind.dpde", wind_text);
  const std::string text = dpde("run wind.dpde water").err;
  EXPECT_NE(text.find("E0808"), std::string::npos) << text;
  EXPECT_NE(text.find("around the pole at lat."), std::string::npos) << text;
  EXPECT_NE(text.find("dsl-examples/sphere/filtered.dpde"), std::string::npos) << text;
  EXPECT_EQ(text.find("ars222"), std::string::npos) << text;
  const std::string filtered = dpde("check wind.dpde --all smooth").out;
  EXPECT_NE(filtered.find("stable up to"), std::string::npos) << filtered;
  EXPECT_EQ(filtered.find("filtered.dpde"), std::string::npos) << filtered;
  EXPECT_EQ(filtered.find("ars222"), std::string::npos) << filtered;
}

TEST_F(CurvedCoordinates, FormattingKeepsThem) {
  write("globe.dpde", globe_text);
  ASSERT_EQ(dpde("fmt globe.dpde").status, 0);
  const std::string text = content(path("globe.dpde"));
  EXPECT_NE(text.find("  coordinates sphere(1)\n  grid lon = 0 .. 2*pi"), std::string::npos) << text;
  EXPECT_NE(text.find("boundary u: lat = pole"), std::string::npos) << text;
}

}  // namespace
}  // namespace dpde::testing
