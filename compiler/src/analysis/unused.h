// SPDX-License-Identifier: Apache-2.0
// What a scene or its task has and does not use, found from its programs: which results of a step depend on what
// (liveness of the stencil level), what they read beyond a cell, and which values are there when a run begins. A name
// says nothing here.
#pragma once

#include <string>
#include <vector>

#include "driver/scene/session.h"

namespace dpde::analysis {

struct Unused {
  /// field: a state that no result depends on. adjoint: a derivative that the gradient does not need. halo: cells
  /// around a field that nothing reads. axis: one along which nothing varies. history: states that a gradient stores
  /// for no reader. precision: f64 where f32 is known to do.
  enum class Kind { field, adjoint, halo, axis, history, precision } kind;
  std::string name;
  std::string reason;
  SourceRange place = {};  // of the equation, where there is one
};
std::string word_of(Unused::Kind kind);

/// Of the programs alone. `compiled` has a problem; of a task its adjoint where that is to be judged.
std::vector<Unused> unused_parts(const driver::Compiled& compiled);

/// Whether `dpde tune` has proven that f32 meets a tolerance of this scene of this text: kept in the cache, as no other
/// command makes runs to find that out. Of scenes in f64.
std::vector<Unused> idle_precision(const driver::Compiled& compiled, const SourceFile& source);
/// For that: what was chosen in f32 for the scene with these settings has this error.
void keep_single_precision(const driver::Compiled& compiled, const SourceFile& source, double tolerance, double error);

/// Axes along which the run of the scene from its initial state varies in nothing, with what one axis less would save.
/// By induction: all that the step reads is the same along the axis as the run begins, the step commutes with shifts
/// along it, and walls across it only continue what is there. Nothing is said of tasks that seek fields or compare with
/// data, which may vary.
std::vector<Unused> idle_axes(const driver::Compiled& compiled, driver::Session& session);

}  // namespace dpde::analysis
