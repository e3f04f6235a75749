// SPDX-License-Identifier: Apache-2.0
// tests/passes/*.stencil: a pass gives the expected text, the program verifies after it, running it again changes
// nothing, and programs compute the same on random fields before and after. The last holds for all passes in a row too.
#include "stencil/passes/passes.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <optional>

#include "stencil/analyse/verify_stencil.h"
#include "stencil_text.h"

namespace dpde::stencil {
namespace {

struct Example {
  std::string name, input, pass, expected;
};

std::vector<Example> examples() {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(DPDE_SOURCE_DIR "/tests/passes")) {
    if (entry.path().extension() == ".stencil") files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  std::vector<Example> result;
  for (const auto& path : files) {
    std::ifstream file(path);
    Example example{path.stem().string(), "", "", ""};
    for (std::string line; std::getline(file, line);) {
      if (line.starts_with("--- ")) {
        example.pass = line.substr(4);
      } else {
        (example.pass.empty() ? example.input : example.expected) += line + "\n";
      }
    }
    result.push_back(example);
  }
  return result;
}

std::vector<Pass> all_passes() {
  std::vector<Pass> passes(std::begin(default_passes), std::end(default_passes));
  passes.insert(passes.end(), std::begin(loop_passes), std::end(loop_passes));
  return passes;
}

std::optional<Pass> find_pass(const std::string& name) {
  for (const Pass& pass : all_passes()) {
    if (pass.name == name) return pass;
  }
  return std::nullopt;
}

/// Random inputs of a program.
struct Inputs {
  State state;
  Params params;
};

Inputs inputs_of(const Module& m, const Program& program, const Grid& grid) {
  Inputs inputs{State(grid, 3), {}};
  Random random(7);
  const Interface interface = interface_of(m, program);
  for (const std::string& field : interface.inputs) random.fill_interior(inputs.state, field);
  for (const std::string& name : interface.params) inputs.params[name] = 1.5 + random();
  return inputs;
}

/// The sums and result fields of a program, one after the other.
std::vector<double> results(const Module& m, const Program& program, Inputs inputs) {
  std::vector<double> values;
  for (const auto& [name, value] : interpret(m, program, inputs.state, inputs.params)) values.push_back(value);
  std::vector<std::string> fields = program.keeps;
  for (const Swap& swap : program.swaps) fields.push_back(swap.state);
  for (const std::string& field : fields) {
    const std::vector<double> interior = inputs.state.get(field);
    values.insert(values.end(), interior.begin(), interior.end());
  }
  return values;
}

void expect_same_results(const Module& before, const Module& after) {
  for (const Program& program : before.programs) {
    const Program* other = after.find_program(program.name);
    ASSERT_NE(other, nullptr);
    for_each_grid(static_cast<int>(program.axes.size()), 3, [&](const Grid& grid) {
      const Inputs inputs = inputs_of(before, program, grid);
      const std::vector<double> expected = results(before, program, inputs);
      const std::vector<double> computed = results(after, *other, inputs);
      ASSERT_EQ(expected.size(), computed.size());
      EXPECT_FALSE(expected.empty());
      for (std::size_t i = 0; i < expected.size(); ++i) {
        EXPECT_TRUE(std::isfinite(expected[i]));
        EXPECT_NEAR(expected[i], computed[i], 1e-13 * (1 + std::abs(expected[i])));
      }
    });
  }
}

TEST(Passes, EveryPassHasAnExample) {
  for (const Pass& pass : all_passes()) {
    const auto all = examples();
    EXPECT_TRUE(std::any_of(all.begin(), all.end(), [&](const Example& e) { return e.pass == pass.name; }))
        << pass.name;
  }
}

TEST(Passes, Examples) {
  for (const Example& example : examples()) {
    SCOPED_TRACE(example.name);
    const std::optional<Pass> pass = find_pass(example.pass);
    ASSERT_TRUE(pass) << example.pass;
    const Module before = module_of(example.input);
    EXPECT_EQ(verify(before), std::vector<std::string>{});
    const Module after = pass->run(before);
    EXPECT_EQ(print(after), example.expected);
    EXPECT_EQ(verify(after), std::vector<std::string>{});
    EXPECT_EQ(print(pass->run(after)), example.expected);
    expect_same_results(before, after);
  }
}

TEST(Passes, AllInARowKeepResults) {
  for (const Example& example : examples()) {
    SCOPED_TRACE(example.name);
    const Module before = module_of(example.input);
    Module after = before;
    for (const Pass& pass : all_passes()) after = pass.run(after);
    EXPECT_EQ(verify(after), std::vector<std::string>{});
    expect_same_results(before, after);
  }
}

}  // namespace
}  // namespace dpde::stencil
