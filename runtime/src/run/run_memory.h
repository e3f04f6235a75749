// SPDX-License-Identifier: Apache-2.0
// What a rollout allocates, counted where it is allocated. Inside the runtime only.
#pragma once

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <string>
#include <vector>

#include "dpde/runtime/executor.h"
#include "field_pool.h"

namespace dpde {

/// What a plan counts is what a run takes, since both come here.
class RunMemory {
 public:
  enum class Purpose { run, plan };  // plan: nothing is bound, and memory is counted only
  explicit RunMemory(Purpose purpose) : purpose_(purpose) {}

  bool is_plan() const { return purpose_ == Purpose::plan; }
  /// Of no memory in a plan.
  FieldPool pool(const dpde_layout& layout, int64_t count, const std::string& folder = {});
  /// State `number`, which the caller sets.
  void add_initial(const dpde_layout& layout, int number);
  /// What it holds beside its fields.
  void add_program(const Executor& executor) { std::ranges::move(executor.memory(), std::back_inserter(owned_)); }
  void give_back(int64_t bytes) { bytes_ -= bytes; }

  /// Of all pools in memory and the initial states.
  int64_t bytes() const { return bytes_; }
  /// Of programs.
  const std::vector<OwnedMemory>& owned() const { return owned_; }

 private:
  const Purpose purpose_;
  int64_t bytes_ = 0;
  std::vector<OwnedMemory> owned_;
};

}  // namespace dpde
