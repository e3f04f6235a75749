// SPDX-License-Identifier: Apache-2.0
// Memory of the passes of a repeat, and the stacks on which passes store fields for later: only pointers move, nothing
// is copied.
#pragma once

#include <cstdint>
#include <vector>

#include "dpde/kernel_abi.h"
#include "dpde/runtime/allocation.h"
#include "grid/field_pool.h"

namespace dpde {

/// One field from each pass of a repeat.
class Stack {
 public:
  explicit Stack(std::int64_t fields) : fields_(fields) {}

  /// Number of fields that need own memory; the others stay in memory of another owner.
  std::int64_t fields() const { return fields_; }
  void make(const dpde_layout& layout);
  std::int64_t bytes(const dpde_layout& layout) const { return bytes_of_stack(layout, fields_, passes_); }
  void* memory(std::int64_t number) { return memory_.base(number); }

  void set_passes(std::int64_t count) { passes_ = count; }
  void*& slot(std::int64_t pass) { return slots_[static_cast<std::size_t>(pass)]; }

 private:
  std::int64_t fields_, passes_ = 0;
  FieldPool memory_;
  std::vector<void*> slots_;
};

class Passes {
 public:
  Passes() = default;
  Passes(const dpde_repeat& source, std::vector<Stack>& stacks);

  std::int64_t count() const { return count_; }
  bool has_counter() const { return step_ != 0; }
  std::size_t counter() const { return counter_; }
  double number_of(std::int64_t pass) const { return static_cast<double>(first_ + step_ * pass); }
  /// `fields`: of the program. end() restores the pointers of begin().
  void begin(void** fields);
  void before(std::int64_t pass, void** fields, std::vector<Stack>& stacks) const;
  void after(void** fields) const;
  void end(void** fields) const;

 private:
  struct Carried {
    dpde_carry names{};
    int stack = -1;  // the stack on which it is saved
    void *state = nullptr, *next = nullptr;
  };
  struct Loaded {
    dpde_stacked names{};
    void* field = nullptr;
  };
  std::int64_t count_ = 0, first_ = 0, step_ = 0;
  std::size_t counter_ = 0;
  std::vector<Carried> carried_;
  std::vector<dpde_stacked> written_,
      elsewhere_;              // saved in memory of the stack; saved in memory of another stack or of a state
  std::vector<void*> places_;  // original memory of written_
  std::vector<Loaded> loaded_;
};

/// Restores the fields' pointers also if a pass throws, since later runs use the same memory.
class PassesInFields {
 public:
  PassesInFields(Passes& passes, void** fields) : passes_(passes), fields_(fields) { passes_.begin(fields_); }
  ~PassesInFields() { passes_.end(fields_); }
  PassesInFields(const PassesInFields&) = delete;
  PassesInFields& operator=(const PassesInFields&) = delete;

 private:
  Passes& passes_;
  void** fields_;
};

}  // namespace dpde
