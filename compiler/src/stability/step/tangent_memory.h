// SPDX-License-Identifier: Apache-2.0
// The program of a tangent with memory of its own: its inputs, what is made of these alone, and perturbations. It and
// the solvers of the program serve one run after the other: steps of another length have the same operators in most
// scenes.
#pragma once

#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "dpde/runtime/executor.h"
#include "dpde/runtime/field.h"
#include "stability/step/compiled_tangent.h"

namespace dpde::stability {

class TangentMemory {
 public:
  /// `inputs` are copied; the tangent must stay.
  TangentMemory(const CompiledTangent& tangent, const stencil::State& inputs);

  /// Before each run: perturbations and all else that a step makes are 0, what is made of the inputs alone is there.
  void begin(const stencil::Params& params);
  /// Of what is in the first field of each pair a step makes the second. False where a solve finds no solution, which
  /// unsolved() tells; no run begins with this memory then.
  bool advance(int steps, const std::vector<std::pair<int, int>>& states);
  const std::string& unsolved() const { return unsolved_; }

  const dpde_layout& layout() const { return layout_; }
  Executor& executor() { return executor_; }
  Field& field(int number) { return fields_[static_cast<std::size_t>(number)]; }

 private:
  Field new_field(const char* name, const stencil::State& inputs, int number) const;
  void bind_fixed(const stencil::State& inputs);

  dpde_layout layout_;
  std::shared_ptr<SolverStore> solvers_;
  Executor executor_;
  std::optional<Executor> fixed_;
  std::deque<Field> fields_, others_;  // of the executor's program, and those that only the fixed part has
  std::vector<int> scratch_;           // fields that no part before a step makes
  std::optional<stencil::Params> params_;
  std::string unsolved_;
};

}  // namespace dpde::stability
