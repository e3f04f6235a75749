// SPDX-License-Identifier: Apache-2.0
// Places fills by each field's HaloRule and the reads of statements: a read that needs a fill has one before it, after
// the last statement that changed the field or left its halo undefined. At the start of a program no field is filled,
// nor at the start of a pass of a repeat or of the block of a solve, which see only the interior of outside fields: a
// halo that is stale at the end of a block is stale at its next start.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "stencil/stencil.h"

namespace dpde::stencil {

/// The rule with this fill. Fills with values on walls are needed by all reads.
HaloRule rule_of_fill(Fill fill);
bool has_rule(const std::vector<HaloRule>& halos, const std::string& field);

/// Takes the statements of a program, or of a block, in order.
class FillPlacer {
 public:
  /// `halos` has at most one rule per field.
  FillPlacer(const std::vector<Topology>& axes, const std::vector<HaloRule>& halos);

  /// Notes the effects of a statement without placing fills for it.
  void pass(const Module& module, const Statement& statement);
  /// Appends the fills that the statement needs, then the statement, with the fills that its blocks need.
  void add(const Module& module, Statement statement, std::vector<Statement>& body);
  /// Appends the fills after all statements that these results need.
  void finish(const std::vector<std::string>& results, std::vector<Statement>& body);

 private:
  /// Whether the rule applies: the fields of its boundary values are written.
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
