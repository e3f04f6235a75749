// SPDX-License-Identifier: Apache-2.0
// Names in a repeat whose block is reversed. The bar of what a pass makes (v of swap u, v) is the one that the repeat's
// result has outside; the bars of what a pass reads from outside are its own. From pass to pass go the bars of the
// states, and the sums of what fields get that are the same in all passes. The bars of what passes load go onto a
// stack, from which they come where that was saved.
#pragma once

#include <functional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "adjoint/check/extremes.h"
#include "adjoint/reverse/plan.h"

namespace dpde::adjoint {

/// It counts the other way.
inline stencil::Counter reversed_counter(const stencil::Repeat& repeat) {
  return {repeat.counter.name, !repeat.counter.name.empty() && !repeat.counter.is_backwards};
}

class ReversedPasses {
 public:
  /// `reads`: from outside. From now on names stand for what they are in the block.
  ReversedPasses(const stencil::Repeat& repeat, const std::vector<std::string>& reads, const Varied& varied,
                 DerivedNames& names);

  /// Those that vary.
  std::set<std::string> states() const;

  /// What of `fields` the passes leave alone, and what differs from pass to pass: states and what is loaded.
  struct Reads {
    std::vector<std::string> constant, differing;
  };
  Reads read_by(const std::vector<std::string>& fields) const;

  /// False, and an error, where what is saved on a stack that has a bar is no state: the adjoint of an adjoint saves
  /// such things, and has no adjoint.
  bool check(const std::set<std::string>& stacks, DiagnosticSink& sink) const;

  /// Lets `reversed`, with the block's adjoint in it, carry bars from pass to pass, and begins the sums before it.
  /// Names stand again for what they are outside. Returns fields from outside and what holds what they get. `stacks`:
  /// those that have bars.
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
  std::vector<stencil::LoopCarried> carries_;                 // that vary
  std::vector<std::string> constant_;                         // fields that vary, and the passes leave alone
  std::vector<stencil::TapeEntry> loads_;                     // that vary
  std::vector<std::pair<std::string, std::string>> outside_;  // what names stood for
};

}  // namespace dpde::adjoint
