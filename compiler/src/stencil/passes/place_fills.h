// SPDX-License-Identifier: Apache-2.0
// Fills follow from how each field goes on (HaloRule) and from what is read: a read that needs a fill has one before
// it, behind the last statement that changed the field or left its halo as anything. A program begins with no field
// filled, and so does each pass of a repeat and the block of a solve, which see the cells alone of what comes from
// outside: what is stale where a block ends is stale where it begins again.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "stencil/stencil.h"

namespace dpde::stencil {

/// The field goes on so in cells and beyond; values on walls are set for all reads.
HaloRule rule_of_fill(Fill fill);
bool has_rule(const std::vector<HaloRule>& halos, const std::string& field);

/// Goes along the statements of a program, or of a block, in order.
class FillPlacer {
 public:
  /// There is one rule for each field at most.
  FillPlacer(const std::vector<Topology>& axes, const std::vector<HaloRule>& halos);

  /// A statement that stands as it is.
  void pass(const Module& module, const Statement& statement);
  /// Appends the statement behind the fills it needs, with those that its blocks need.
  void add(const Module& module, Statement statement, std::vector<Statement>& body);
  /// The fills behind all statements that these results need.
  void finish(const std::vector<std::string>& results, std::vector<Statement>& body);

 private:
  /// From where the fields of its walls are written.
  bool holds(const HaloRule& rule) const;
  void fill(const HaloRule& rule, std::vector<Statement>& body);

  const std::vector<Topology>& axes_;
  const std::vector<HaloRule>& halos_;
  std::set<std::string> filled_, written_;
  std::set<std::string> spoiled_;  // by blocks, and not filled since
};

/// Makes fills of the rules of all programs and their blocks.
void place_fills(Module& module);

}  // namespace dpde::stencil
