// SPDX-License-Identifier: Apache-2.0
// What a rollout allocates, counted where it is allocated. Inside the runtime only.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "dpde/runtime/executor.h"
#include "grid/field_pool.h"

namespace dpde {

/// What a plan counts is what a run takes, since both come here.
class RunMemory {
 public:
  enum class Purpose { run, plan };  // plan: nothing is bound, and memory is counted only
  /// `is_of_gradient`: pools are taken from the system at once, so that what does not fit is told before the run and
  /// not on the way back.
  explicit RunMemory(Purpose purpose, bool is_of_gradient = false) : purpose_(purpose), touches_(is_of_gradient) {}

  bool is_plan() const { return purpose_ == Purpose::plan; }
  /// Of no memory in a plan.
  FieldPool pool(const dpde_layout& layout, int64_t count, const std::string& folder = {});
  /// State `number`, which the caller sets.
  void add_initial(const dpde_layout& layout, int number);
  /// What it holds beside its fields.
  void add_program(const Executor& executor) { programs_.emplace_back(&executor.program(), executor.memory()); }
  /// Of a program that is dropped, with so many bytes of pools.
  void give_back(const dpde_program& program, int64_t bytes) {
    bytes_ -= bytes;
    std::erase_if(programs_, [&](const auto& one) { return one.first == &program; });
  }

  /// Of all pools in memory and the initial states.
  int64_t bytes() const { return bytes_; }
  /// Of programs.
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
