// SPDX-License-Identifier: Apache-2.0
// What hosts record of a run is what `dpde run --every N --out FOLDER` writes, to the byte.
#include "dpde/recorder.h"

#include "dpde/dpde_c.h"
#include "host_support.h"

namespace dpde::testing {
namespace {

namespace fs = std::filesystem;

constexpr const char* basin_text = R"(model tide {
  field u
  vector v on faces
  param k
  let slope = grad(u)
  dt(u) = k*lap(u) + sin(t)
  dt(v) = grad(u)
}
scene basin : tide {
  grid x = 0 .. 1, cells 4, periodic
  grid y = 0 .. 1, cells 3, periodic
  grid z = 0 .. 1, cells 2, periodic
  k = 0.01
  initial u = cos(2*pi*x)*sin(2*pi*y)
  initial v = 0
  observe size = mean(u^2)
  time 0 .. 1, step 1/64
}
scene slopes : tide {
  grid x = 0 .. 1, cells 16, periodic
  k = 0.02
  initial u = cos(2*pi*x)
  initial v = 0
  observe size = mean(u^2)
  output slope every 4/50
  output u
  time 0 .. 1, step 1/50
}
scene line : tide {
  grid x = 0 .. 1, cells 16, periodic
  k = 0.02
  initial u = cos(2*pi*x)
  initial v = 0
  observe size = mean(u^2)
  observe most = max(u)
  time 0 .. 1, step 1/50
}
model rod { field u; param k; dt(u) = k*lap(u) + 1 }
scene rests : rod {
  grid x = 0 .. 1, cells 12
  k = 0.9
  boundary u = 0
  initial u = 0
  observe size = mean(u^2)
  time 0 .. 10, step 1/400, until steady 1e-6
}
)";

std::string content(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

class Recorded : public InFolder {
 protected:
  void run_command(const std::string& scene, int every, const std::string& options = "") {
    file_ = write("basin.dpde", basin_text);
    const std::string interval = every > 0 ? " --every " + std::to_string(every) : "";
    dpde("run " + file_ + " " + scene + interval + options + " --out " + folder("command"));
  }
  std::string folder(const std::string& name) const { return (fs::path(file_).parent_path() / name).string(); }
  void expect_same(const std::vector<std::string>& names) const {
    ASSERT_GT(names.size(), 3u);
    for (const std::string& name : names) {
      ASSERT_TRUE(fs::exists(folder("command/" + name))) << name;
      EXPECT_TRUE(content(folder("host/" + name)) == content(folder("command/" + name))) << name;
    }
    for (const auto* const side : {"host", "command"}) {
      for (const auto& entry : fs::directory_iterator(folder(side))) {
        const std::string name = entry.path().filename().string();  // .dpde: by which the command knows its folders
        EXPECT_TRUE(name == ".dpde" || std::ranges::find(names, name) != names.end()) << entry.path();
      }
    }
  }
  std::string file_;
};

TEST_F(Recorded, RunsAreTheFilesOfTheCommand) {
  struct Row {
    std::string scene, options;
    int every;
    Settings set;
    std::string scheme;
  };
  for (const auto& [scene, options, every, set, scheme] :
       std::vector<Row>{{"basin", "", 5, {}, ""},
                        {"slopes", "", 0, {}, ""},
                        {"slopes", "", 6, {}, ""},
                        {"rests", "", 50, {}, ""},
                        {"line", " --set real=f32", 7, {{"real", "f32"}}, ""},
                        {"line", " --set k=0.03", 100, {{"k", "0.03"}}, ""}}) {
    run_command(scene, every, options);
    Simulation simulation = compile_file(file_, {.name = scene, .set = set, .scheme = scheme});
    fs::remove_all(folder("host"));
    Recorder recorder(simulation, folder("host"), every);
    ASSERT_TRUE(recorder.step(3));
    int calls = 0;
    ASSERT_TRUE(recorder.run_to(
        0.5, [&](const Progress&) { return ++calls > 0; }, 10));
    EXPECT_GE(calls, 3);
    ASSERT_TRUE(recorder.run());
    expect_same(recorder.finish());
    fs::remove_all(folder("command"));
  }
}

/// A run that was cut off behind a checkpoint, and one without a stop: states, files and pictures are the same.
TEST_F(Recorded, RunsGoOnFromCheckpoints) {
  file_ = write("basin.dpde", basin_text);
  for (const auto& [scene, set] : std::vector<std::pair<std::string, Settings>>{
           {"slopes", {}}, {"line", {{"tolerance", "1e-6"}, {"time", "dopri5"}}}}) {
    fs::remove_all(folder("host"));
    fs::remove_all(folder("command"));
    Simulation whole = compile_file(file_, {.name = scene, .set = set});
    Recorder of_whole(whole, folder("command"), 7);
    EXPECT_FALSE(of_whole.resume());
    ASSERT_TRUE(of_whole.run());
    {
      Simulation first = compile_file(file_, {.name = scene, .set = set});
      Recorder recorder(first, folder("host"), 7);
      recorder.checkpoint_every(10);
      EXPECT_FALSE(recorder.run([](const Progress& at) { return at.step < 24; }, 1));
    }
    Simulation second = compile_file(file_, {.name = scene, .set = set});
    Recorder recorder(second, folder("host"), 7);
    ASSERT_TRUE(recorder.resume());
    EXPECT_EQ(second.steps_done(), 20);
    ASSERT_TRUE(recorder.run());
    EXPECT_EQ(second.state("u"), whole.state("u"));
    std::vector<std::string> names = recorder.finish();
    of_whole.finish();
    for (const std::string& name : names)
      EXPECT_EQ(content(folder("host/" + name)), content(folder("command/" + name))) << name;
    EXPECT_THROW(recorder.checkpoint_every(-1), Error);

    Simulation other = compile_file(file_, {.name = scene, .set = set});
    other.set("k", 0.3);
    Recorder of_other(other, folder("host"), 7);
    try {
      of_other.resume();
      FAIL();
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find("set of parameters"), std::string::npos) << error.what();
    }
    Simulation moved = compile_file(file_, {.name = scene, .set = set});
    moved.set_initial("u", std::vector<double>(moved.size(), 1.0));
    Recorder of_moved(moved, folder("host"), 7);
    EXPECT_THROW(of_moved.resume(), Error);
    ASSERT_TRUE(moved.step());
    Recorder late(moved, folder("host"), 7);
    ASSERT_TRUE(late.step());
    EXPECT_THROW(late.resume(), Error);
  }
}

/// Time that begins anywhere, states that are not finite, a second run, and checkpoints that are refused.
TEST_F(Recorded, CheckpointsAreOfTheRunThatTheyAreOf) {
  file_ = write("late.dpde", R"(model m { field u; param k; dt(u) = k*lap(u) + u^2 }
scene late : m { grid x = 0 .. 1, cells 8, periodic; k = 0.01; initial u = 1 + 0.1*sin(2*pi*x)
  time 0.1 .. 0.9, step 0.02 }
scene bursts : m { grid x = 0 .. 1, cells 8, periodic; k = 0.01; initial u = 1 + 0.1*sin(2*pi*x)
  time 0 .. 20, step 0.02 }
)");
  const fs::path restart = folder("host/late.restart");
  Simulation late = compile_file(file_, {.name = "late"});
  for (int run = 0; run < 2; ++run) {
    Recorder recorder(late, folder("host"), 5);
    recorder.checkpoint_every(7);
    ASSERT_TRUE(recorder.run_to(0.5));
    fs::remove(restart);
    ASSERT_TRUE(recorder.run());
    ASSERT_TRUE(fs::exists(restart)) << run;
    late.reset();
    Recorder resumed(late, folder("host"), 5);
    ASSERT_TRUE(resumed.resume());
    EXPECT_EQ(late.steps_done(), 35);
    late.reset();
    EXPECT_THROW(resumed.step(), Error);
  }
  Simulation shorter = compile_file(file_, {.name = "late", .set = {{"end", "0.5"}}});
  EXPECT_THROW(Recorder(shorter, folder("host"), 5).resume(), Error);
  Simulation bursts = compile_file(file_, {.name = "bursts", .force = true});
  Recorder of_bursts(bursts, folder("host"), 50);
  of_bursts.checkpoint_every(1);
  EXPECT_THROW(of_bursts.run(), NotFinite);
  EXPECT_THROW(of_bursts.checkpoint(), Error);
  of_bursts.finish();
  Simulation again = compile_file(file_, {.name = "bursts", .force = true});
  Recorder from_there(again, folder("host"), 50);
  ASSERT_TRUE(from_there.resume());
  EXPECT_TRUE(std::ranges::all_of(again.state("u"), [](double value) { return std::isfinite(value); }));
}

/// Of a cosine, on the upper faces of the cells: the difference of its neighbours is -2*sin(pi*h)/h*sin(2*pi*x).
TEST_F(Recorded, OutputsAreThoseOfThePresentState) {
  file_ = write("basin.dpde", basin_text);
  Simulation simulation = compile_file(file_, {.name = "slopes"});
  EXPECT_EQ(simulation.outputs(), std::vector<std::string>{"slope.x"});
  const std::vector<double> slope = simulation.output("slope.x");
  const double h = 1.0 / 16, pi = std::acos(-1);
  ASSERT_EQ(slope.size(), 16u);
  for (std::size_t i = 0; i < slope.size(); ++i)
    EXPECT_NEAR(slope[i], -2 * std::sin(pi * h) / h * std::sin(2 * pi * double(i + 1) * h), 1e-13) << i;
  EXPECT_THROW(simulation.output("u"), Error);
  dpde_error* error = nullptr;
  dpde_model* const model = dpde_model_from_file(file_.c_str(), &error);
  dpde_options options;
  dpde_options_init(&options, DPDE_C_VERSION);
  options.name = "slopes";
  dpde_sim* const sim = dpde_model_open(model, &options, &error);
  ASSERT_NE(sim, nullptr) << dpde_error_text(error);
  EXPECT_STREQ(dpde_sim_name(sim, DPDE_OUTPUT, 0), "slope.x");
  std::vector<double> of_c(16);
  ASSERT_EQ(dpde_sim_get(sim, DPDE_OUTPUT, "slope.x", of_c.data(), of_c.size(), &error), DPDE_OK);
  EXPECT_EQ(of_c, slope);
  EXPECT_EQ(dpde_sim_set(sim, DPDE_OUTPUT, "slope.x", of_c.data(), of_c.size(), nullptr), DPDE_ERROR_INPUT);
  EXPECT_EQ(dpde_sim_get(sim, DPDE_OUTPUT, "u", of_c.data(), of_c.size(), nullptr), DPDE_ERROR_INPUT);
  dpde_sim_free(sim);
  dpde_model_free(model);
}

TEST_F(Recorded, OfCAreTheSame) {
  run_command("line", 10);
  dpde_error* error = nullptr;
  dpde_model* const model = dpde_model_from_file(file_.c_str(), &error);
  ASSERT_NE(model, nullptr);
  dpde_options options;
  dpde_options_init(&options, DPDE_C_VERSION);
  options.name = "line";
  dpde_sim* const sim = dpde_model_open(model, &options, &error);
  ASSERT_NE(sim, nullptr) << dpde_error_text(error);
  EXPECT_EQ(dpde_sim_record_end(sim, nullptr), DPDE_ERROR_INPUT);
  EXPECT_EQ(dpde_sim_record(sim, folder("host").c_str(), -1, nullptr), DPDE_ERROR_INPUT);
  EXPECT_EQ(dpde_sim_record(sim, (file_ + "/under").c_str(), 1, nullptr), DPDE_ERROR_MACHINE);
  ASSERT_EQ(dpde_sim_record(sim, folder("host").c_str(), 10, &error), DPDE_OK);
  EXPECT_EQ(dpde_sim_record(sim, folder("host").c_str(), 10, nullptr), DPDE_ERROR_INPUT);
  ASSERT_EQ(dpde_sim_step(sim, 4, &error), DPDE_OK);
  ASSERT_EQ(dpde_sim_run(sim, NAN, nullptr, nullptr, 64, &error), DPDE_OK);
  ASSERT_EQ(dpde_sim_record_end(sim, &error), DPDE_OK);
  expect_same({"u.npy", "u_over_time.npy", "v.x.npy", "v.x_over_time.npy", "observables.csv", "line.nc", "line.svg",
               "line.png", "line_observables.svg", "line_observables.png"});
  dpde_sim_free(sim);
  dpde_model_free(model);
}

TEST_F(Recorded, OfARunThatIsStoppedAreItsStatesSoFar) {
  file_ = write("basin.dpde", basin_text);
  Simulation simulation = compile_file(file_, {.name = "line"});
  Recorder recorder(simulation, folder("host"), 4);
  EXPECT_FALSE(recorder.run([](const Progress& at) { return at.step < 10; }, 1));
  recorder.finish();
  EXPECT_EQ(std::ranges::count(content(folder("host/observables.csv")), '\n'), 1 + 4);  // steps 0, 4, 8, 10
  ASSERT_TRUE(recorder.run());
  simulation.reset();
  EXPECT_THROW(recorder.run(), Error);
  recorder.finish();                                                                     // what was recorded before
  EXPECT_EQ(std::ranges::count(content(folder("host/observables.csv")), '\n'), 1 + 11);  // steps 10, 12, 16, ..., 48
}

}  // namespace
}  // namespace dpde::testing
