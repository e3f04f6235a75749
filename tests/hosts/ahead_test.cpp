// SPDX-License-Identifier: Apache-2.0
// Scenes built ahead of time against the same scenes compiled in memory, and tasks against what the command computes by
// its own way (driver/inverse): three ways to one number. Closed forms are in simulation_test.cpp and
// dsl-examples/hosts.
#include <dlfcn.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <random>

#include "dpde/dpde.h"
#include "support/json.h"
#include "support/setting.h"

namespace dpde {
namespace {

namespace fs = std::filesystem;

struct Case {
  std::string file, name;
  std::map<std::string, std::string> set;
  std::vector<std::string> data;  // given by the host, the same to both
};

/// Boundaries, several axes, reads at computed places, several states, data of one and of many times, controls, parts
/// of steps, reductions, an adjoint that is given, control fields and noise.
const Case cases[] = {
    {"heat/heat.dpde", "conductivity", {{"cells", "24"}}, {}},
    {"heat/heat.dpde", "recover", {{"cells", "32"}}, {"u_ref"}},
    {"heat/heat.dpde", "slab", {{"cells", "7"}, {"step", "0.00025"}}, {}},
    {"heat/heat.dpde", "block", {{"cells", "5"}, {"end", "0.015625"}}, {}},
    {"burgers_1d/burgers.dpde", "recover", {{"cells", "32"}}, {"u_ref"}},
    {"burgers_1d/burgers.dpde", "viscosity", {{"cells", "5"}, {"step", "0.0078125"}}, {}},
    {"burgers_2d/burgers_2d.dpde", "recover", {{"cells", "16"}, {"end", "0.25"}}, {"u_ref", "v_ref"}},
    {"advection/advection.dpde", "speed", {{"cells", "32"}}, {"u_ref"}},
    {"heat/steer.dpde", "steer", {{"cells", "16"}}, {}},
    {"burgers_1d/burgers.dpde", "viscosity", {{"cells", "24"}, {"step", "0.0625"}, {"courant", "0.2"}}, {}},
    {"../tests/golden/zonal_mean/in.dpde", "t", {}, {}},
    {"../tests/golden/given_adjoint/in.dpde", "t", {}, {}},
    {"../tests/golden/repeat/in.dpde", "find", {}, {}},
    {"../tests/golden/subcycles/in.dpde", "s", {}, {}},
    {"../tests/golden/control_field/in.dpde", "t", {}, {}},
    {"../tests/golden/network/in.dpde", "t", {}, {}},
    // Kinds of operations that the examples lack: solves by steps and by Newton's method, transforms.
    {"../tests/golden/stream_function/in.dpde", "start", {}, {}},
    {"../tests/golden/newton/in.dpde", "start", {}, {}},
    {"../tests/golden/spectral/in.dpde", "seek", {}, {}},
    // At night: solves of stages, of constraints, and steps under a tolerance.
    {"../tests/golden/ars222/in.dpde", "start", {}, {}},
    {"../tests/golden/projection/in.dpde", "viscosity", {}, {}},
    {"../tests/golden/tolerance/in.dpde", "few", {}, {}},
    // At night: poles and radiating sides, steady states with a network, masks, events and parts of steps; kinds of
    // sides, of axes, of schemes.
    {"../tests/hosts/kinds.dpde", "pole", {}, {}},
    {"../tests/hosts/kinds.dpde", "steady", {}, {}},
    {"../tests/hosts/kinds.dpde", "events", {}, {}},
    {"../tests/golden/outflow/in.dpde", "begin", {}, {}},
    {"../tests/golden/maccormack/in.dpde", "back", {}, {}},
    {"../tests/golden/stretched/in.dpde", "start", {}, {}},
    {"../tests/golden/vector_2d/in.dpde", "trace", {}, {"u_ref.x", "u_ref.y"}},
    {"../tests/golden/walls/in.dpde", "t", {}, {}},
    {"../tests/golden/wall_weight/in.dpde", "transfer", {}, {}},
    {"../tests/golden/parts/in.dpde", "strength", {}, {}},
    {"../tests/golden/leapfrog/in.dpde", "strike", {}, {}},
    {"../tests/golden/given_staggered/in.dpde", "t", {}, {}},
    {"../tests/golden/shallow_water_2d/in.dpde", "surface", {}, {"seen", "flow.x"}},
};

constexpr int examples = 16, by_day = 19;  // of the cases

std::string example(const Case& c) { return DPDE_SOURCE_DIR "/dsl-examples/" + c.file; }

std::string settings(const Case& c) {
  std::string text;
  for (const auto& [key, value] : c.set) text += " --set " + key + "=" + value;
  return text;
}

void expect_close(std::span<const double> a, std::span<const double> b, double tolerance, const std::string& what) {
  ASSERT_EQ(a.size(), b.size()) << what;
  double scale = 0, difference = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    scale = std::max(scale, std::abs(b[i]));
    difference = std::max(difference, std::abs(a[i] - b[i]));
  }
  EXPECT_LE(difference, tolerance * scale) << what;
}

class AheadOfTime : public ::testing::TestWithParam<int> {
 protected:
  void SetUp() override {
    folder_ = fs::path(::testing::TempDir()) / ("dpde_ahead_" + std::to_string(GetParam()));
    fs::remove_all(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  const Case& example_case() const { return cases[GetParam()]; }

  /// The scene of the library that `dpde build` makes.
  const dpde_scene* build() {
    const Case& c = example_case();
    const std::string command = DPDE_BINARY_DIR "/bin/dpde build " + example(c) + " " + c.name + " -o " +
                                folder_.string() + settings(c) + " --quiet";
    EXPECT_EQ(std::system(command.c_str()), 0) << command;
    void* library = dlopen((folder_ / ("lib" + c.name + ".so")).c_str(), RTLD_NOW | RTLD_LOCAL);
    EXPECT_NE(library, nullptr) << dlerror();
    return library ? static_cast<const dpde_scene*>(dlsym(library, (c.name + "_scene").c_str())) : nullptr;
  }
  void give_data(Simulation& sim, const Case& c) {
    std::mt19937 random(7);
    std::vector<double> values(sim.size());
    for (double& value : values) value = std::uniform_real_distribution<double>(-1, 1)(random);
    for (const std::string& name : c.data) sim.set_field(name, values);
  }

  fs::path folder_;
};

TEST_P(AheadOfTime, RunsAndDifferentiatesAsInMemory) {
  if (!testing::is_tried(GetParam(), 2)) GTEST_SKIP() << "at night";
  if (GetParam() >= by_day && std::getenv("DPDE_THOROUGH") == nullptr) return;
  const Case& c = example_case();
  const dpde_scene* scene = build();
  ASSERT_NE(scene, nullptr);
  for (const int slots : {0, 3}) {
    Simulation ahead(*scene, {.slots = slots});
    Simulation in_memory = compile_file(example(c), {.name = c.name, .set = c.set, .force = true});
    give_data(ahead, c);
    give_data(in_memory, c);
    EXPECT_EQ(ahead.states(), in_memory.states());
    ahead.run();
    in_memory.run();
    for (const std::string& state : ahead.states())
      expect_close(ahead.state(state), in_memory.state(state), 1e-12, state);
    EXPECT_EQ(ahead.outputs(), in_memory.outputs());
    for (const std::string& output : ahead.outputs())
      expect_close(ahead.output(output), in_memory.output(output), 1e-12, output);
    if (scene->task == nullptr) continue;
    const double loss = ahead.gradient();
    EXPECT_NEAR(loss, in_memory.gradient(), 1e-12 * std::abs(loss));
    EXPECT_EQ(ahead.unknowns(), in_memory.unknowns());
    for (const std::string& unknown : ahead.unknowns())
      expect_close(ahead.gradient_of(unknown), in_memory.gradient_of(unknown), 1e-11, unknown);
  }
}

TEST_P(AheadOfTime, RunsOnOtherGrids) {
  if (GetParam() >= examples) return;
  if (!testing::is_tried(GetParam(), 3)) GTEST_SKIP() << "at night";
  const Case& c = example_case();
  Simulation in_memory = compile_file(example(c), {.name = c.name, .set = c.set, .force = true});
  const dpde_scene* scene = build();
  ASSERT_NE(scene, nullptr);
  std::vector<std::int64_t> cells = in_memory.cells();
  for (std::int64_t& n : cells) n = n < 8 ? n + 3 : n / 2;
  std::map<std::string, std::string> set = c.set;
  set["cells"] = std::to_string(cells[0]);
  Simulation same = compile_file(example(c), {.name = c.name, .set = set, .force = true}),
             ahead(*scene, {.cells = cells});
  EXPECT_EQ(ahead.cells(), cells);
  same.step(20);
  ahead.step(20);
  for (const std::string& state : ahead.states()) expect_close(ahead.state(state), same.state(state), 1e-12, state);
}

TEST_P(AheadOfTime, InMemoryAgreesWithTheCommand) {
  if (GetParam() >= examples) return;
  const Case& c = example_case();
  Simulation sim = compile_file(example(c), {.name = c.name, .set = c.set, .force = true});
  if (sim.unknowns().empty()) return;  // a scene: nothing to differentiate
  fs::create_directories(folder_);
  const std::string command = DPDE_BINARY_DIR "/bin/dpde gradient " + example(c) + " " + c.name + settings(c) +
                              " --json >" + (folder_ / "out").string();
  ASSERT_EQ(std::system(command.c_str()), 0) << command;
  std::ifstream file(folder_ / "out");
  const Json json = parse_json(std::string(std::istreambuf_iterator<char>(file), {})).value();
  EXPECT_NEAR(sim.gradient(), json["loss"].get<double>(), 1e-12 * json["loss"].get<double>());
  for (const std::string& unknown : sim.unknowns()) {
    double square = 0;
    for (const double value : sim.gradient_of(unknown)) square += value * value;
    const double norm = json["gradient"][unknown]["norm"];
    EXPECT_NEAR(std::sqrt(square), norm, 1e-11 * norm) << unknown;
  }
}

INSTANTIATE_TEST_SUITE_P(Examples, AheadOfTime, ::testing::Range(0, static_cast<int>(std::size(cases))),
                         [](const auto& info) { return cases[info.param].name + "_" + std::to_string(info.param); });

}  // namespace
}  // namespace dpde
