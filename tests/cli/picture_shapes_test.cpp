// SPDX-License-Identifier: Apache-2.0
// Pictures of curved coordinates, bodies, vorticity, and of values that differ little.
#include <cmath>
#include <cstdio>
#include <numbers>

#include "picture_scripts.h"

namespace dpde::testing {
namespace {

using Rows = std::vector<std::vector<double>>;

class PictureShapes : public PictureScripts {
 protected:
  /// Numbers of a data block, line by line.
  static Rows block_of(const std::string& script, const std::string& name) {
    const std::size_t begin = script.find(name + " << EOD\n");
    EXPECT_NE(begin, std::string::npos) << name;
    if (begin == std::string::npos) return {};
    std::istringstream lines(script.substr(script.find('\n', begin) + 1));
    Rows rows;
    for (std::string line; std::getline(lines, line) && line != "EOD";) {
      std::istringstream numbers(line);
      std::vector<double>& row = rows.emplace_back();
      for (std::string number; numbers >> number;) row.push_back(std::stod(number));
    }
    return rows;
  }
  static std::pair<double, double> range_of(const std::string& script, const std::string& which) {
    std::pair<double, double> range;
    const std::vector<std::string> lines = lines_with(script, "set " + which);
    EXPECT_FALSE(lines.empty()) << which;
    const std::string format = "set " + which + " [%lf:%lf]";
    EXPECT_EQ(std::sscanf(lines.at(0).c_str(), format.c_str(), &range.first, &range.second), 2) << lines[0];
    return range;
  }
};

/// u = r + theta/100 on a ring around the origin: each pixel has the value of the cell that contains it, pixels in the
/// hole and outside have none; the run and its file give the same picture.
TEST_F(PictureShapes, RingsAreRings) {
  write("ring.dpde",
        "model m { field u; dt(u) = lap(u) }\nscene s : m {\n  coordinates polar\n  grid r = 1 .. 2, cells 4\n"
        "  grid theta = 0 .. 2*pi, cells 8, periodic\n  boundary u: r = zero_gradient\n"
        "  initial u = r + theta/100\n  time 0 .. 1e-9, step 1e-9\n}\n");
  const std::string run = scripts_of("run ring.dpde --quiet --out o"), again = scripts_of("plot o/s.nc --out p");
  for (const std::string& script : {run, again}) {
    EXPECT_EQ(range_of(script, "xrange"), (std::pair(-2.0, 2.0)));
    EXPECT_EQ(range_of(script, "yrange"), (std::pair(-2.0, 2.0)));
    EXPECT_FALSE(lines_with(script, "set xlabel 'x'").empty());
    EXPECT_FALSE(lines_with(script, "set size ratio -1").empty());
    const Rows map = block_of(script, "$p0");
    const int n = static_cast<int>(map.size());
    ASSERT_GE(n, 900);
    for (int j = 0; j < n; j += 7) {
      ASSERT_EQ(static_cast<int>(map[j].size()), n);
      for (int i = 0; i < n; i += 7) {
        const double x = -2 + (i + 0.5) * 4 / n, y = -2 + (j + 0.5) * 4 / n, r = std::hypot(x, y);
        if (r < 1 || r > 2) {
          EXPECT_TRUE(std::isnan(map[j][i])) << x << ' ' << y;
          continue;
        }
        const double angle = std::atan2(y, x), turn = 2 * std::numbers::pi, theta = angle < 0 ? angle + turn : angle;
        const double centre = 1.125 + std::floor((r - 1) * 4) / 4;
        const double around = (std::floor(theta / turn * 8) + 0.5) / 8 * turn;
        EXPECT_NEAR(map[j][i], centre + around / 100, 1e-6) << x << ' ' << y;
      }
    }
  }
}

/// A quarter of a disc fills its bounding box.
TEST_F(PictureShapes, SectorsFillTheirPicture) {
  write("sector.dpde",
        "model m { field u; dt(u) = lap(u) }\nscene s : m {\n  coordinates polar\n  grid r = 1 .. 2, cells 4\n"
        "  grid theta = pi/4 .. 3*pi/4, cells 8\n  boundary u: r = zero_gradient, theta = zero_gradient\n"
        "  initial u = r\n  time 0 .. 1e-9, step 1e-9\n}\n");
  const std::string script = scripts_of("run sector.dpde --quiet --out o");
  const auto [x_low, x_high] = range_of(script, "xrange");
  const auto [y_low, y_high] = range_of(script, "yrange");
  EXPECT_NEAR(x_low, -std::sqrt(2.0), 1e-6);
  EXPECT_NEAR(x_high, std::sqrt(2.0), 1e-6);
  EXPECT_NEAR(y_low, std::sqrt(0.5), 1e-6);
  EXPECT_NEAR(y_high, 2, 1e-6) << "beyond both corners: the arc";
}

TEST_F(PictureShapes, SpheresAreMapsInDegrees) {
  write("globe.dpde",
        "model m { field u; dt(u) = lap(u) }\nscene s : m {\n  coordinates sphere(1)\n"
        "  grid lon = 0 .. 2*pi, cells 8, periodic\n  grid lat = -pi/2 .. pi/2, cells 4\n"
        "  boundary u: lat = pole\n  initial u = sin(lat)\n  time 0 .. 1e-9, step 1e-9\n}\n");
  for (const char* command : {"run globe.dpde --quiet --out o", "plot o/s.nc --out p"}) {
    const std::string script = scripts_of(command);
    EXPECT_NEAR(range_of(script, "xrange").first, 0, 1e-9);
    EXPECT_NEAR(range_of(script, "xrange").second, 360, 1e-9);
    EXPECT_NEAR(range_of(script, "yrange").first, -90, 1e-9);
    EXPECT_NEAR(range_of(script, "yrange").second, 90, 1e-9);
    EXPECT_FALSE(lines_with(script, "set xtics 60").empty());
    EXPECT_FALSE(lines_with(script, "set xlabel 'lon [\u00b0]'").empty());
  }
}

/// A square body of 2 x 2 cells, which may have moved there: its outline has 8 faces, for fields on faces too.
TEST_F(PictureShapes, BodiesHaveOutlines) {
  const std::set<std::vector<double>> all{{2, 1}, {3, 1}, {4, 1}, {2, 2}, {4, 2}, {2, 3}, {3, 3}, {4, 3}};
  for (const char* kind : {"field u", "vector u on faces"}) {
    for (const char* centre : {"c = 3\n  solid = abs(x - c)", "c = 2\n  solid = abs(x - c - t)"}) {
      const std::string value = kind[0] == 'f' ? "1" : "(1, 0)";
      write("body.dpde",
            std::string("model m { ") + kind + "; mask solid; param c; dt(u) = lap(u); u = 0*u inside solid }\n" +
                "scene s : m {\n  grid x = 0 .. 6, cells 6, periodic\n  grid y = 0 .. 4, cells 4, periodic\n  " +
                centre + " < 1 and abs(y - 2) < 1\n  initial u = " + value + "\n  time 0 .. 1, step 1/8\n}\n");
      const std::string script = scripts_of("run body.dpde --quiet --force --out o");
      std::set<std::vector<double>> corners;
      int faces = 0;
      std::vector<double> before;
      for (const std::vector<double>& point : block_of(script, "$p0lines")) {
        if (!point.empty()) corners.insert(point);
        if (!point.empty() && !before.empty()) {
          ++faces;
          EXPECT_NEAR(std::hypot(point[0] - before[0], point[1] - before[1]), 1, 1e-6);
        }
        before = point;
      }
      EXPECT_EQ(faces, 8) << kind << centre;
      EXPECT_EQ(corners, all) << kind << centre;
    }
  }
}

/// Rotation of a rigid body about the middle: vorticity 2 in all cells, at walls too; not for vectors that do not flow.
TEST_F(PictureShapes, FlowsShowTheirVorticity) {
  const auto script_of = [&](const std::string& placed, const std::string& equation) {
    write("turn.dpde", "model m { vector u" + placed + "; dt(u) = " + equation +
                           " }\nscene s : m {\n"
                           "  grid x = -1 .. 1, cells 5\n  grid y = -1 .. 1, cells 4\n  boundary u: all = linear\n"
                           "  initial u = (-y, x)\n  time 0 .. 1e-9, step 1e-9\n}\n");
    return scripts_of("run turn.dpde --quiet --force --out o");
  };
  for (const char* placed : {"", " on faces"}) {
    const std::string script = script_of(placed, "-advect(u, u)");
    const Rows map = block_of(script, "$p2");
    ASSERT_EQ(map.size(), 4U) << placed;
    for (const std::vector<double>& row : map) {
      for (const double value : row) EXPECT_NEAR(value, 2, 1e-6) << placed;
    }
    EXPECT_FALSE(lines_with(script, "set title 'vorticity of u, t = 1e-09'").empty()) << placed;
  }
  EXPECT_EQ(script_of("", "lap(u)").find("vorticity"), std::string::npos);
}

/// Values of 101325 and a little: ticks differ, since a round number is subtracted and stands in the label.
TEST_F(PictureShapes, LittleDifferencesAreReadable) {
  for (const std::string axes : {"  grid x = 0 .. 1, cells 4, periodic\n",
                                 "  grid x = 0 .. 1, cells 4, periodic\n  grid y = 0 .. 1, cells 4, periodic\n"}) {
    write("air.dpde", "model m { field p in Pa; dt(p) = 0*p }\nscene s : m {\n" + axes +
                          "  initial p = 101325.25 + 0.125*cos(2*pi*x)\n  time 0 .. 1, step 1/4\n}\n");
    const std::string script = scripts_of("run air.dpde --quiet --out o");
    EXPECT_NE(script.find("p [Pa] \u2212 101325"), std::string::npos) << script;
    EXPECT_EQ(script.find("101325.3"), std::string::npos) << "no value of that size";
  }
}

/// u = x + 10 t at all recorded times, also of intervals that differ: rows from below are times.
TEST_F(PictureShapes, MapsOverSpaceAndTime) {
  write("line.dpde",
        "model m { field u; dt(u) = 10 }\nscene s : m {\n  grid x = 0 .. 4 in m, cells 4, periodic\n"
        "  initial u = x\n  time 0 .. 1, step 1/4\n  output u every 1/4\n}\n");
  ASSERT_EQ(dpde("run line.dpde --quiet --out o").status, 0);
  const std::string script = scripts_of("plot o/s.nc --space-time --out p");
  EXPECT_EQ(block_of(script, "$p0"),
            (Rows{{0.5, 1.5, 2.5, 3.5}, {3, 4, 5, 6}, {5.5, 6.5, 7.5, 8.5}, {8, 9, 10, 11}, {10.5, 11.5, 12.5, 13.5}}));
  EXPECT_EQ(range_of(script, "yrange"), (std::pair(0.0, 1.0)));
  EXPECT_FALSE(lines_with(script, "set ylabel 't'").empty());
  EXPECT_EQ(dpde("plot o/s.nc --space-time --film").status, 2);
  write("plane.dpde",
        "model m { field u; dt(u) = 10 }\nscene s : m {\n  grid x = 0 .. 4, cells 4, periodic\n"
        "  grid y = 0 .. 4, cells 4, periodic\n  initial u = x\n  time 0 .. 1, step 1/4\n}\n");
  ASSERT_EQ(dpde("run plane.dpde --quiet --out o").status, 0);
  EXPECT_EQ(dpde("plot o/s.nc --space-time").status, 2);
}

TEST_F(PictureShapes, LongTimesAreInDays) {
  for (const auto& [end, unit, title] : {std::tuple("432000", " in s", "u, t = 5 d"),
                                         {"86400", " in s", "u, t = 86400 s"},
                                         {"1296000", "", "u, t = 1296000"}}) {
    write("s.dpde",
          std::string("model m { field u; dt(u) = 0*u }\nscene s : m {\n  grid x = 0 .. 1 in m, cells 4, periodic\n") +
              "  grid y = 0 .. 1 in m, cells 4, periodic\n  initial u = 1\n  time 0 .. " + end + unit + ", step " +
              end + "\n}\n");
    const std::string run = scripts_of("run s.dpde --quiet --out o"), script = run + scripts_of("plot o/s.nc --out p");
    EXPECT_EQ(lines_with(script, std::string("set title '") + title + "'").size(), 4u)
        << end << unit << script.substr(0, 400);
  }
}

/// Values on faces reach half a cell beyond one end of the grid and not to the other: pictures of runs and files show
/// the grid.
TEST_F(PictureShapes, FacesAreShownOnTheGrid) {
  write("faces.dpde",
        "model m { vector u on faces; dt(u) = lap(u) }\nscene s : m {\n  grid x = 0 .. 4, cells 4\n"
        "  grid y = 0 .. 2, cells 4\n  boundary u: all = 0\n  initial u = (1, 1)\n  time 0 .. 1e-3, step 1e-3\n}\n");
  for (const char* command : {"run faces.dpde --quiet --out o", "plot o/s.nc --field u.x --out p"}) {
    const std::string script = scripts_of(command);
    EXPECT_EQ(range_of(script, "xrange"), (std::pair(0.0, 4.0))) << command;
    EXPECT_EQ(range_of(script, "yrange"), (std::pair(0.0, 2.0))) << command;
  }
}

/// gnuplot draws no image of one row: the row stands there twice.
TEST_F(PictureShapes, OneRowOfCellsIsSeen) {
  write("row.dpde",
        "model m { field u; dt(u) = 0*u }\nscene s : m {\n  grid x = 0 .. 4, cells 4\n  grid y = 0 .. 1, cells 1\n"
        "  boundary u: all = zero_gradient\n  initial u = x\n  time 0 .. 1, step 1\n}\n");
  const Rows map = block_of(scripts_of("run row.dpde --quiet --out o"), "$p0");
  EXPECT_EQ(map, (Rows{{0.5, 1.5, 2.5, 3.5}, {0.5, 1.5, 2.5, 3.5}}));
}

/// Of more than a turn a part would cover another.
TEST_F(PictureShapes, MoreThanATurnIsARectangle) {
  write("turns.dpde",
        "model m { field u; dt(u) = lap(u) }\nscene s : m {\n  coordinates polar\n  grid r = 1 .. 2, cells 4\n"
        "  grid theta = 3 .. 12, cells 8\n  boundary u: all = zero_gradient\n  initial u = r\n"
        "  time 0 .. 1e-9, step 1e-9\n}\n");
  const std::string script = scripts_of("run turns.dpde --quiet --out o");
  EXPECT_EQ(range_of(script, "xrange"), (std::pair(1.0, 2.0)));
  EXPECT_EQ(range_of(script, "yrange"), (std::pair(3.0, 12.0)));
  EXPECT_FALSE(lines_with(script, "set ylabel 'theta'").empty());
}

}  // namespace
}  // namespace dpde::testing
