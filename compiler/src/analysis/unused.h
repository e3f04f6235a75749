// SPDX-License-Identifier: Apache-2.0
// Unused parts of a scene or its task, found by analysing its programs: dependences of a step's results (liveness on
// the stencil level), stencil radii, and values at the start of a run. Names play no role.
#pragma once

#include <string>
#include <vector>

#include "driver/scene/session.h"

namespace dpde::analysis {

struct Unused {
  /// field: a state that no result depends on. adjoint: a derivative that the gradient does not need. halo: ghost cells
  /// that nothing reads. axis: nothing varies along it. history: stored states that a gradient does not read.
  /// precision: f64 although f32 is known to suffice.
  enum class Kind { field, adjoint, halo, axis, history, precision } kind;
  std::string name;
  std::string reason;
  SourceRange place = {};  // of the equation, if there is one
};
std::string word_of(Unused::Kind kind);

/// By analysing programs. `compiled` must have a problem; for a task, its adjoint if that is to be analysed.
std::vector<Unused> unused_parts(const driver::Compiled& compiled);

/// Whether `dpde tune` has shown that f32 meets a tolerance for this text of the scene; read from the cache, since no
/// other command makes the runs to find out. For scenes in f64.
std::vector<Unused> idle_precision(const driver::Compiled& compiled, const SourceFile& source);
/// Stores such a result: the scheme chosen in f32 for the scene with these settings has this error.
void keep_single_precision(const driver::Compiled& compiled, const SourceFile& source, double tolerance, double error);

/// Axes along which nothing varies in the scene's run, with the savings of one axis less. Proof by induction: the
/// step's inputs are constant along the axis at the start, the step commutes with shifts along it, and walls across it
/// continue constant values. Not for tasks with unknown fields or data, which may vary.
std::vector<Unused> idle_axes(const driver::Compiled& compiled, driver::Session& session);

}  // namespace dpde::analysis
