// SPDX-License-Identifier: Apache-2.0
// Layout of pictures: panels in columns, a common scale for comparisons, distinct colours, planes through the
// middle of three axes, films; tested on the scripts for gnuplot.
#include <filesystem>
#include <set>

#include "picture_scripts.h"

namespace dpde::testing {
namespace {

class PicturePages : public PictureScripts {
 protected:
  void write_block() const {
    write("block.dpde",
          "model m { field u; dt(u) = -u }\nscene s : m {\n  grid x = 0 .. 1, cells 4, periodic\n  grid y = 0 .. 1, "
          "cells 4, periodic\n"
          "  grid z = 0 .. 1, cells 4, periodic\n  initial u = x + 10*y + 100*z\n  time 0 .. 1, step 1/16\n"
          "  observe size = mean(u)\n  output u every 1/4\n}\n");
  }
};

TEST_F(PicturePages, ThreeColumnsAndNoMore) {
  write("five.dpde",
        "model m { field a, b, c, d, e; dt(a) = -a; dt(b) = -b; dt(c) = -c; dt(d) = -d; dt(e) = -e }\nscene s : m {\n"
        "  grid x = 0 .. 1, cells 4, periodic\n  grid y = 0 .. 1, cells 4, periodic\n  initial a = x\n  initial b = x\n"
        "  initial c = x\n  initial d = x\n  initial e = x\n  time 0 .. 1, step 1/8\n}\n");
  const std::string script = scripts_of("run five.dpde --quiet --out o");
  EXPECT_EQ(lines_with(script, "set multiplot"), std::vector<std::string>(2, "set multiplot layout 2,3")) << script;
  EXPECT_NE(script.find("pngcairo size 2880,1616"), std::string::npos) << "square maps";
}

/// Of a channel five times as long as high each map takes a row, at the height that its scale needs.
TEST_F(PicturePages, MapsAreToScale) {
  const auto script_of = [&](const std::string& unit) {
    write("long.dpde",
          "model m { field a, b; dt(a) = -a; dt(b) = -b }\nscene s : m {\n  grid x = 0 .. 5 in m, cells 20, periodic\n"
          "  grid y = 0 .. 1 in " +
              unit +
              ", cells 4, periodic\n  initial a = 1\n  initial b = 1\n"
              "  time 0 .. 1, step 1/8\n}\n");
    return scripts_of("run long.dpde --quiet --out o");
  };
  const std::string to_scale = script_of("m"), of_other_units = script_of("s");
  EXPECT_EQ(lines_with(to_scale, "set multiplot"), std::vector<std::string>(2, "set multiplot layout 2,1"));
  EXPECT_NE(to_scale.find("pngcairo size 2560,1272"), std::string::npos) << "2 rows of (1280 - 172)/5 + 96, twice";
  EXPECT_EQ(lines_with(to_scale, "set size ratio -1").size(), 4U);
  EXPECT_EQ(lines_with(of_other_units, "set multiplot"), std::vector<std::string>(2, "set multiplot layout 1,2"));
  EXPECT_EQ(lines_with(of_other_units, "set size ratio -1").size(), 0U);
}

TEST_F(PicturePages, AxesHaveTheirUnits) {
  const std::string head = "model m { field u in m/s; field h in m; dt(u) = 0*u; dt(h) = 0*h }\nscene s : m {\n";
  const std::string tail =
      "  initial u = 1\n  initial h = 2\n  observe kick = mean(u^2)\n  time 0 .. 1 in s, step 1/4\n"
      "  output u, h every 1/4\n}\n";
  write("line.dpde", head + "  grid x = 0 .. 1 in km, cells 4, periodic\n" + tail);
  const std::string line = scripts_of("run line.dpde --quiet --out o --every 1");
  EXPECT_NE(line.find("set ylabel 'u [m/s], h [m]'"), std::string::npos) << line;
  EXPECT_NE(line.find("set xlabel 'x [km]'"), std::string::npos);
  EXPECT_NE(line.find("set title 't = 1 s'"), std::string::npos);
  EXPECT_NE(line.find("set ylabel 'kick [m\u00b2/s\u00b2]'"), std::string::npos);
  EXPECT_NE(line.find("set xlabel 't [s]'"), std::string::npos);
  write("map.dpde",
        head + "  grid x = 0 .. 1 in m, cells 4, periodic\n  grid y = 0 .. 1 in m, cells 4, periodic\n" + tail);
  const std::string map = scripts_of("run map.dpde --quiet --out o");
  EXPECT_NE(map.find("set cblabel 'u [m/s]'"), std::string::npos) << map;
  EXPECT_NE(map.find("set ylabel 'y [m]'"), std::string::npos);
  const std::string again = scripts_of("plot o/s.nc --field u --out p");
  EXPECT_NE(again.find("set title 'u, t = 1 s'"), std::string::npos) << again;
  EXPECT_NE(again.find("set cblabel 'u [m/s]'"), std::string::npos);
}

TEST_F(PicturePages, SeveralCurvesSayWhatTheyAre) {
  write("two.dpde",
        "model m { field u, v; dt(u) = -u; dt(v) = -v }\nscene s : m {\n  grid x = 0 .. 1, cells 4, periodic\n"
        "  initial u = 1\n  initial v = 2\n  time 0 .. 1, step 1/4\n}\n");
  EXPECT_NE(scripts_of("run two.dpde --quiet --out o").find("set ylabel 'u, v'"), std::string::npos);
}

TEST_F(PicturePages, WhatIsComparedHasOneScale) {
  write("plate.dpde",
        "model m { field u; coefficient k; dt(u) = k*lap(u) }\nscene s : m {\n  grid x = 0 .. 1, cells 6, periodic\n"
        "  grid y = 0 .. 1, cells 6, periodic\n  k = 0.01 + 0.02*x\n  initial u = sin(2*pi*x)\n"
        "  time 0 .. 0.5, step 1/16\n}\ntask t : s {\n  unknown k from 0.005*(1 + y)\n  minimise mean(u^2)\n"
        "  using lbfgs(), iterations 1\n}\n");
  const std::string script = scripts_of("optimize plate.dpde t --quiet --out o");
  const std::vector<std::string> ranges = lines_with(script, "set cbrange");
  ASSERT_EQ(ranges.size(), 6u) << script;  // PNG and SVG
  EXPECT_EQ(ranges[0], ranges[1]);
  double low = 0, high = 0, lowest = 0, highest = 0;
  ASSERT_EQ(std::sscanf(ranges[0].c_str(), "set cbrange [%lf:%lf]", &low, &high), 2);
  ASSERT_EQ(std::sscanf(ranges[2].c_str(), "set cbrange [%lf:%lf]", &lowest, &highest), 2);
  EXPECT_GE(highest, (high - low) / 2 - 1e-8 * high) << "the difference, on colours of the same scale or a wider one";
  EXPECT_EQ(lowest, -highest);
  EXPECT_EQ(lines_with(script, "set multiplot"), std::vector<std::string>(2, "set multiplot layout 1,3"));
}

TEST_F(PicturePages, ColoursAndDashesDiffer) {
  write("block.dpde", rod_text);
  const std::string script = scripts_of("run block.dpde rod --quiet --out o");
  std::set<std::string> types;
  std::size_t colours = 0;
  for (const std::string& line : lines_with(script, "set linetype ")) {
    const std::size_t look = line.find(" lc ");
    if (look == std::string::npos) continue;
    types.insert(line.substr(look));
    colours += line.find(" dt 1") != std::string::npos ? 1 : 0;
  }
  EXPECT_EQ(types.size(), 21u);
  EXPECT_EQ(colours, 14u) << "seven, in both formats";
  EXPECT_NE(script.find("set key below"), std::string::npos);
  EXPECT_NE(script.find("set autoscale xfix"), std::string::npos);
}

TEST_F(PicturePages, PlanesThroughTheMiddleOrWhereTheyAreWanted) {
  write_block();
  const std::string run = scripts_of("run block.dpde --quiet --out o");
  for (const char* title : {"'u, t = 1, z = 0.625'", "'u, t = 1, y = 0.625'", "'u, t = 1, x = 0.625'"})
    EXPECT_NE(run.find(title), std::string::npos) << title;
  EXPECT_EQ(lines_with(run, "set title 'size'").size(), 2u) << "the observable over time";
  const std::string stored = scripts_of("plot o/s.nc --out p");
  EXPECT_EQ(lines_with(stored, "set title 'u, t = 1, ").size(), 6u);
  for (const char* wrong : {"--time 7", "--time -1", "--time 0.3 --film"}) {
    const Outcome refused = dpde(std::string("plot o/s.nc --field u --out p ") + wrong);
    EXPECT_EQ(refused.status, 2) << wrong;
    EXPECT_NE(refused.err.find("--time"), std::string::npos) << refused.err;
  }
  const std::string slice = scripts_of("plot o/s.nc --field u --time 0.3 --slice y=0.9 --out p");
  ASSERT_EQ(lines_with(slice, "set title 'u, t = 0.25, y = 0.875'").size(), 2u) << slice;
  EXPECT_EQ(lines_with(slice, "set ylabel")[0], "set ylabel 'z' noenhanced");
  // Rows of z, columns of x, at y = 0.875, times the same factor.
  std::istringstream rows(slice.substr(slice.find("$p0 << EOD\n") + 11));
  std::vector<double> values(16);
  for (double& value : values) rows >> value;
  for (int z = 0; z < 4; ++z) {
    for (int x = 0; x < 4; ++x) {
      const double start = (x + 0.5) / 4 + 8.75 + 25 * (z + 0.5), first = 0.125 + 8.75 + 12.5;
      EXPECT_NEAR(values[static_cast<std::size_t>(4 * z + x)] / values[0], start / first, 1e-8);
    }
  }
  EXPECT_EQ(dpde("plot o/s.nc --slice w=1").status, 2);
  EXPECT_EQ(dpde("plot o/s.nc --slice z").status, 2);
  EXPECT_EQ(dpde("plot o/s.nc --slice z=").status, 2);
}

TEST_F(PicturePages, FilmsAreOneFile) {
  write_block();
  ASSERT_EQ(dpde("run block.dpde --quiet --out o").status, 0);
  const std::string common = scripts_of("plot o/s.nc --film --slice z=0.5 --quiet --out p");
  EXPECT_EQ(lines_with(common, "set terminal gif animate").size(), 1u);
  const std::vector<std::string> ranges = lines_with(common, "set cbrange");
  ASSERT_EQ(ranges.size(), 5u);
  EXPECT_EQ(ranges[0], ranges[4]);
  const std::vector<std::string> own =
      lines_with(scripts_of("plot o/s.nc --film --range each --slice z=0.5 --out p"), "set cbrange");
  ASSERT_EQ(own.size(), 5u);
  EXPECT_NE(own[0], own[4]);
  if (shell("command -v gnuplot").status != 0) return;  // output of real programs
  const bool has_encoder = shell("command -v ffmpeg").status == 0;
  const Outcome film = dpde("plot o/s.nc --film --json --out q");
  EXPECT_EQ(film.json()["files"], Json({has_encoder ? "q/s_u.mp4" : "q/s_u.gif"})) << film.err;
  if (has_encoder)
    EXPECT_EQ(content(path("q/s_u.mp4")).substr(4, 4), "ftyp");
  else
    EXPECT_TRUE(content(path("q/s_u.gif")).starts_with("GIF89a"));
}

/// If ffmpeg is installed: all frames in order, and one MP4. Its failure is an error, and nothing is left half-written.
TEST_F(PicturePages, FilmsAreEncodedWhereThereIsAnEncoder) {
  write_block();
  ASSERT_EQ(dpde("run block.dpde --quiet --out o").status, 0);
  write("bin/ffmpeg",
        "#!/bin/sh\n[ \"$1\" = -version ] && exit 0\necho \"$@\" > call\n[ -e broken ] && exit 1\n"
        "ls \"$(dirname \"$7\")\" | grep -c 'frame.*png$' > frames\nfor film; do :; done\necho film > \"$film\"\n");
  scripts_of("plot o/s.nc --film --slice z=0.5 --quiet --out p");
  EXPECT_EQ(content(path("p/s_u.mp4")), "film\n") << content(path("call"));
  EXPECT_EQ(content(path("frames")), "5\n");
  write("broken", "");
  const Outcome failed = shell("PATH=$PWD/bin:$PATH $DPDE plot o/s.nc --film --out q");
  EXPECT_EQ(failed.status, 3) << failed.err;
  EXPECT_NE(failed.err.find("ffmpeg failed"), std::string::npos) << failed.err;
  EXPECT_FALSE(fs::exists(path("q/s_u.mp4")));
}

}  // namespace
}  // namespace dpde::testing
