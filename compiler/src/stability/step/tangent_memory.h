// SPDX-License-Identifier: Apache-2.0
// The program of a tangent with its own memory: inputs, fields that depend on these alone, and perturbations. Memory
// and solvers are reused from run to run: in most scenes steps of another length have the same operators.
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
  /// `inputs` are copied; the tangent must outlive this object.
  TangentMemory(const CompiledTangent& tangent, const stencil::State& inputs);

  /// To be called before each run. Sets perturbations and all results of a step to 0, and computes fields that depend
  /// on the inputs alone.
  void begin(const stencil::Params& params);
  /// A step maps the first field of each pair to the second. False if a solve fails: unsolved() then has the reason,
  /// and this memory must not begin another run.
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
  std::deque<Field> fields_, others_;  // of the executor's program; fields of the fixed part alone
  std::vector<int> scratch_;           // fields that only a step computes
  std::optional<stencil::Params> params_;
  std::string unsolved_;
};

}  // namespace dpde::stability
