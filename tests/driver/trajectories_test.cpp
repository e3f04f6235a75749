// SPDX-License-Identifier: Apache-2.0
// Files of trajectories: contents read from them, and reasons why unusable ones are rejected.
#include "files/trajectories.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "dpde/runtime/netcdf.h"
#include "driver/compile/pipeline.h"

namespace dpde::files {
namespace {

constexpr const char* text = R"(
model m { field u; field v; param nu; param c; dt(u) = nu*lap(u) + c*v; dt(v) = 0 }
scene s : m { grid x = 0 .. 4, cells 4, periodic; nu = 1; c = 2; initial u = 0; initial v = 1; time 0 .. 1, step 1/8 }
task t : s { data u_ref = trajectories("f.nc", u); unknown nu from 0.5; minimise mean((u - u_ref)^2) over 2 steps; using adam(rate = 0.1), epochs 2 }
)";

/// Two runs of three frames, 1/4 apart, with u = 100*run + 10*frame + cell and c = 5, 6.
NetcdfContent good() {
  NetcdfContent content;
  content.dimensions = {{"run", 2}, {"time", 3}, {"x", 4}};
  content.variables = {{"time", {"time"}, {}, {1, 1.25, 1.5}},
                       {"x", {"x"}, {}, {0.5, 1.5, 2.5, 3.5}},
                       {"u", {"run", "time", "x"}, {}, {}},
                       {"c", {"run"}, {}, {5, 6}},
                       {"nu", {"run"}, {}, {7, 8}}};
  for (int i = 0; i < 24; ++i) content.variables[2].values.push_back(100 * (i / 12) + 10 * (i / 4 % 3) + i % 4);
  return content;
}

class TrajectoryFile : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::path(::testing::TempDir()) /
              (std::string("dpde_trajectories_") + ::testing::UnitTest::GetInstance()->current_test_info()->name());
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::optional<Trajectories> load(const NetcdfContent& content, DiagnosticSink& sink) const {
    std::ofstream(folder_ / "f.nc", std::ios::binary) << compose_netcdf(content);
    const SourceFile source((folder_ / "m.dpde").string(), text);
    driver::CompileOptions options;
    options.selection.name = "t";
    const std::optional<driver::Compiled> compiled = driver::compile(source, options, sink);
    if (!compiled) return std::nullopt;
    return load_trajectories(*compiled->problem, "f.nc", source, {}, sink);
  }
  std::string message(const std::function<void(NetcdfContent&)>& change) const {
    NetcdfContent content = good();
    change(content);
    DiagnosticSink sink;
    EXPECT_FALSE(load(content, sink));
    return sink.all().empty() ? "" : sink.all().back().message;
  }
  std::filesystem::path folder_;
};

TEST_F(TrajectoryFile, HoldsRunsFramesAndParameters) {
  DiagnosticSink sink;
  const std::optional<Trajectories> read = load(good(), sink);
  ASSERT_TRUE(read) << (sink.all().empty() ? "" : sink.all().back().message);
  EXPECT_EQ(read->states, std::vector<std::string>{"u"});
  EXPECT_EQ(read->params, std::vector<std::string>{"c"}) << "nu is sought";
  EXPECT_EQ(read->every, 2);
  EXPECT_EQ(read->runs.size(), 2U);
  EXPECT_EQ(read->runs[1].params, std::vector<double>{6});
  const std::span<const double> frames = read->frames(1, "u", 1, 2);
  EXPECT_EQ(std::vector<double>(frames.begin(), frames.end()),
            (std::vector<double>{110, 111, 112, 113, 120, 121, 122, 123}));
  // u = 100*r + 10*f + c with independent r, f, c: the variances add up.
  EXPECT_NEAR(read->deviation("u"), std::sqrt(2500 + 100 * 2.0 / 3 + 1.25), 1e-12);
}

TEST_F(TrajectoryFile, WarnsOfAnotherParameter) {
  NetcdfContent content = good();
  content.variables[3] = {"c", {}, {}, {2}};   // the scene's own
  content.variables[4] = {"nu", {}, {}, {7}};  // unknown
  DiagnosticSink none;
  ASSERT_TRUE(load(content, none));
  EXPECT_TRUE(none.all().empty());
  content.variables[3].values = {2.5};
  DiagnosticSink sink;
  ASSERT_TRUE(load(content, sink));
  ASSERT_EQ(sink.all().size(), 1U);
  EXPECT_EQ(sink.all()[0].kind->name, "data-of-other-parameter");
  EXPECT_NE(sink.all()[0].message.find("was made with c = 2.5, scene s has 2"), std::string::npos)
      << sink.all()[0].message;
}

TEST_F(TrajectoryFile, OfASingleRun) {
  NetcdfContent content = good();
  content.dimensions.erase(content.dimensions.begin());
  content.variables.resize(3);
  content.variables[2].dimensions = {"time", "x"};
  content.variables[2].values.resize(12);
  DiagnosticSink sink;
  const std::optional<Trajectories> read = load(content, sink);
  ASSERT_TRUE(read);
  EXPECT_EQ(read->runs.size(), 1U);
  EXPECT_EQ(read->frame_count(), 3);
}

TEST_F(TrajectoryFile, SaysWhatIsWrong) {
  const auto has = [](const std::string& message, const std::string& part) {
    EXPECT_NE(message.find(part), std::string::npos) << message;
  };
  has(message([](auto& c) { c.variables[2].values[17] = NAN; }), "u is nan in run 1, frame 1, cell 1");
  has(message([](auto& c) { c.variables[2].values[3] = INFINITY; }), "u is inf in run 0, frame 0, cell 3");
  has(message([](auto& c) { c.variables[2].name = "uu"; }), "it has none of the states of scene s (u, v)");
  has(message([](auto& c) { c.variables[2].name = "v"; }), "it has no variable u");
  has(message([](auto& c) { c.variables[1].values[2] = 2.4; }),
      "it is of another grid: cell 2 lies at x = 2.4, here at x = 2.5");
  has(message([](auto& c) {
        c.dimensions[2].length = 2;
        c.variables[1].values.resize(2);
        c.variables[2].values.resize(12);
      }),
      "u has 2 cells along x, the scene has 4");
  has(message([](auto& c) {
        c.variables[0].values = {1, 1.25, 1.625};
      }),
      "its frames are 0.3125 apart, no whole number of steps of 0.125");
  has(message([](auto& c) {
        c.variables[0].values = {1, 1.2, 1.5};
      }),
      "its frames are not at equal intervals: frame 1 is at t = 1.2, not at 1.25");
  has(message([](auto& c) { c.variables.erase(c.variables.begin()); }),
      "it does not say at which times its 3 frames are");
  has(message([](auto& c) { c.variables[3].values[1] = NAN; }), "c is nan in run 1");
  has(message([](auto& c) {
        c.variables[2].dimensions = {"time", "run", "x"};
      }),
      "the first dimension of u is time, not run");
}

TEST_F(TrajectoryFile, ThatIsDamaged) {
  DiagnosticSink sink;
  std::ofstream(folder_ / "f.nc", std::ios::binary) << compose_netcdf(good()).substr(0, 2000);
  const SourceFile source((folder_ / "m.dpde").string(), text);
  driver::CompileOptions options;
  options.selection.name = "t";
  const std::optional<driver::Compiled> compiled = driver::compile(source, options, sink);
  ASSERT_TRUE(compiled);
  EXPECT_FALSE(load_trajectories(*compiled->problem, "f.nc", source, {}, sink));
  EXPECT_TRUE(sink.has_errors());
}

}  // namespace
}  // namespace dpde::files
