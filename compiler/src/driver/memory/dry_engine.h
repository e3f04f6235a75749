// SPDX-License-Identifier: Apache-2.0
// The engine of a session that only counts its memory: it has the tables of the scene and of its programs, but no code,
// values or files. What runs and gradients take is thus read from the engine that they use.
#pragma once

#include <memory>
#include <optional>

#include "codegen/program_table.h"
#include "dpde/runtime/engine.h"
#include "driver/compile/pipeline.h"
#include "driver/memory/storage.h"

namespace dpde::driver {

class DryEngine {
 public:
  /// `compiled` must outlive it.
  explicit DryEngine(const Compiled& compiled, const StorageOptions& options = {});

  Engine* operator->() { return &*engine_; }
  MemoryCount& count() { return *count_; }
  /// Runs a program of the scene once, on states of the caller; nothing if there is none of that name.
  void execute(const std::string& program);
  /// Drops the fields that the program computes.
  void release(const std::string& program);
  /// False if the step or a loss has no adjoint.
  bool has_gradient() const;
  const dpde_program* program(const std::string& name) const { return tables_.find(name); }

 private:
  codegen::ProgramTables tables_;
  std::shared_ptr<MemoryCount> count_ = std::make_shared<MemoryCount>();
  std::optional<Engine> engine_;
};

}  // namespace dpde::driver
