// SPDX-License-Identifier: Apache-2.0
// Pictures of large fields: input of gnuplot, captured by a fake gnuplot of the test that stores the script.
#include <algorithm>
#include <cmath>

#include "command_support.h"
#include "dpde/runtime/npy.h"

namespace dpde::testing {
namespace {

using Pictures = Command;

/// The numbers of the first map of a script, row by row.
std::vector<std::vector<double>> map_in(const std::string& script) {
  std::istringstream lines(script.substr(script.find("$p0 << EOD\n") + 11));
  std::vector<std::vector<double>> rows;
  for (std::string line; std::getline(lines, line) && line != "EOD";) {
    std::istringstream numbers(line);
    rows.emplace_back();
    for (std::string number; numbers >> number;) rows.back().push_back(std::stod(number));
  }
  return rows;
}

/// Twice as many cells as pixels along x: each pixel is the mean of two cells, and the colour range is that of the
/// cells.
TEST_F(Pictures, NoMoreValuesThanPixels) {
  constexpr int nx = 5120, ny = 20;
  std::vector<double> values;
  for (int y = 0; y < ny; ++y) {
    for (int x = 0; x < nx; ++x) values.push_back(x + 10.0 * y);
  }
  values[3 * nx + 5] = NAN;
  write_npy(path("u.npy"), std::vector<std::int64_t>{ny, nx}, values);
  fs::create_directory(path("bin"));
  write("bin/gnuplot", "#!/bin/sh\n[ \"$1\" = --version ] && exit 0\ncp \"$1\" script.gp\ntouch \"${1%.gp}\"\n");
  const Outcome run = shell("chmod +x bin/gnuplot; PATH=$PWD/bin:$PATH $DPDE plot u.npy");
  ASSERT_EQ(run.status, 0) << run.err;
  const std::string script = content(path("script.gp"));
  const std::vector<std::vector<double>> map = map_in(script);
  ASSERT_EQ(map.size(), 20U);
  for (int y = 0; y < ny; ++y) {
    ASSERT_EQ(map[y].size(), 2560U);
    for (int x = 0; x < 2560; ++x) {
      const double mean = 2 * x + 0.5 + 10 * y;
      const bool is_left_out = y == 3 && x == 2;
      EXPECT_TRUE(is_left_out ? std::isnan(map[y][x]) : map[y][x] == mean) << x << ' ' << y;
    }
  }
  EXPECT_NE(script.find("set cbrange [0:5309]"), std::string::npos) << script.substr(script.size() - 800);
}

/// From a million values on a line those that are visible are drawn: one-cell spikes upwards, downwards, and a
/// non-finite one.
TEST_F(Pictures, SpikesOfLongLinesShow) {
  std::vector<double> values(1000000);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = std::sin(1e-5 * double(i));
  values[345678] = 7;
  values[345679] = -8;
  values[765432] = NAN;
  write_npy(path("u.npy"), std::vector<std::int64_t>{1000000}, values);
  fs::create_directory(path("bin"));
  write("bin/gnuplot", "#!/bin/sh\n[ \"$1\" = --version ] && exit 0\ncp \"$1\" script.gp\ntouch \"${1%.gp}\"\n");
  const Outcome run = shell("chmod +x bin/gnuplot; PATH=$PWD/bin:$PATH $DPDE plot u.npy");
  ASSERT_EQ(run.status, 0) << run.err;
  EXPECT_NE(run.out.find("         7 "), std::string::npos) << run.out;
  EXPECT_NE(run.out.find("        -8 "), std::string::npos) << run.out;
  const std::string script = content(path("script.gp"));
  const auto lines = std::count(script.begin(), script.end(), '\n');
  EXPECT_GT(lines, 4000);
  EXPECT_LT(lines, 12000);
  for (const char* line : {"\n0.5 0\n", "\n345678.5 7\n", "\n345679.5 -8\n", "\n765432.5 NaN\n", "\n999999.5 "}) {
    EXPECT_NE(script.find(line), std::string::npos) << line;
  }
}

}  // namespace
}  // namespace dpde::testing
