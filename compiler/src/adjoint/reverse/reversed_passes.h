// SPDX-License-Identifier: Apache-2.0
// Names of adjoints in a repeat whose block is reversed. The adjoint of the result of a pass (v of swap u, v) has the
// name of the adjoint of the repeat's result outside; adjoints of fields that a pass reads from outside have names of
// their own. From pass to pass the repeat carries the adjoints of the states, and the sums of contributions to fields
// that are the same in all passes. Adjoints of loaded fields are pushed onto a stack, and popped by the reversal of the
// repeat that saved them.
#pragma once

#include <functional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "adjoint/check/extremes.h"
#include "adjoint/reverse/plan.h"

namespace dpde::adjoint {

/// The counter of the reversed repeat, in the other direction.
inline stencil::Counter reversed_counter(const stencil::Repeat& repeat) {
  return {repeat.counter.name, !repeat.counter.name.empty() && !repeat.counter.is_backwards};
}

class ReversedPasses {
 public:
  /// `reads`: the fields read from outside. Rebinds the derived names to those inside the block.
  ReversedPasses(const stencil::Repeat& repeat, const std::vector<std::string>& reads, const Varied& varied,
                 DerivedNames& names);

  /// The states that vary.
  std::set<std::string> states() const;

  /// Splits `fields` into those that are the same in all passes, and those that differ: states and loaded fields.
  struct Reads {
    std::vector<std::string> constant, differing;
  };
  Reads read_by(const std::vector<std::string>& fields) const;

  /// False, and an error, if a field saved on a stack with an adjoint is not a state: the adjoint of an adjoint saves
  /// such fields, and itself has no adjoint.
  bool check(const std::set<std::string>& stacks, DiagnosticSink& sink) const;

  /// Makes `reversed`, which contains the block's adjoint, carry adjoints from pass to pass, and initialises the sums
  /// before it. Restores the names outside. Returns outside fields, each with the field of its contribution. `stacks`:
  /// the stacks that have adjoints.
  std::vector<std::pair<std::string, std::string>> finish(stencil::Repeat& reversed,
                                                          const std::function<bool(const std::string&)>& has_bar,
                                                          std::set<std::string>& stacks, const Writing& before);

 private:
  void call(const std::string& field, const std::string& bar);
  bool is_state(const std::string& field) const;
  bool is_loaded(const std::string& field) const;
  std::string with_saved(const std::string& state, const std::set<std::string>& stacks, stencil::Repeat& reversed,
                         stencil::Kernel& add);

  const stencil::Repeat& repeat_;
  const std::vector<std::string> reads_;
  DerivedNames& names_;
  std::vector<stencil::LoopCarried> carries_;                 // those that vary
  std::vector<std::string> constant_;                         // varied fields that are the same in all passes
  std::vector<stencil::TapeEntry> loads_;                     // those that vary
  std::vector<std::pair<std::string, std::string>> outside_;  // derived names outside the repeat
};

}  // namespace dpde::adjoint
