// SPDX-License-Identifier: Apache-2.0
// However a run ends, each of its files is complete and has the states recorded so far, no partial file remains in its
// folder, and a resumed run ends byte-identically to an uninterrupted one.
#include <algorithm>
#include <functional>

#include "command_support.h"
#include "dpde/runtime/npy.h"
#include "support/netcdf_file.h"

namespace dpde::testing {
namespace {

constexpr const char* basin_text = R"(model tide {
  field u
  vector v on faces
  param k, growth
  dt(u) = k*lap(u) + growth*u + sin(t)
  dt(v) = grad(u)
}
scene basin : tide {
  grid x = 0 .. 1, cells 4, periodic
  grid y = 0 .. 1, cells 3
  grid z = 0 .. 1, cells 2, periodic
  boundary u: y = zero_gradient
  boundary v.y: y = 0
  boundary v.x: y = zero_gradient
  boundary v.z: y = zero_gradient
  k = 0.01
  growth = 0
  initial u = cos(2*pi*x)*y
  initial v = 0
  observe size = mean(u^2)
  time 0 .. 250, step 1/64
}
)";
constexpr int every = 1000;

std::size_t count(const std::string& text, const std::string& word) {
  std::size_t found = 0;
  for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + 1)) ++found;
  return found;
}

struct Format {
  std::string file;
  std::function<std::size_t(const std::string& path)> states;  // number of states in the file
};

const std::vector<Format> formats{
    {"basin.nc", [](const std::string& path) { return NetcdfFile(path).values("u").size() / 24; }},
    {"basin.xdmf", [](const std::string& path) { return count(content(path), "<Time "); }},
    {"u_over_time.npy", [](const std::string& path) { return static_cast<std::size_t>(read_npy(path).shape.at(0)); }},
    {"v.x_over_time.npy", [](const std::string& path) { return static_cast<std::size_t>(read_npy(path).shape.at(0)); }},
    {"observables.csv", [](const std::string& path) { return count(content(path), "\n") - 1; }},
    {"u.npy", [](const std::string& path) { return read_npy(path).values.size() / 24; }},
};

class RunEndings : public Command {
 protected:
  static std::string words(const std::string& options) {
    return "run basin.dpde --json --every " + std::to_string(every) + " " + options;
  }
  /// Checks that exactly those files exist, apart from pictures and checkpoints.
  void expect_whole(const std::string& folder, std::size_t states) const {
    for (const Format& format : formats) {
      ASSERT_TRUE(fs::exists(path(folder + "/" + format.file))) << folder << ": " << format.file;
      const std::size_t expected = format.file == "u.npy" ? 1 : states;
      EXPECT_EQ(format.states(path(folder + "/" + format.file).string()), expected) << folder << ": " << format.file;
    }
    for (const auto& entry : fs::directory_iterator(path(folder)))
      EXPECT_EQ(entry.path().string().find(".tmp-"), std::string::npos) << entry.path();
  }
  static std::size_t states_of(int steps) {  // the first, those of whole intervals, and the last
    return static_cast<std::size_t>(1 + (steps + every - 1) / every);
  }
};

TEST_F(RunEndings, LeaveWholeFilesAndGoOnToTheSameBytes) {
  write("basin.dpde", basin_text);
  struct Row {
    std::string folder, options;
    int status;
  };
  const std::vector<Row> rows{{"whole", "", 0},
                              {"half", "--set end=125 --checkpoint-every 3000", 0},
                              {"grown", "--set growth=2 --set end=800 --force", 1}};
  for (const auto& [folder, options, status] : rows) {
    const Outcome run = dpde(words(options + " --out " + folder));
    EXPECT_EQ(run.status, status) << run.err;
    expect_whole(folder, states_of(run.json()["steps"].get<int>()));
  }
  const Outcome stopped =
      interrupted(words("--set end=4000000 --checkpoint-every 3000 --out part"), "0", "part/basin.restart");
  ASSERT_EQ(stopped.status, by_ctrl_c) << stopped.err;
  const int steps = stopped.json()["steps"].get<int>();
  expect_whole("part", states_of(steps));
  const std::string end = " --set end=" + std::to_string(250 * (1 + steps / 16000));
  ASSERT_EQ(dpde(words("--out long" + end)).status, 0);
  for (const auto& [folder, options, whole] :
       {std::tuple<std::string, std::string, std::string>{"half", "", "whole"}, {"part", end, "long"}}) {
    const Outcome rest = dpde(words("--resume --out " + folder + options));
    ASSERT_EQ(rest.status, 0) << rest.err;
    EXPECT_GT(rest.json()["resumed_steps"], 0);
    for (const Format& format : formats)
      EXPECT_EQ(content(path(folder + "/" + format.file)), content(path(whole + "/" + format.file))) << format.file;
  }
}

}  // namespace
}  // namespace dpde::testing
