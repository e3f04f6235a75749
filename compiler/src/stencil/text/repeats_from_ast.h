// SPDX-License-Identifier: Apache-2.0
// What a repeat of the text says beside its statements.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "stencil/passes/place_fills.h"
#include "stencil/stencil.h"
#include "syntax/ast.h"

namespace dpde::stencil {

/// A repeat with an empty block.
Repeat read_repeat_head(const ast::RepeatItem& source);

/// Puts the statements of a pass behind the fills that they need. A pass sees no halo from outside: what is the same in
/// all passes goes on in each as it was filled before them, and what a pass makes itself is filled as its text says.
class PassFills {
 public:
  /// `filled`: the last fill of each field before the repeat.
  PassFills(const std::vector<Topology>& axes, const Repeat& head, const std::map<std::string, Fill>& filled);
  void add(const Module& module, Statement statement, std::vector<Statement>& body);

 private:
  std::vector<HaloRule> halos_;
  FillPlacer placer_;
};

}  // namespace dpde::stencil
