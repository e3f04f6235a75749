// SPDX-License-Identifier: Apache-2.0
// Head of a repeat in the text, and the fills of its passes.
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

/// Adds the statements of a pass, each after the fills that it needs. A pass sees no halo from outside. Fields that are
/// the same in all passes are filled in each pass as before the repeat; fields computed in the pass are filled as
/// written in it.
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
