// SPDX-License-Identifier: Apache-2.0
// Counts the allocations of a rollout. Inside the runtime only.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "dpde/runtime/executor.h"
#include "grid/field_pool.h"

namespace dpde {

/// Plans and runs both allocate through this class, so that a plan counts exactly what a run takes.
class RunMemory {
 public:
  enum class Purpose { run, plan };  // plan: only counts, allocates nothing
  /// `is_of_gradient`: touches all pages of a pool immediately, so that missing memory is reported before the run and
  /// not during the adjoints.
  explicit RunMemory(Purpose purpose, bool is_of_gradient = false) : purpose_(purpose), touches_(is_of_gradient) {}

  bool is_plan() const { return purpose_ == Purpose::plan; }
  /// Without memory in a plan.
  FieldPool pool(const dpde_layout& layout, int64_t count, const std::string& folder = {});
  /// Counts state `number`, which the caller allocates.
  void add_initial(const dpde_layout& layout, int number);
  /// Counts the memory of a program besides its fields.
  void add_program(const Executor& executor) { programs_.emplace_back(&executor.program(), executor.memory()); }
  /// Removes a program that is dropped, with `bytes` bytes of pools.
  void give_back(const dpde_program& program, int64_t bytes) {
    bytes_ -= bytes;
    std::erase_if(programs_, [&](const auto& one) { return one.first == &program; });
  }

  /// Bytes of all pools in memory and of the initial states.
  int64_t bytes() const { return bytes_; }
  /// Memory of the programs.
  std::vector<OwnedMemory> owned() const {
    std::vector<OwnedMemory> all;
    for (const auto& [program, owned] : programs_) all.insert(all.end(), owned.begin(), owned.end());
    return all;
  }

 private:
  const Purpose purpose_;
  const bool touches_;
  int64_t bytes_ = 0;
  std::vector<std::pair<const dpde_program*, std::vector<OwnedMemory>>> programs_;
};

}  // namespace dpde
