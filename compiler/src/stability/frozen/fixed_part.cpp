// SPDX-License-Identifier: Apache-2.0
#include "stability/frozen/fixed_part.h"

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <utility>
#include <vector>

#include "stencil/analyse/effects.h"
#include "stencil/passes/passes.h"
#include "support/contains.h"
#include "support/match.h"

namespace dpde::stability {

using namespace stencil;

namespace {

bool can_be_apart(const Statement& statement) { return is_one_of<Fill, Reduce, Transform, Run, Solve>(statement); }

/// The statements of a program whose results are the same in each run.
class FixedPart {
 public:
  FixedPart(const Module& module, const Program& program, const std::set<std::string>& perturbations)
      : is_fixed_(program.body.size()) {
    for (const Statement& statement : program.body) effects_.push_back(effects(module, statement));
    const std::set<std::string> others = dependent(perturbations);
    for (std::size_t i = 0; i < effects_.size(); ++i) {
      is_fixed_[i] = can_be_apart(program.body[i]) && effects_[i].updates.empty() &&
                     effects_[i].invalidates_halo.empty() && !reads_any(effects_[i], others);
      for (const auto* names : {&effects_[i].writes, &effects_[i].fills, &effects_[i].sums}) {
        for (const std::string& name : *names) is_fixed_[i] = is_fixed_[i] && !others.contains(name);
      }
    }
    while (drop_one()) {
    }
  }

  bool is_fixed(std::size_t statement) const { return is_fixed_[statement]; }
  const Effects& effects_of(std::size_t statement) const { return effects_[statement]; }

 private:
  static bool reads_any(const Effects& e, const std::set<std::string>& names) {
    const auto is_in = [&](const std::string& name) { return names.contains(name); };
    return std::ranges::any_of(e.reads, is_in) || std::ranges::any_of(e.params, is_in);
  }

  /// Fields and sums that depend on the perturbations.
  std::set<std::string> dependent(std::set<std::string> names) const {
    for (std::size_t before = 0; before < names.size();) {
      before = names.size();
      for (const Effects& e : effects_) {
        if (!reads_any(e, names)) continue;
        for (const auto* made : {&e.writes, &e.updates, &e.fills, &e.sums, &e.invalidates_halo})
          names.insert(made->begin(), made->end());
      }
    }
    return names;
  }

  /// Removes one statement from the fixed part: it reads a result of the other statements, or they read its result
  /// before it is computed, or they overwrite its result.
  bool drop_one() {
    for (std::size_t i = 0; i < effects_.size(); ++i) {
      if (!is_fixed_[i] || can_be_made_first(i)) continue;
      is_fixed_[i] = false;
      return true;
    }
    return false;
  }
  bool can_be_made_first(std::size_t number) const {
    const Effects& own = effects_[number];
    for (std::size_t i = 0; i < effects_.size(); ++i) {
      const Effects& other = effects_[i];
      if (i == number) continue;
      if (!is_fixed_[i] && (touches_any(other, own.reads) || touches_any(other, own.params))) return false;
      if (contains_any(other.writes, own.writes) || contains_any(other.fills, own.fills)) return false;
      if (i > number && contains_any(other.writes, own.fills)) return false;
      if (is_fixed_[i]) continue;
      if (contains_any(other.params, own.sums)) return false;  // sums are no fields, so programs cannot share them
      if (i < number && (contains_any(other.reads, own.writes) || contains_any(other.reads, own.fills))) return false;
    }
    return true;
  }
  static bool contains_any(const std::vector<std::string>& all, const std::vector<std::string>& names) {
    return std::ranges::any_of(names, [&](const std::string& name) { return contains(all, name); });
  }
  static bool touches_any(const Effects& e, const std::vector<std::string>& names) {
    return contains_any(e.writes, names) || contains_any(e.updates, names) || contains_any(e.fills, names) ||
           contains_any(e.invalidates_halo, names) || contains_any(e.sums, names);
  }

  std::vector<Effects> effects_;
  std::vector<bool> is_fixed_;
};

}  // namespace

ApartModule with_fixed_part_apart(Module module, const std::set<std::string>& perturbations) {
  Program& program = module.programs.front();
  const FixedPart part(module, program, perturbations);
  Program fixed{program.name + "_fixed", program.axes, {}, {}, {}};
  std::vector<Statement> others;
  std::set<std::string> made, read;
  for (std::size_t i = 0; i < program.body.size(); ++i) {
    const Effects& of_statement = part.effects_of(i);
    // A fill defines a field's continuation in its halo, which its readers need. To repeat it has the same result.
    const bool is_among_others = !part.is_fixed(i) || !of_statement.fills.empty();
    if (is_among_others) others.push_back(program.body[i]);
    if (is_among_others) read.insert(of_statement.reads.begin(), of_statement.reads.end());
    if (part.is_fixed(i)) fixed.body.push_back(program.body[i]);
    if (part.is_fixed(i)) made.insert(of_statement.writes.begin(), of_statement.writes.end());
  }
  std::ranges::set_intersection(read, made, std::back_inserter(fixed.keeps));
  if (fixed.keeps.empty()) return {std::move(module), ""};
  program.body = std::move(others);
  const std::string name = fixed.name;
  module.programs.insert(module.programs.begin() + 1, std::move(fixed));
  return {remove_dead_code(module), name};
}

}  // namespace dpde::stability
