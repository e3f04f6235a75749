// SPDX-License-Identifier: Apache-2.0
// A compiled scene as the C data of scene_abi.h: what hosts run, in memory or ahead of time.
#pragma once

#include <memory>

#include "dpde/scene_abi.h"
#include "driver/compile/pipeline.h"

namespace dpde::driver {

struct HostNeeds {
  bool second_order = false;  // of a task
  bool seeded = false;        // CompileOptions::seeded
  bool takes_jumps = false;   // CompileOptions::takes_jumps and trusts_signs
};

/// The scene or task of `selection` as hosts run it: every parameter can be set, and a task comes with its adjoints;
/// with second derivatives when they are wanted or its optimiser needs them. Without a backend there is no code.
/// nullopt when `sink` has errors afterwards.
std::optional<Compiled> compile_for_hosts(const SourceFile& source, model::Selection selection,
                                          std::optional<Backend> backend, const HostNeeds& needs, DiagnosticSink& sink);

struct SceneTableOptions {
  /// With the scene's own values where the task begins elsewhere: whoever loads them has those of the task, too.
  bool begins_as_scene = false;
  std::optional<int> steps;  // in place of the scene's, whatever happens in them
  bool without_files = false;
  int every = 0;          // > 0: of a window, whose losses look at every so many steps
  bool sets_all = false;  // parameters of which something is made, too: who runs it has seen that it stays the same
};

/// Owns what a dpde_scene points to. The programs are those of `compiled`'s code, which is kept.
class SceneTable {
 public:
  /// `compiled` has a problem and code; weights of networks that come from files are read. null when `sink` has errors
  /// afterwards: hosts cannot run this.
  static std::shared_ptr<const SceneTable> make(std::shared_ptr<const Compiled> compiled, const SourceFile& source,
                                                const SceneTableOptions& options, DiagnosticSink& sink);
  ~SceneTable();
  const dpde_scene& scene() const;

 private:
  SceneTable();
  struct Storage;
  std::unique_ptr<Storage> storage_;
};

}  // namespace dpde::driver
