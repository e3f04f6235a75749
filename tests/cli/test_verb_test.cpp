// SPDX-License-Identifier: Apache-2.0
// dpde test: the report of optimize on a task's tests, without optimising anything.
#include <algorithm>
#include <array>
#include <string_view>

#include "command_support.h"
#include "learning_scenes.h"

namespace dpde::testing {
namespace {

const std::string tested_scenes = scenes_without_network + R"(
network first(u) { real f64; initial he, seed 1; conv 2, 3; tanh; conv out, 1, gain = 0.01 }
network second(u) { real f64; initial he, seed 2; conv 2, 3; tanh; conv out, 1, gain = 0.01 }
scene coarse = fine { cells 8; after step: u += first(u) + second(u) }
)";

const std::string tested_task = R"(task learn : coarse {
  data r = trajectories("train.nc", u)
  learn first; learn second; unknown nu from 0.04 in 0 .. 1
  minimise mean((u - r)^2) over 2 steps
  using adam(rate = 1e-3), batch 4, epochs 2, trials 2
  test err = mean(abs(u - r)) on trajectories("unseen.nc") for 8 steps beside bare
  statistic energy = mean(u^2) on trajectories("unseen.nc") for 8 steps beside bare
  spectrum waves = u on trajectories("unseen.nc") for 8 steps beside bare
  correlation alike = u above 0.9 on trajectories("unseen.nc") for 8 steps
  growth rate on trajectories("unseen.nc") for 4 steps
}
)";

/// Removes measured times and everything that depends on them, as they differ each time.
Json without_times(const Json& json) {
  if (!json.is_object()) return json;
  constexpr std::array<std::string_view, 4> timed{"cost_s", "equal_error", "equal_cost", "break_even"};
  Json rest = Json::object();
  for (const auto& [key, value] : json.items()) {
    if (std::ranges::find(timed, key) == timed.end()) rest[key] = without_times(value);
  }
  return rest;
}

class TestVerb : public Command {
 protected:
  void make_data() const {
    write("t.dpde", tested_scenes + tested_task);
    for (const std::string set : {"train", "unseen"}) ASSERT_EQ(dpde("run t.dpde " + set + " --out .").status, 0);
  }
  static void expect_same(const Json& one, const Json& other) {
    for (const char* key : {"test", "statistic", "spectrum", "correlation", "growth"})
      EXPECT_EQ(without_times(one.at(key)), without_times(other.at(key))) << key;
  }
  void expect_values_one_by_one(const Json& trained) const {
    const std::string both = " --weights o/first.safetensors --weights second=o/second.safetensors";
    const std::string nu = " --set nu=" + trained["unknowns"]["nu"]["value"].dump();
    const Json tested = dpde("test t.dpde learn --json --beside-named-only" + both + nu).json();
    EXPECT_EQ(tested["test"]["err"]["runs"], trained["test"]["err"]["runs"]);
    const Json begun = dpde("test t.dpde learn --json --beside-named-only").json();
    EXPECT_EQ(begun["test"]["err"]["runs"], begun["test"]["err"]["start"]["runs"]);
    EXPECT_EQ(begun["unknowns"]["nu"]["value"], 0.04);
    const Json set = dpde("test t.dpde learn --from o --set nu=0.04 --json --beside-named-only").json();
    EXPECT_EQ(set["unknowns"]["nu"]["value"], 0.04) << "settings stand above what was found";
    EXPECT_NE(set["test"]["err"]["mean"], trained["test"]["err"]["mean"]);
  }
};

TEST_F(TestVerb, SaysWhatTheTrainingSaid) {
  make_data();
  const Outcome trained = dpde("optimize t.dpde learn --out o --json --beside-named-only");
  ASSERT_EQ(trained.status, 0) << trained.err;
  const Outcome tested = dpde("test t.dpde learn --from o --out w --json --beside-named-only");
  ASSERT_EQ(tested.status, 0) << tested.err;
  const Json json = tested.json();
  expect_same(json, trained.json());
  EXPECT_EQ(json["best_trial"], trained.json()["best_trial"]);
  EXPECT_EQ(json["test"]["err"]["trials"]["each"].size(), 2u);
  EXPECT_EQ(json["unknowns"]["nu"]["value"], trained.json()["unknowns"]["nu"]["value"]);
  EXPECT_FALSE(json["test"]["err"]["break_even"]["data_s"].is_null());
  const double all_s = trained.json()["test"]["err"]["break_even"]["all_trainings_s"].get<double>();
  EXPECT_NEAR(json["test"]["err"]["break_even"]["all_trainings_s"].get<double>(), all_s, 1e-9 * all_s);
  for (const Json& file : json["files"]) {
    const std::string name = fs::path(file.get<std::string>()).filename();
    EXPECT_TRUE(fs::exists(path("o/" + name))) << name;
    if (name.ends_with(".csv") && !name.ends_with("_beside.csv"))
      EXPECT_EQ(content(path("w/" + name)), content(path("o/" + name)));
  }
  expect_values_one_by_one(trained.json());
  fs::remove(path("train.nc"));
  std::string more = tested_task;
  more.replace(more.find("trials 2"), 8, "epochs 7");
  more.replace(more.find("epochs 2, epochs"), 16, "epochs");
  more.insert(more.find("  growth"), "  test most = max(abs(u - r)) on trajectories(\"unseen.nc\") for 4 steps\n");
  write("t.dpde", tested_scenes + more);
  const Json without = dpde("test t.dpde learn --from o --threads 1 --json --beside-named-only").json();
  EXPECT_TRUE(without["test"]["most"]["mean"].is_number()) << without;
  EXPECT_TRUE(without["test"]["err"]["break_even"]["data_s"].is_null());
  EXPECT_EQ(without["test"]["err"]["conditions"]["knows_training"], false);
  EXPECT_EQ(json["test"]["err"]["conditions"]["knows_training"], true);
  EXPECT_EQ(without["test"]["err"]["runs"], json["test"]["err"]["trials"]["each"][0]["runs"]);
}

TEST_F(TestVerb, RunsTasksWithoutTrajectories) {
  write("t.dpde", tested_scenes + R"(task find : fine {
    data seen = u from scene fine
    unknown nu from 0.02; unknown initial u from 0.5*sin(x)
    minimise mean((u - seen)^2)
    using lbfgs(), iterations 3
    test far = mean(abs(u - seen))
  }
)");
  const Outcome found = dpde("optimize t.dpde find --out o --json");
  ASSERT_EQ(found.status, 0) << found.err;
  const Json tested = dpde("test t.dpde find --from o --json").json();
  EXPECT_EQ(tested["test"], found.json()["test"]);
  EXPECT_EQ(tested["unknowns"]["nu"]["value"], found.json()["unknowns"]["nu"]["value"]);
  EXPECT_NE(dpde("test t.dpde find --json").json()["test"], found.json()["test"]);
  const Outcome burst = dpde("test t.dpde find --set nu=1e3 --force --json");
  EXPECT_EQ(burst.status, 1) << burst.out;
}

TEST_F(TestVerb, RefusesWhatItCannotTest) {
  make_data();
  ASSERT_EQ(dpde("optimize t.dpde learn --out o --epochs 1 --beside-named-only").status, 0);
  write("junk.safetensors", "junk");
  fs::create_directories(path("damaged"));
  std::string half = content(path("o/learn.training"));
  half.resize(half.size() / 2);
  write("damaged/learn.training", half);
  std::string swapped = tested_scenes + tested_task;
  swapped.replace(swapped.find("learn first; learn second"), 25, "learn second");
  write("swapped.dpde", swapped);
  std::string bare = tested_scenes + tested_task;
  bare.erase(bare.find("  test err"));
  write("bare.dpde", bare + "}\n");
  const struct {
    const char *arguments, *code, *said;
  } cases[] = {
      {"bare.dpde learn", "E0908", "task learn has no tests"},
      {"t.dpde coarse", "E0908", "there is no task"},
      {"t.dpde learn --from nowhere", "E0901", "nowhere/learn.training"},
      {"t.dpde learn --from damaged", "E0907", "damaged"},
      {"swapped.dpde learn --from o", "E0907", "the unknowns nu 1, first 11, second 11"},
      {"t.dpde learn --weights junk.safetensors", "E0904", "of which network"},
      {"t.dpde learn --weights first=junk.safetensors", "E0907", "junk.safetensors"},
      {"t.dpde learn --weights third=o/first.safetensors", "E0904", "learns no network third"},
      {"t.dpde learn --weights o/first.safetensors --weights first=o/first.safetensors", "E0904", "two files"},
  };
  for (const auto& [arguments, code, said] : cases) {
    const Outcome refused = dpde(std::string("test ") + arguments + " --json --beside-named-only");
    EXPECT_EQ(refused.status, 2) << arguments << refused.err;
    EXPECT_EQ(refused.codes(), std::vector<std::string>{code}) << arguments << refused.err;
    EXPECT_NE(refused.err.find(said), std::string::npos) << arguments << refused.err;
  }
}

}  // namespace
}  // namespace dpde::testing
