// SPDX-License-Identifier: Apache-2.0
#include "stencil/passes/place_fills.h"

#include <algorithm>
#include <utility>

#include "stencil/analyse/effects.h"
#include "stencil/analyse/extents.h"
#include "stencil/build.h"
#include "support/assert.h"
#include "support/contains.h"
#include "support/match.h"

namespace dpde::stencil {

namespace {

/// The fields that a statement reads, by the parts of their halo that it needs.
struct Reads {
  std::set<std::string> all, beyond, around;

  bool need(const HaloRule& rule) const {
    const auto& fields = rule.need == FillNeed::around ? around : rule.need == FillNeed::beyond ? beyond : all;
    return fields.contains(rule.fill.field);
  }
};

/// Fills and folds work on halos themselves and need no fill before. A block reads the interior only, and has its own
/// fills.
Reads reads_of(const Module& module, const Statement& statement, const std::vector<Topology>& axes) {
  const auto in_cells = [&](const auto& one) {
    const std::vector<std::string> fields = effects(module, one).reads;
    return Reads{{fields.begin(), fields.end()}, {}, {}};
  };
  return match(
      statement, [](const OneOf<Fill, Fold> auto&) { return Reads{}; },
      [&](const OneOf<Reduce, NetworkCall, Transform, Solve, Repeat> auto& other) { return in_cells(other); },
      [&](const Run& run) {
        const Kernel& kernel = kernel_of(module, run);
        return Reads{in_cells(run).all, read_beyond(kernel, run.grow, axes), read_around(kernel, axes)};
      });
}

std::vector<Statement> placed(const Module& module, const Program& block) {
  FillPlacer placer(block.axes, block.halos);
  std::vector<Statement> body;
  for (const Statement& statement : block.body) placer.add(module, statement, body);
  return body;
}

/// In a block without rules fills are placed already.
void place_in_blocks(const Module& module, Statement& statement, const std::vector<Topology>& axes) {
  const auto place = [&](auto& block, const Program& alone) {
    block.body = placed(module, alone);
    block.halos.clear();
  };
  const Program outer{"", axes, {}, {}, {}};
  match(
      statement, ignored<Fill, Fold, Reduce, NetworkCall, Transform, Run>,
      [&](Solve& solve) { place(solve, operator_of(solve, outer)); },
      [&](Repeat& repeat) { place(repeat, pass_of(repeat, outer)); });
}

}  // namespace

HaloRule rule_of_fill(Fill fill) {
  const FillNeed need = is_on_walls(fill.axes) ? FillNeed::reads : FillNeed::beyond;
  return {std::move(fill), need};
}

bool has_rule(const std::vector<HaloRule>& halos, const std::string& field) {
  return std::ranges::any_of(halos, [&](const HaloRule& rule) { return rule.fill.field == field; });
}

bool FillPlacer::holds(const HaloRule& rule) const {
  return std::ranges::all_of(wall_fields(rule.fill.axes), [&](const auto& wall) { return written_.contains(wall); });
}

/// Fills first the fields of boundary values, if these have rules too.
void FillPlacer::fill(const HaloRule& rule, std::vector<Statement>& body) {
  const std::set<std::string> walls = wall_fields(rule.fill.axes);
  for (const HaloRule& wall : halos_) {
    if (walls.contains(wall.fill.field) && !filled_.contains(wall.fill.field) && holds(wall)) fill(wall, body);
  }
  filled_.insert(rule.fill.field);
  spoiled_.erase(rule.fill.field);
  body.push_back(rule.fill);
}

void FillPlacer::pass(const Module& module, const Statement& statement) {
  const Effects e = effects(module, statement);
  for (const std::string& field : e.fills) {
    filled_.insert(field);
    spoiled_.erase(field);
  }
  for (const auto* changed : {&e.writes, &e.updates, &e.invalidates_halo}) {
    for (const std::string& field : *changed) filled_.erase(field);
  }
  written_.insert(e.writes.begin(), e.writes.end());
  spoiled_.insert(e.invalidates_halo.begin(), e.invalidates_halo.end());
}

void FillPlacer::add(const Module& module, Statement statement, std::vector<Statement>& body) {
  place_in_blocks(module, statement, axes_);
  const Reads reads = reads_of(module, statement, axes_);
  for (const HaloRule& rule : halos_) {
    if (reads.need(rule) && !filled_.contains(rule.fill.field) && holds(rule)) fill(rule, body);
  }
  pass(module, statement);
  body.push_back(std::move(statement));
}

void FillPlacer::finish(const std::vector<std::string>& results, std::vector<Statement>& body) {
  for (const HaloRule& rule : halos_) {
    const std::string& field = rule.fill.field;
    const bool is_open = rule.need == FillNeed::results || (rule.need == FillNeed::reads && spoiled_.contains(field));
    if (is_open && !filled_.contains(field) && contains(results, field)) fill(rule, body);
  }
}

FillPlacer::FillPlacer(const std::vector<Topology>& axes, const std::vector<HaloRule>& halos)
    : axes_(axes), halos_(halos) {
  std::set<std::string> fields;
  for (const HaloRule& rule : halos) require(fields.insert(rule.fill.field).second, "a field goes on in two ways");
}

void place_fills(Module& module) {
  for (Program& program : module.programs) {
    FillPlacer placer(program.axes, program.halos);
    std::vector<Statement> body;
    for (Statement& statement : program.body) placer.add(module, std::move(statement), body);
    std::vector<std::string> results = program.keeps;
    for (const Swap& swap : program.swaps) results.push_back(swap.next);
    placer.finish(results, body);
    program.body = std::move(body);
    program.halos.clear();
  }
}

}  // namespace dpde::stencil
