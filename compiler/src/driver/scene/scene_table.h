// SPDX-License-Identifier: Apache-2.0
// A compiled scene as the C data of scene_abi.h, which hosts run, in memory or ahead of time.
#pragma once

#include <memory>

#include "codegen/program_table.h"
#include "dpde/scene_abi.h"
#include "driver/compile/pipeline.h"

namespace dpde::driver {

struct HostNeeds {
  bool second_order = false;  // of a task
  bool seeded = false;        // CompileOptions::seeded
  bool takes_jumps = false;   // CompileOptions::takes_jumps and trusts_signs
};

/// Compiles the scene or task of `selection` for hosts: every parameter can be set, and a task has adjoints; also
/// second derivatives if requested or needed by its optimiser. Without a backend there is no code. Returns nullopt if
/// `sink` has errors afterwards.
std::optional<Compiled> compile_for_hosts(const SourceFile& source, model::Selection selection,
                                          std::optional<Backend> backend, const HostNeeds& needs, DiagnosticSink& sink);

struct SceneTableOptions {
  /// Use the scene's own values even if the task starts elsewhere; the task's values are loaded separately.
  bool begins_as_scene = false;
  std::optional<int> steps;  // overrides the scene's steps, whatever happens in them
  bool without_files = false;
  int every = 0;          // > 0: for a training sample, steps between states that losses use
  bool sets_all = false;  // also parameters that others derive from: the caller has checked that these stay the same
};

/// Owns all data of a dpde_scene. The programs are those of `compiled`'s code, which it keeps alive.
class SceneTable {
 public:
  /// `compiled` must have a problem and code. Reads network weights from files. Returns null if `sink` has errors
  /// afterwards, i.e. hosts cannot run it.
  static std::shared_ptr<const SceneTable> make(std::shared_ptr<const Compiled> compiled, const SourceFile& source,
                                                const SceneTableOptions& options, DiagnosticSink& sink);
  /// For plans: programs are those of `programs`, which have no code; networks have no weights from files. `compiled`
  /// and `programs` must outlive the table.
  static std::shared_ptr<const SceneTable> without_code(const Compiled& compiled,
                                                        const codegen::ProgramTables& programs);
  ~SceneTable();
  const dpde_scene& scene() const;

 private:
  SceneTable();
  struct Storage;
  std::unique_ptr<Storage> storage_;
};

}  // namespace dpde::driver
