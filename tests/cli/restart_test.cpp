// SPDX-License-Identifier: Apache-2.0
// Stopped, killed and resumed runs end bit-identically to uninterrupted ones; checkpoints of other runs are refused.
#include "command_support.h"

namespace dpde::testing {
namespace {

/// The explicit time in the equation reveals a resumed run with a wrong time.
constexpr const char* tide_text = R"(model tide {
  field u, v
  param k
  dt(u) = k*lap(u) + sin(t) - v
  dt(v) = u
}
scheme wave { time = rk4 }
scene bay : tide with wave {
  grid x = 0 .. 1, cells 24
  grid y = 0 .. 1, cells 5, periodic
  boundary u: x.low = 0.3, x.high = zero_gradient
  boundary v: x = zero_gradient
  k = 0.01
  initial u = cos(7*x)*y
  initial v = x
  observe size = mean(u^2)
  output u every 10
  output v every 25
  time 0 .. 10, step 1/64
}
)";

class Restart : public Command {
 protected:
  void SetUp() override {
    Command::SetUp();
    write("tide.dpde", tide_text);
  }
  Outcome run(const std::string& options) const { return dpde("run tide.dpde --json " + options); }
  void expect_same_end(const std::string& folder) const {
    for (const char* file : {"/bay.nc", "/u.npy", "/v.npy"}) {
      EXPECT_EQ(content(path("whole" + std::string(file))), content(path(folder + file))) << folder << file;
    }
  }
  /// A run to the middle, with a checkpoint there.
  void run_half(const std::string& folder) const {
    ASSERT_EQ(run("--set end=5 --checkpoint-every 100 --out " + folder).status, 0);
    ASSERT_TRUE(fs::exists(path(folder + "/bay.restart")));
  }
  void must_refuse(const std::string& options, const std::string& words) const {
    const Outcome refused = run("--resume --out half " + options);
    EXPECT_EQ(refused.status, 2) << options;
    EXPECT_EQ(refused.codes(), std::vector<std::string>{"E0914"}) << refused.err;
    EXPECT_NE(refused.err.find(words), std::string::npos) << refused.err;
  }
};

TEST_F(Restart, ALongerRunGoesOnToTheSameEnd) {
  ASSERT_EQ(run("--out whole").status, 0);
  for (const std::string threads : {"1", "2"}) {
    run_half("half" + threads);
    const Outcome rest = run("--resume --out half" + threads + " --threads " + threads + " --set end=10");
    ASSERT_EQ(rest.status, 0) << rest.err;
    EXPECT_EQ(rest.json()["resumed_steps"], 320);
    EXPECT_EQ(rest.json()["steps"], 640);
    EXPECT_EQ(content(path("whole/u.npy")), content(path("half" + threads + "/u.npy")));
    EXPECT_EQ(content(path("whole/v.npy")), content(path("half" + threads + "/v.npy")));
  }
}

/// du/dt = u^2 from 1 is 1/(1 - t): stored and saved states end before t = 1.
TEST_F(Restart, ARunThatBlowsUpLeavesFiniteStates) {
  write("blow.dpde",
        "model m { field u; dt(u) = u*u }\nscene blow : m { grid x = 0 .. 1, cells 8, periodic\n"
        "  initial u = 1 + 0.1*sin(2*pi*x); time 0 .. 4, step 1/32; observe mass = integral(u) }\n");
  const Outcome run = dpde("run blow.dpde --every 8 --checkpoint-every 4 --out out");
  EXPECT_EQ(run.status, 1) << run.err;
  const std::string table = content(path("out/observables.csv"));
  EXPECT_EQ(table.find("nan"), std::string::npos) << table;
  EXPECT_EQ(table.find("inf"), std::string::npos) << table;
  std::istringstream lines(table);
  std::string line;
  std::getline(lines, line);
  for (int before = -1; std::getline(lines, line);) {
    EXPECT_GT(std::stoi(line), before) << table;
    before = std::stoi(line);
  }
  const Outcome again = dpde("run blow.dpde --every 8 --resume --out out");
  EXPECT_EQ(again.status, 1) << again.err;
  EXPECT_NE(again.out.find("goes on from step"), std::string::npos) << again.out;
  EXPECT_EQ(content(path("out/observables.csv")), table);
}

/// At the end of a short run a control is in its last interval; the longer run continues with another one.
TEST_F(Restart, ObservablesOfControlsAtTheJoinAreThoseOfTheLongerRun) {
  write("g.dpde",
        "model m { field u; control G; dt(u) = -u }\nscene s : m {\n  initial u = 1\n  G = 1 + t every 0.5\n"
        "  observe o = mean(G*u)\n  time 0 .. 2, step 0.25\n}\n");
  ASSERT_EQ(dpde("run g.dpde --every 1 --out whole").status, 0);
  ASSERT_EQ(dpde("run g.dpde --every 1 --set end=1 --checkpoint-every 4 --out part").status, 0);
  ASSERT_EQ(dpde("run g.dpde --every 1 --resume --out part").status, 0);
  EXPECT_EQ(content(path("part/observables.csv")), content(path("whole/observables.csv")));
}

/// The step controller continues with its previous length and error.
TEST_F(Restart, UnderATolerancePartsGoOnAsTheyWere) {
  std::string text = tide_text;
  text.replace(text.find("step 1/64"), 9, "step 1/4, tolerance 1e-5");
  text.replace(text.find("time = rk4"), 10, "time = bs32");
  text.replace(text.find("every 10\n"), 9, "every 1\n");
  text.replace(text.find("every 25\n"), 9, "every 1\n");
  write("tide.dpde", text);
  const Outcome whole = run("--out whole");
  ASSERT_EQ(whole.status, 0) << whole.err;
  ASSERT_EQ(run("--set end=5 --checkpoint-every 8 --out half").status, 0);
  const Outcome rest = run("--resume --out half --set end=10");
  ASSERT_EQ(rest.status, 0) << rest.err;
  EXPECT_EQ(content(path("whole/u.npy")), content(path("half/u.npy")));
  EXPECT_GT(whole.json()["parts"], 40);
  EXPECT_GT(whole.json()["parts"], rest.json()["parts"]);
  EXPECT_GE(whole.json()["refused"], 1);
  const Outcome other = run("--resume --out half --set tolerance=1e-6");
  EXPECT_EQ(other.codes(), std::vector<std::string>{"E0914"}) << other.err;
}

/// Start values of solves are in the checkpoint: for a constraint the pressure, else a separate state. Without it the
/// solution would differ within the tolerance.
TEST_F(Restart, SolvesBeginAsTheyWouldHave) {
  write("flow.dpde", R"(model eddies {
  field w
  coefficient k
  solve div(k*grad(psi)) = w for psi
  dt(w) = -dy(psi)*dx(w) + dx(psi)*dy(w)
}
model fluid {
  vector u on faces
  field p
  dt(u) = -advect(u, u) - grad(p) + 0.01*lap(u)
  0 = div(u) gives p
}
scheme warm { time = rk2; solve = cg(1e-4); guess = last }
scene bed : eddies with warm {
  grid x = 0 .. 1, cells 24
  grid y = 0 .. 1, cells 20
  boundary w: all = 0
  boundary psi: all = 0
  k = 1 + 0.5*sin(7*x)*cos(5*y)
  initial w = 10*sin(pi*x)*sin(2*pi*y)
  time 0 .. 0.2, step 1/100
}
scene box : fluid with warm {
  grid x = 0 .. 1, cells 24
  grid y = 0 .. 1, cells 20
  boundary u.x: x = 0, y.low = 0, y.high = 1
  boundary u.y: all = 0
  initial u = 0
  time 0 .. 0.2, step 1/100
}
)");
  for (const auto& [scene, field] : {std::pair{"bed", "/w.npy"}, {"box", "/u.x.npy"}}) {
    const auto end = [&](const std::string& options) {
      const Outcome outcome = dpde(std::string("run flow.dpde ") + scene + " --json " + options);
      EXPECT_EQ(outcome.status, 0) << outcome.err;
    };
    end("--out whole");
    end("--set end=0.1 --checkpoint-every 5 --out half");
    end("--resume --out half --set end=0.2");
    EXPECT_EQ(content(path("whole" + std::string(field))), content(path("half" + std::string(field)))) << scene;
    end("--out cold --set guess=none");
    EXPECT_NE(content(path("whole" + std::string(field))), content(path("cold" + std::string(field)))) << scene;
  }
}

TEST_F(Restart, AnInterruptedRunGoesOnToTheSameEnd) {
  ASSERT_EQ(run("--set end=4000 --out whole").status, 0);
  const Outcome stopped = shell(
      "env --default-signal=INT $DPDE run tide.dpde --set end=4000 --checkpoint-every 3000 --json --out part & run=$!; "
      "while ! test -e part/bay.restart; do sleep 0.01; done; kill -INT $run; wait $run");
  ASSERT_EQ(stopped.status, by_ctrl_c) << "the run was too short to be interrupted" << stopped.out;
  EXPECT_EQ(stopped.codes(), std::vector<std::string>{"E0802"});
  EXPECT_NE(stopped.err.find("--resume"), std::string::npos);
  const Outcome rest = run("--set end=4000 --resume --out part");
  ASSERT_EQ(rest.status, 0) << rest.err;
  EXPECT_GT(rest.json()["resumed_steps"], 0);
  expect_same_end("part");
}

TEST_F(Restart, AKilledRunGoesOnToTheSameEnd) {
  ASSERT_EQ(run("--set end=4000 --out whole").status, 0);
  for (const std::string wait : {"0", "0.02", "0.1"}) {
    const std::string folder = "killed" + wait;
    shell("$DPDE run tide.dpde --set end=4000 --quiet --checkpoint-every 5000 --out " + folder +
          " & run=$!; "
          "while ! test -e " +
          folder + "/bay.restart; do sleep 0.01; done; sleep " + wait + "; kill -KILL $run; wait $run");
    const Outcome rest = run("--set end=4000 --resume --out " + folder);
    ASSERT_EQ(rest.status, 0) << rest.err;
    EXPECT_EQ(rest.json()["resumed_steps"].get<int>() % 5000, 0);
    expect_same_end(folder);
  }
}

TEST_F(Restart, CheckpointsByTheClock) {
  ASSERT_EQ(run("--set end=200 --out whole").status, 0);
  ASSERT_EQ(run("--set end=200 --checkpoint-every 0.001s --out timed").status, 0);
  expect_same_end("timed");
  EXPECT_TRUE(fs::exists(path("timed/bay.restart")));
}

TEST_F(Restart, WithoutACheckpointItStartsAtTheBeginning) {
  ASSERT_EQ(run("--out whole").status, 0);
  const Outcome first = run("--resume --out new");
  EXPECT_EQ(first.status, 0);
  EXPECT_EQ(first.json()["resumed_steps"], 0);
  expect_same_end("new");
  const Outcome again = run("--resume --out new");  // nothing remains to be done
  EXPECT_EQ(again.status, 0);
  EXPECT_EQ(again.json()["resumed_steps"], 640);
  expect_same_end("new");
}

TEST_F(Restart, RefusesCheckpointsOfOtherRuns) {
  run_half("half");
  must_refuse("--set cells.x=48", "another grid");
  must_refuse("--set time=rk2", "another scheme");
  must_refuse("--set step=1/32", "another step");
  must_refuse("--set k=0.02", "another set of parameters");
  must_refuse("--backend interpreter", "another back end");
  must_refuse("--every 3", "another output");
  must_refuse("--set end=4", "another end");
  std::string text = tide_text;
  text.replace(text.find("sin(t) - v"), 10, "cos(t) - v");
  write("tide.dpde", text);
  must_refuse("", "another model");
  text = tide_text;
  text.replace(text.find("x.low = 0.3"), 11, "x.low = 0.4");
  write("tide.dpde", text);
  must_refuse("", "another model");
}

TEST_F(Restart, RefusesDamagedCheckpoints) {
  run_half("half");
  const std::string whole = content(path("half/bay.restart"));
  for (const std::size_t place : {std::size_t{0}, std::size_t{40}, whole.size() / 2, whole.size() - 1}) {
    std::string bytes = whole;
    bytes[place] = static_cast<char>(bytes[place] ^ 1);
    write("half/bay.restart", bytes);
    EXPECT_EQ(run("--resume --out half").codes(), std::vector<std::string>{"E0907"}) << place;
  }
  write("half/bay.restart", whole.substr(0, whole.size() - 10));
  EXPECT_EQ(run("--resume --out half").codes(), std::vector<std::string>{"E0907"});
  write("half/bay.restart", "");
  EXPECT_EQ(run("--resume --out half").codes(), std::vector<std::string>{"E0907"});
}

/// Frames are appended: 33 of u and v, 24 x 5 numbers each. The checkpoint has their times and observables.
TEST_F(Restart, FramesAreWrittenOnce) {
  ASSERT_EQ(run("--set end=5 --checkpoint-every 1 --every 10 --out every").status, 0);
  EXPECT_EQ(fs::file_size(path("every/bay.frames")), 33 * 2 * 24 * 5 * sizeof(double));
  EXPECT_LT(fs::file_size(path("every/bay.restart")), 2 * 24 * 5 * sizeof(double) + 8192);
}

/// A kill between the frames and their checkpoint.
TEST_F(Restart, FramesBehindACheckpointAreWrittenOver) {
  ASSERT_EQ(run("--out whole").status, 0);
  run_half("half");
  std::ofstream(path("half/bay.frames"), std::ios::binary | std::ios::app) << std::string(5000, 'x');
  ASSERT_EQ(run("--resume --out half --set end=10").status, 0);
  EXPECT_EQ(content(path("whole/u.npy")), content(path("half/u.npy")));
  ASSERT_EQ(run("--resume --out half --set end=10").status, 0) << "what it left is whole";
  EXPECT_EQ(content(path("whole/v.npy")), content(path("half/v.npy")));
}

/// A restarted run keeps the frames of the previous run's checkpoint until it has its own checkpoint.
TEST_F(Restart, FramesOfTheRunBeforeStayUntilThereIsACheckpoint) {
  ASSERT_EQ(run("--out whole").status, 0);
  run_half("half");
  fs::copy(path("half"), path("killed"));
  write("killed/bay.frames-1", "what a killed run has left");
  ASSERT_EQ(run("--resume --out killed --set end=10").status, 0);
  EXPECT_EQ(content(path("whole/u.npy")), content(path("killed/u.npy")));
  ASSERT_EQ(run("--checkpoint-every 100 --out half").status, 0);
  EXPECT_FALSE(fs::exists(path("half/bay.frames")));
  EXPECT_TRUE(fs::exists(path("half/bay.frames-1")));
  ASSERT_EQ(run("--resume --out half").status, 0);
  EXPECT_EQ(content(path("whole/u.npy")), content(path("half/u.npy")));
}

TEST_F(Restart, RefusesDamagedFrames) {
  run_half("half");
  const std::string whole = content(path("half/bay.frames"));
  std::string flipped = whole;
  flipped[whole.size() / 2] = static_cast<char>(flipped[whole.size() / 2] ^ 1);
  for (const std::string& bytes : {flipped, whole.substr(0, whole.size() - 1), std::string()}) {
    write("half/bay.frames", bytes);
    EXPECT_EQ(run("--resume --out half --set end=10").codes(), std::vector<std::string>{"E0907"}) << bytes.size();
  }
  fs::remove(path("half/bay.frames"));
  EXPECT_EQ(run("--resume --out half --set end=10").codes(), std::vector<std::string>{"E0907"});
}

TEST_F(Restart, OptionsThatMakeNoSense) {
  EXPECT_EQ(run("--resume").codes(), std::vector<std::string>{"E0904"});
  EXPECT_EQ(run("--checkpoint-every 10").codes(), std::vector<std::string>{"E0904"});
  for (const char* interval : {"0", "-3", "often", "1.5", "10min5", "nan"}) {
    EXPECT_EQ(run(std::string("--out o --checkpoint-every=") + interval).codes(), std::vector<std::string>{"E0904"})
        << interval;
  }
}

TEST_F(Restart, AFullDiskStopsNoRun) {
  const Outcome outcome =
      shell("mkdir o; trap '' XFSZ; ulimit -f 2; $DPDE run tide.dpde --json --checkpoint-every 10 --out o");
  EXPECT_EQ(outcome.status, 3);
  EXPECT_FALSE(fs::exists(path("o/bay.restart")));
  const Outcome recorded = shell("mkdir p; trap '' XFSZ; ulimit -f 8; $DPDE run tide.dpde --json --every 10 --out p");
  EXPECT_EQ(recorded.status, 3);
  EXPECT_GT(recorded.json()["steps"].get<int>(), 0) << "what was computed is told";
  for (const std::string name : {"bay.nc", "u_over_time.npy", "bay.frames"})
    EXPECT_FALSE(fs::exists(path("p/" + name)));
}

}  // namespace
}  // namespace dpde::testing
