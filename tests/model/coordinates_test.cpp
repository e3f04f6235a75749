// SPDX-License-Identifier: Apache-2.0
// Mistakes in curved coordinates, and that one mistake is told once.
#include "model/model_support.h"

namespace dpde::model {
namespace {

/// All that is said, "CODE message | hint" a line.
std::string all_said(const std::string& coordinates, const std::string& grid, const std::string& boundary,
                     const std::string& fields = "field u; dt(u) = lap(u)", const std::string& more = "") {
  const Outcome outcome = outcome_of("model m { " + fields + " }\nscene s : m {\n" + coordinates + "\n" + grid + "\n" +
                                     boundary + "\n initial u = 0\n time 0 .. 1, step 1/1000\n" + more + "}");
  std::string text;
  for (const Diagnostic& d : outcome.diagnostics)
    text += std::string(d.kind->code) + " " + d.message + " | " + d.hint + "\n";
  return text;
}

constexpr const char* globe = "grid lon = 0 .. 2*pi, cells 16, periodic\n grid lat = -pi/2 .. pi/2, cells 8";

TEST(Coordinates, WrongLengthsAreToldAlone) {
  const std::string hint =
      " | lengths are positive and finite inside of the grid, and at the sides of their own axes; at a side of another "
      "axis they may be 0, which is a pole\n";
  EXPECT_EQ(all_said("coordinates sphere(-1)", globe, "boundary u: lat = pole"),
            "E0436 the length of a unit of lon is -0.19509 at lon = 0, lat = -1.37445" + hint);
  EXPECT_EQ(
      all_said("coordinates sphere(1)", "grid lon = 0 .. 360, cells 16, periodic\n grid lat = -90 .. 90, cells 8",
               "boundary u: lat = pole"),
      "E0436 the length of a unit of lon is -0.977993 at lon = 0, lat = -78.75 | angles are in radians: grid lon = "
      "0 .. 2*pi, grid lat = -pi/2 .. pi/2\n");
}

/// A unit of x at x = 0: no pole, which is where that of another coordinate has no length.
TEST(Coordinates, ALengthIsNotZeroAtASideOfItsOwnAxis) {
  const std::string grid = "grid x = 0 .. 1, cells 8\n grid y = 0 .. 1, cells 8, periodic";
  EXPECT_EQ(all_said("coordinates metric(x, 1)", grid, "boundary u: x = 0").substr(0, 48),
            "E0436 the length of a unit of x is 0 at x = 0, y");
  EXPECT_EQ(all_said("coordinates metric(0.1 + x, 1)", grid, "boundary u: x = 0"), "");
  const std::string parabolic = "grid x = 0 .. 1, cells 8\n grid y = 0 .. 1, cells 8";
  EXPECT_EQ(all_said("coordinates metric(sqrt(x^2 + y^2), sqrt(x^2 + y^2))", parabolic, "boundary u = 0"), "");
}

TEST(Coordinates, LengthsCloseOnPeriodicAxes) {
  EXPECT_EQ(all_said("coordinates polar",
                     "grid r = 1 .. 2, cells 8, periodic\n grid theta = 0 .. 2*pi, cells 8, periodic", ""),
            "E0442 the length of a unit of theta is 1 at one end of r, which is periodic, and 2 at the other | take a "
            "formula that is periodic, or leave out periodic in the grid line: walls stand there\n");
  EXPECT_EQ(all_said("coordinates metric(1 + 0.1*cos(2*pi*y), 2 + sin(2*pi*x))",
                     "grid x = 0 .. 1, cells 8, periodic\n grid y = 0 .. 1, cells 8, periodic", ""),
            "");
}

TEST(Coordinates, WhatToWriteOnTheAxisOfACylinder) {
  const std::string grid = "grid r = 0 .. 1, cells 8\n grid y = 0 .. 1, cells 8";
  EXPECT_EQ(
      all_said("coordinates cylinder", grid, "boundary u: r.low = pole, r.high = 0, y = 0"),
      "E0438 there is no pole at r.low | the axis of a cylinder is no pole: write r.low = zero_gradient, as all is "
      "the same around it\n");
  EXPECT_EQ(
      all_said("coordinates cylinder", grid,
               "boundary u: r.low = zero_gradient, r.high = 0, y = 0\n boundary v: r.low = pole, r.high = 0, y = 0",
               "field u; vector v; dt(u) = lap(u); dt(v) = 0*v", "initial v = 0\n")
          .substr(0, 102),
      "E0438 there is no pole at r.low | the axis of a cylinder is no pole: write r.low = 0, as nothing flows");
}

TEST(Coordinates, NamesOfAxesAskForTheirCoordinates) {
  const std::string said = all_said("", globe, "boundary u: lat = zero_gradient");
  EXPECT_NE(said.find("E0402 lon is not an axis | it is one with coordinates sphere(1) in the scene"), said.npos)
      << said;
}

TEST(Coordinates, LapOfAVectorSaysWhatItNeeds) {
  const std::string cells = "grid r = 1 .. 2, cells 4\n grid theta = 0 .. 2*pi, cells 4, periodic";
  const std::string walls = "boundary u = 0\n boundary v = 0\n initial v = 0\n";
  const std::string of_faces = "field u; vector v on faces; dt(u) = lap(u); dt(v) = lap(v)";
  const std::string of_centres = "field u; vector v; dt(u) = lap(u); dt(v) = lap(v)";
  EXPECT_EQ(all_said("coordinates polar", cells, walls, of_faces).substr(0, 52),
            "E0440 lap of a vector on faces is not possible in po");
  EXPECT_EQ(all_said("coordinates polar", cells + "\n grid z = 0 .. 1, cells 4", walls, of_centres).substr(0, 56),
            "E0440 lap of a vector on three axes is not possible in p");
  EXPECT_EQ(all_said("coordinates polar", cells, walls, of_centres), "");
}

}  // namespace
}  // namespace dpde::model
