// SPDX-License-Identifier: Apache-2.0
// What a user of curved coordinates is told: what is conserved, what a pole does to the step, and where nothing is
// mirrored.
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
  const Outcome outcome = dpde("check globe.dpde s");
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  for (const char* said : {"sphere coordinates", "order: 2 in space", "the narrow cells around the pole at y.",
                           "fewer cells along x", "an estimate", "conserved: integral(u), total"})
    EXPECT_NE(outcome.out.find(said), std::string::npos) << said << "\n" << outcome.out;
}

/// Runs below and above the limit agree with what is said of it.
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

TEST_F(CurvedCoordinates, FormattingKeepsThem) {
  write("globe.dpde", globe_text);
  ASSERT_EQ(dpde("fmt globe.dpde").status, 0);
  const std::string text = content(path("globe.dpde"));
  EXPECT_NE(text.find("  coordinates sphere(1)\n  grid lon = 0 .. 2*pi"), std::string::npos) << text;
  EXPECT_NE(text.find("boundary u: lat = pole"), std::string::npos) << text;
}

}  // namespace
}  // namespace dpde::testing
