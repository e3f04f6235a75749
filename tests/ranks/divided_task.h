// SPDX-License-Identifier: Apache-2.0
// A task run by one engine, and by ranks in threads whose engines have a subgrid each.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "dpde/runtime/engine.h"
#include "support/opened_scene.h"

namespace dpde::testing {

/// Ranks along the axes.
using Ranks = std::array<std::int64_t, 3>;

struct TaskOutcome {
  /// Of the whole grid, x fastest: states at the end, gradients by fields and products with all rates 1.
  std::map<std::string, std::vector<double>> fields;
  /// The same at all ranks, or `ranks_agree` is false: loss, observables, gradients by parameters and controls.
  std::map<std::string, std::vector<double>> numbers;
  bool ranks_agree = true;
  bool operator==(const TaskOutcome&) const = default;
};

class DividedTask {
 public:
  /// A task with unknowns. Any diagnostic of error severity fails the running test.
  explicit DividedTask(const std::string& text, const std::string& task = "t", OpenWith with = {});
  ~DividedTask();

  const dpde_scene& scene() const { return opened_.session->engine().scene(); }
  /// Runs it from where the task begins. {1, 1, 1}: the whole grid.
  TaskOutcome run(const Ranks& ranks, const EngineOptions& options = {});
  /// The text of the error that dividing it comes to; "": none.
  std::string error(const Ranks& ranks, const EngineOptions& options = {});

 private:
  void load(Engine& engine);
  void set_start(Engine& engine);
  void run(Engine& engine, TaskOutcome& own, TaskOutcome& all);

  OpenedScene opened_;
  std::unique_ptr<driver::Inverse> inverse_;
};

/// Runs the task on the whole grid and with each of these ranks: fields and what is decided by them have the same bits;
/// sums differ by `rounding`, relative to the largest of the numbers of one name, as those of subgrids are added up
/// first.
void expect_same(DividedTask& task, const std::vector<Ranks>& divisions, double rounding = 1e-13, double of_fields = 0,
                 const EngineOptions& options = {});

}  // namespace dpde::testing
