// SPDX-License-Identifier: Apache-2.0
// Rollouts shared by several tests: Burgers' equation on a line of 16 cells with losses against random data.
#pragma once

#include <random>
#include <string>
#include <vector>

#include "burgers_programs.h"
#include "dpde/runtime/rollout.h"

namespace dpde::test {

constexpr int64_t cells = 16;

inline dpde_layout line(int64_t n = cells) { return make_layout(std::vector<int64_t>{n}, {1, 0, 0}); }

inline std::vector<double> random_values(int64_t count, uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::vector<double> values(static_cast<size_t>(count));
  for (double& value : values) value = uniform(random);
  return values;
}

/// Burgers with losses against random data at several steps: term 0 has one target for all, term 1 one per step.
struct BurgersCase {
  BurgersPrograms programs;
  dpde_layout layout = line();
  std::vector<Field> targets;

  BurgersCase() {
    for (int i = 0; i < 4; ++i) {
      targets.emplace_back(layout);
      targets.back().copy_in(random_values(cells, 100 + static_cast<uint64_t>(i)));
    }
  }
  RolloutSetup setup(int steps, std::vector<int> one, std::vector<int> each) {
    RolloutSetup setup;
    setup.step = &programs.step.table();
    setup.adjoint = &programs.adjoint.table();
    setup.layout = layout;
    setup.steps = steps;
    setup.dt = 0.05;
    setup.params = {{"hx", 0.5}, {"nu", 0.3}};
    const dpde_program *loss = &programs.loss.table(), *adjoint = &programs.loss_adjoint.table();
    if (!one.empty()) setup.losses.push_back({loss, adjoint, one, 0.7, {{"target", {targets[0].base()}}}});
    if (!each.empty()) {
      LossData data{"target", {}};
      for (size_t i = 0; i < each.size(); ++i) data.at.push_back(targets[1 + i % 3].base());
      setup.losses.push_back({loss, adjoint, each, 1.3, {data}});
    }
    return setup;
  }
};

inline std::vector<double> bars_of(const dpde_layout& layout, const GradientResult& result, size_t state = 0) {
  std::vector<double> dense(static_cast<size_t>(cell_count(layout)));
  copy_out(result.state_bars[state], dense);
  return dense;
}

}  // namespace dpde::test
