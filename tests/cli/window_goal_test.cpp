// SPDX-License-Identifier: Apache-2.0
// Samples that begin with frames without comparison, losses of their final state, targets of runs.
#include <algorithm>
#include <cmath>

#include "command_support.h"
#include "dpde/runtime/netcdf.h"

namespace dpde::testing {
namespace {

const std::string rod_with_window = R"(
network heater(u) { real f64; initial he, seed 1; conv 2, 3; tanh; conv out, 1, gain = 0.1 }
model rod { field u; param k; dt(u) = k*lap(u) }
scene s : rod { grid x = 0 .. 1, cells 8, periodic; k = 0.05; initial u = 0; time 0 .. 1, step 1/64
  after step: u += heater(u) }
)";

class WindowGoals : public Command {
 protected:
  static constexpr int cells = 8, runs = 3;
  static double start_of(int run, int cell) { return std::sin(0.7 * run + 0.8 * cell); }
  static double goal_of(int run, int cell) { return 0.5 + 0.1 * std::cos(run + 0.8 * cell); }

  /// Frames four steps apart, the second of which, if any, is the target; and the target of each run.
  void write_runs(const std::string& name, int frames, const std::function<void(NetcdfContent&)>& change = {}) const {
    NetcdfContent content;
    content.dimensions = {{"run", runs}, {"time", frames}, {"x", cells}};
    content.variables = {{"time", {"time"}, {}, {}},
                         {"x", {"x"}, {}, {}},
                         {"u", {"run", "time", "x"}, {}, {}},
                         {"goal", {"run", "x"}, {}, {}},
                         {"same", {"x"}, {}, {}}};
    for (int k = 0; k < frames; ++k) content.variables[0].values.push_back(k / 16.0);
    for (int i = 0; i < cells; ++i) {
      content.variables[1].values.push_back((i + 0.5) / cells);
      content.variables[4].values.push_back(goal_of(0, i));
    }
    for (int run = 0; run < runs; ++run) {
      for (int k = 0; k < frames; ++k) {
        for (int i = 0; i < cells; ++i)
          content.variables[2].values.push_back(k == 0 ? start_of(run, i) : goal_of(run, i));
      }
      for (int i = 0; i < cells; ++i) content.variables[3].values.push_back(goal_of(run, i));
    }
    if (change) change(content);
    write(name, compose_netcdf(std::move(content)));
  }
  std::string task(const std::string& lines,
                   const std::string& options = "adam(rate = 1e-2), batch 2, epochs 3") const {
    write("t.dpde", rod_with_window + "task t : s { learn heater; " + lines + "; using " + options + " }\n");
    return "t.dpde t --json";
  }
  Json learn(const std::string& lines, const std::string& more = "",
             const std::string& options = "adam(rate = 1e-2), batch 2, epochs 3") const {
    const Outcome outcome = dpde("optimize " + task(lines, options) + more);
    EXPECT_EQ(outcome.status, 0) << lines << outcome.err;
    return outcome.json();
  }
};

TEST_F(WindowGoals, AreWhatTheLastFrameIs) {
  write_runs("pairs.nc", 2);
  write_runs("starts.nc", 1);
  const Json pairs = learn("data r = trajectories(\"pairs.nc\", u); minimise mean((u - r)^2) over 4 steps");
  const std::string by_goal = "data r = trajectories(\"starts.nc\", goal); minimise mean((u - r)^2) after 4 steps";
  const Json goals = learn(by_goal, " --out o --threads 2");
  EXPECT_EQ(goals["windows"], runs);
  ASSERT_EQ(goals["loss"].size(), pairs["loss"].size());
  for (std::size_t k = 0; k < goals["loss"].size(); ++k)
    EXPECT_NEAR(goals["loss"][k].get<double>(), pairs["loss"][k].get<double>(), 1e-12);
  EXPECT_EQ(learn(by_goal, " --threads 1")["loss"], goals["loss"]);
  learn(by_goal, " --out p --epochs 1");
  EXPECT_EQ(learn(by_goal, " --out p --resume")["loss"], goals["loss"]);
  EXPECT_EQ(content(path("p/heater.safetensors")), content(path("o/heater.safetensors")));
  const std::string test = "; test miss = mean(abs(u - r)) on trajectories(\"starts.nc\") for 4 steps";
  const Json tested = dpde("test " + task(by_goal + test) + " --from o").json()["test"]["miss"];
  EXPECT_EQ(tested["t"].size(), 4u) << "all states are looked at";
  const Json same = learn("data r = trajectories(\"starts.nc\", same); minimise mean((u - r)^2) after 4 steps");
  EXPECT_NE(same["loss"], goals["loss"]);
  const Json verified = dpde("verify " + task(by_goal)).json();
  EXPECT_EQ(verified["passed"], true) << verified;
  EXPECT_NEAR(verified["taylor"]["slope"].get<double>(), 2, 0.01);
}

/// The loss of states alone is over all of them, as it is with unread data of each step.
TEST_F(WindowGoals, NeedNoData) {
  write_runs("starts.nc", 2);
  const std::string loss = "; minimise (mean(u) - 0.7)^2, mean over 6 steps; minimise 1e-2*mean(u^2) after 6 steps",
                    options = "adam(rate = 1e-2), batch 2, epochs 4, unroll (3, 6), cut 2";
  const Json states = learn("data begin = trajectories(\"starts.nc\")" + loss, "", options);
  EXPECT_EQ(states["windows"], 2 * runs);
  write_runs("close.nc", 2, [](NetcdfContent& content) { content.variables[0].values[1] = 1 / 64.0; });
  const Json unread = learn("data r = trajectories(\"close.nc\", u)" + loss, "", options);
  EXPECT_EQ(states["loss"], unread["loss"]);
  const Json verified = dpde("verify " + task("data begin = trajectories(\"starts.nc\")" + loss)).json();
  EXPECT_EQ(verified["passed"], true) << verified;
  EXPECT_NEAR(verified["taylor"]["slope"].get<double>(), 2, 0.01);
}

/// A control, a number or a field, that is unknown in each sample has the sample's intervals, whatever the length of
/// its scene.
TEST_F(WindowGoals, ControlsAreThoseOfTheWindow) {
  write_runs("pairs.nc", 2);
  for (const std::string kind : {"control", "control field"}) {
    std::vector<Json> losses;
    for (const std::string end : {"1/16", "1/64", "3/64", "1"}) {
      write("c.dpde", "model rod { field u; param k = 0.05; " + kind + R"( c; dt(u) = k*lap(u) + c }
scene s : rod { grid x = 0 .. 1, cells 8, periodic; initial u = 0; c = 0 every 1/32; time 0 .. )" +
                          end +
                          R"(, step 1/64 }
task t : s {
  data r = trajectories("pairs.nc", u)
  unknown c from 0.1 + t
  minimise mean((u - r)^2) over 4 steps
  using lbfgs(), iterations 3
})");
      const Outcome outcome = dpde("optimize c.dpde t --json --out o" + std::to_string(losses.size() + kind.size()));
      ASSERT_EQ(outcome.status, 0) << kind << " to " << end << outcome.err;
      losses.push_back(outcome.json()["loss"]);
      EXPECT_EQ(losses.back(), losses.front()) << kind << " to " << end;
    }
  }
}

/// A data set with a single frame, the initial state of each run.
TEST_F(WindowGoals, BeginWithTheOnlyFrameOfADataSet) {
  const std::string begins = rod_with_window +
                             "scene starts : rod { grid x = 0 .. 1, cells 8, periodic; k = 0; initial u = noise(1)\n"
                             "  time -1 .. 0, step 1 }\n"
                             "dataset d : starts { runs 2; frames every 1 from 0; file \"one.nc\" }\n";
  write("d.dpde", begins);
  const Outcome made = dpde("run d.dpde d --out . --json");
  ASSERT_EQ(made.status, 0) << made.err;
  EXPECT_EQ(made.json()["frames"], 1);
  EXPECT_TRUE(made.json()["residuals"]["u"].is_null());
  const Json learnt = learn("data begin = trajectories(\"one.nc\"); minimise mean(u^2) after 4 steps");
  EXPECT_EQ(learnt["windows"], 2);
  EXPECT_LT(learnt["loss"].back(), learnt["loss"].front());
  write("d.dpde", std::string(begins).replace(begins.find("from 0;"), 7, "from 1;"));
  const Outcome none = dpde("run d.dpde d --out . --json");
  EXPECT_EQ(none.status, 2);
  EXPECT_NE(none.err.find("are none up to t = 0"), std::string::npos) << none.err;
}

/// A file that contains nothing else.
TEST_F(WindowGoals, MayBeOfAnotherFile) {
  write_runs("starts.nc", 1);
  write_runs("goals.nc", 1, [](NetcdfContent& content) {
    std::erase_if(content.variables, [](const auto& each) { return each.name == "u" || each.name == "time"; });
  });
  const std::string loss = "; minimise mean((u - r)^2) after 4 steps",
                    begin = "data begin = trajectories(\"starts.nc\"); ";
  const Json one = learn("data r = trajectories(\"starts.nc\", goal)" + loss);
  EXPECT_EQ(learn(begin + "data r = trajectories(\"goals.nc\", goal)" + loss)["loss"], one["loss"]);
  const Json same = learn("data r = trajectories(\"starts.nc\", same)" + loss);
  EXPECT_EQ(learn(begin + "data r = trajectories(\"goals.nc\", same)" + loss)["loss"], same["loss"]);
}

TEST_F(WindowGoals, SayWhatDoesNotFit) {
  write_runs("f.nc", 2);
  write_runs("one.nc", 1);
  write_runs("other.nc", 2, [](NetcdfContent& content) { content.variables[3].values[3] = NAN; });
  write_runs("few.nc", 2, [](NetcdfContent& content) {
    content.dimensions.push_back({"run2", 2});
    content.variables[3].dimensions = {"run2", "x"};
    content.variables[3].values.resize(2 * cells);
  });
  const struct {
    const char *lines, *said;
  } cases[] = {
      {"data b = trajectories(\"f.nc\"); minimise mean((u - b)^2) over 4 steps", "where windows begin"},
      {"data b = trajectories(\"f.nc\"); minimise mean(u^2) over 4 steps; test e = mean(b) on trajectories(\"f.nc\") "
       "for 4 steps",
       "where windows begin"},
      {"data r = trajectories(\"one.nc\", u); minimise mean((u - r)^2) over 4 steps", "needs at least two"},
      {"data r = trajectories(\"other.nc\", goal); minimise mean((u - r)^2) after 4 steps", "run 0, cell 3"},
      {"data r = trajectories(\"few.nc\", goal); minimise mean((u - r)^2) after 4 steps", "other runs or times"},
      {"data r = trajectories(\"f.nc\", u); minimise mean((u - r)^2) after 6 steps", "no multiple"},
      {"data b = trajectories(\"f.nc\"); minimise mean(u^2) after 4 steps; minimise mean(u^2) over 6 steps",
       "together with one over"},
      {"data b = trajectories(\"f.nc\"); minimise average(mean(u^2)) after 4 steps", "over 8 steps"},
      {"data b = trajectories(\"f.nc\"); data c = trajectories(\"one.nc\"); minimise mean(u^2) after 4 steps",
       "second file"},
  };
  for (const auto& [lines, said] : cases) {
    const Outcome refused = dpde("optimize " + task(lines));
    EXPECT_EQ(refused.status, 2) << lines << refused.err;
    EXPECT_NE(refused.err.find(said), std::string::npos) << lines << "\n" << refused.err;
  }
}

/// Samples begin with frames of one file and are compared with another's: dt(u) = b from u = 0 at each frame k, data
/// 0.3 t, so the best b is 0.3 times the mean of k + 1 over the samples. With frames of the data it is 0.3.
TEST_F(WindowGoals, MayBeginWithFramesOfAnotherFile) {
  constexpr int frames = 5;
  const auto runs_of = [&](const std::string& name, double slope, int count, double begin = 0,
                           const std::vector<double>& c = {1, 2}) {
    NetcdfContent content;
    content.dimensions = {{"run", 2}, {"time", count}, {"x", cells}};
    content.variables = {{"time", {"time"}, {}, {}}, {"x", {"x"}, {}, {}}, {"u", {"run", "time", "x"}, {}, {}}};
    if (c.size() == 2) content.variables.push_back({"c", {"run"}, {}, c});
    if (c.size() == 1) content.variables.push_back({"c", {}, {}, c});
    for (int k = 0; k < count; ++k) content.variables[0].values.push_back(begin + k / 64.0);
    for (int i = 0; i < cells; ++i) content.variables[1].values.push_back((i + 0.5) / cells);
    for (int i = 0; i < 2 * count * cells; ++i) {
      const double t = content.variables[0].values[static_cast<std::size_t>(i / cells % count)];
      content.variables[2].values.push_back(slope * t);
    }
    write(name, compose_netcdf(std::move(content)));
  };
  const auto learn_from = [&](const std::string& data) {
    write("b.dpde",
          "model m { field u; param b = 0, c = 1; dt(u) = b*c/c }\n"
          "scene s : m { grid x = 0 .. 1, cells 8, periodic; initial u = 0; time 0 .. 1, step 1/64 }\n"
          "task t : s { unknown b; " +
              data +
              "; minimise mean((u - r)^2) over 1 steps\n"
              "  using lbfgs(), epochs 5\n"
              "  test e = mean(abs(u - r)) on trajectories(\"truth.nc\") for 2 steps }\n");
    return dpde("optimize b.dpde t --json --beside-named-only --out o");
  };
  runs_of("rest.nc", 0, frames);
  runs_of("truth.nc", 0.3, frames);
  const std::string rest = "data begin = trajectories(\"rest.nc\"); ", truth = "data r = trajectories(\"truth.nc\", u)";
  EXPECT_NEAR(learn_from(truth).json()["unknowns"]["b"]["value"].get<double>(), 0.3, 1e-9);
  const Json apart = learn_from(rest + truth).json();
  EXPECT_NEAR(apart["unknowns"]["b"]["value"].get<double>(), 0.3 * 2.5, 1e-9);
  EXPECT_EQ(apart["windows"], 2 * (frames - 1));
  EXPECT_TRUE(apart["test"]["e"]["conditions"]["training_file"].get<bool>()) << apart;
  EXPECT_EQ(dpde("verify b.dpde t").status, 0);
  runs_of("late.nc", 0.3, frames, 1);
  runs_of("short.nc", 0.3, 3);
  const auto refused = [&](const std::string& data, const std::string& part) {
    const Outcome outcome = learn_from(data);
    EXPECT_EQ(outcome.status, 2) << data;
    EXPECT_NE(outcome.err.find(part), std::string::npos) << outcome.err;
  };
  refused(rest + "data r = trajectories(\"late.nc\", u)", "its frame 0 is at t = 1, that of");
  refused(rest + "data r = trajectories(\"short.nc\", u)", "it has 3 frames, ");
  runs_of("plain.nc", 0.3, frames, 0, {1});
  runs_of("silent.nc", 0.3, frames, 0, {});
  runs_of("turned.nc", 0.3, frames, 0, {2, 1});
  const std::string other = "data begin = trajectories(\"plain.nc\"); ";
  refused(rest + "data r = trajectories(\"plain.nc\", u)", "its run 1 has c = 1, that of");
  refused(rest + "data r = trajectories(\"turned.nc\", u)", "its run 0 has c = 2, that of");
  refused(other + truth, "its run 1 has c = 2, that of");
  refused("data begin = trajectories(\"silent.nc\"); " + truth, "its run 0 has c = 1, that of");
  EXPECT_EQ(learn_from(rest + "data r = trajectories(\"silent.nc\", u)").status, 0);
  refused(truth + "; data q = trajectories(\"rest.nc\", u)", "data begin = trajectories(\"truth.nc\")");
  refused(rest + "data other = trajectories(\"truth.nc\"); " + truth,
          "a second file of trajectories (rest.nc and truth.nc)");
}

}  // namespace
}  // namespace dpde::testing
