// SPDX-License-Identifier: Apache-2.0
#include "adjoint/reverse/recomputation.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "adjoint/check/regions.h"
#include "adjoint/solves.h"
#include "stencil/analyse/effects.h"
#include "stencil/build.h"
#include "stencil/text/as_written.h"
#include "stencil/walk.h"
#include "support/match.h"

namespace dpde::adjoint {

using namespace stencil;

namespace {

struct PlacedFill {
  const Fill* fill = nullptr;
  std::size_t index = 0;
};

/// The last fill of the field before statement `end`, in the program itself, not in its repeats.
PlacedFill last_fill(const Program& program, const std::string& field, std::size_t end) {
  PlacedFill last;
  for (std::size_t i = 0; i < end; ++i) {
    match_some(program.body[i], [&](const Fill& fill) {
      if (fill.field == field) last = {&fill, i};
    });
  }
  return last;
}

/// Whether a statement in [begin, end) writes or adds to one of the fields.
bool makes_one(const Module& module, const Program& program, std::size_t begin, std::size_t end,
               const std::set<std::string>& fields) {
  const auto is_one = [&](const std::string& field) { return fields.contains(field); };
  for (std::size_t i = begin; i < end; ++i) {
    const Effects of = effects(module, program.body[i]);
    if (std::ranges::any_of(of.writes, is_one) || std::ranges::any_of(of.updates, is_one)) return true;
  }
  return false;
}

/// Whether statement `index`, a fill, gives another halo than the previous fill of its field: the fills differ, or
/// their fields of boundary values changed between them.
bool refills(const Module& module, const Program& program, std::size_t index, const Fill& fill) {
  const PlacedFill before = last_fill(program, fill.field, index);
  if (before.fill == nullptr) return false;
  return *before.fill != fill || makes_one(module, program, before.index, index, wall_fields(fill.axes));
}

/// Index of the last statement that runs a kernel and adds to each field.
std::map<std::string, size_t> last_updates(const Module& module, const Program& program) {
  std::map<std::string, size_t> last;
  for (size_t i = 0; i < program.body.size(); ++i) {
    const Effects e = effects(module, program.body[i]);
    if (e.kernels.empty()) continue;
    for (const std::string& field : e.updates) last[field] = i;
  }
  return last;
}

/// Whether a statement other than a run changes the field. After a block the adjoint has the fill from before the block
/// again. `is_grown`: the field was computed beyond the interior, where its first fill changes it too.
bool changes(const Module& module, const Program& program, size_t index, const std::string& field, bool is_grown) {
  const auto is_filled_anew = [&] {
    const auto is_its = [&](const Fill& fill) { return fill.field == field; };
    return is_grown && find_kind<Fill>(std::span(program.body).subspan(index, 1), is_its) != nullptr;
  };
  return match(
      program.body[index],
      [&](const Fill& fill) { return fill.field == field && (is_grown || refills(module, program, index, fill)); },
      [&](const Fold& fold) { return fold.field == field || wall_fields(fold.axes).contains(field); },
      always<false, Reduce, NetworkCall, Transform, Run>,
      [&](const OneOf<Solve, Repeat> auto&) { return is_filled_anew(); });
}

/// Walks a program backwards, from the fields needed after it to the statements that compute them.
class Recomputation {
 public:
  Recomputation(const Module& module, const Program& program, std::set<std::string> needed, const Saves& saves,
                Module& kernels)
      : module_(module), program_(program), needed_(std::move(needed)), saves_(saves), kernels_(kernels) {}

  std::vector<Statement> take() {
    std::vector<Statement> kept;
    for (index_ = program_.body.size(); index_-- > 0;) {
      match(
          program_.body[index_],
          [&](const Repeat& whole) {
            if (std::optional<Repeat> repeat = part_of(whole)) kept.push_back(*std::move(repeat));
          },
          [&](const OneOf<Fill, Fold, Reduce, NetworkCall, Transform, Run, Solve> auto& statement) {
            if (keep(statement)) kept.push_back(statement);
          });
    }
    std::ranges::reverse(kept);
    return kept;
  }

 private:
  bool is_needed(const std::string& field) const { return needed_.contains(field); }
  bool is_one_needed(const auto& fields) const {
    return std::ranges::any_of(fields, [&](const std::string& field) { return is_needed(field); });
  }
  void need(const auto& fields) { needed_.insert(fields.begin(), fields.end()); }

  bool keep(const Fill& fill) {
    if (!is_needed(fill.field)) return false;
    need(wall_fields(fill.axes));
    return true;
  }
  bool keep(const Fold& fold) {
    if (is_one_needed(wall_fields(fold.axes))) needed_.insert(fold.field);
    return is_needed(fold.field);
  }
  bool keep(const Reduce& reduce) {
    if (!is_needed(reduce.result)) return false;
    needed_.insert(reduce.field);
    return true;
  }
  bool keep(const NetworkCall& call) {
    if (!is_one_needed(fields_written(call))) return false;
    need(fields_read(call));
    return true;
  }
  bool keep(const Transform& transform) {
    if (!is_needed(transform.result)) return false;
    for (const Transform::Term& term : transform.terms) needed_.insert(term.field);
    return true;
  }
  bool keep(const Run& run) {
    const Kernel& kernel = *module_.find_kernel(run.kernel);
    const Signature s = signature(kernel);
    if (!is_one_needed(s.writes) && !is_one_needed(s.updates)) return false;
    for (const auto& read : s.reads) needed_.insert(read.field);
    if (!kernels_.find_kernel(kernel.name)) kernels_.kernels.push_back(kernel);
    return true;
  }
  bool keep(const Solve& solve) {
    if (!is_one_needed(solve.unknowns)) return false;
    need(effects(module_, solve).reads);
    add_kernels(kernels_, module_, operator_of(solve, program_));
    return true;
  }

  /// The part of a repeat that its needed results and saved states depend on; nullopt if there are none.
  std::optional<Repeat> part_of(Repeat repeat) {
    std::erase_if(repeat.saves, [&](const TapeEntry& save) { return !is_needed(save.stack); });
    const auto saved = saves_.find(index_);
    if (saved != saves_.end()) repeat.saves.insert(repeat.saves.end(), saved->second.begin(), saved->second.end());
    const bool has_result =
        std::ranges::any_of(repeat.carries, [&](const LoopCarried& c) { return is_needed(c.result); });
    if (repeat.saves.empty() && !has_result) return std::nullopt;
    std::set<std::string> inside;
    for (const LoopCarried& carry : repeat.carries) inside.insert(carry.next);
    for (const TapeEntry& save : repeat.saves) inside.insert(save.field);
    repeat.body = recomputation(module_, pass_of(repeat, program_), inside, {}, kernels_);
    need(effects(module_, repeat).reads);
    for (const TapeEntry& load : repeat.loads) needed_.insert(load.stack);
    return repeat;
  }

  const Module& module_;
  const Program& program_;
  std::set<std::string> needed_;
  const Saves& saves_;
  Module& kernels_;
  std::size_t index_ = 0;
};

}  // namespace

std::vector<Statement> recomputation(const Module& module, const Program& program, std::set<std::string> needed,
                                     const Saves& saves, Module& kernels) {
  return Recomputation(module, program, std::move(needed), saves, kernels).take();
}

bool is_updated_behind(const Module& module, const Program& program, const std::string& field, int index) {
  const auto updates = [&](const Statement& statement) {
    const std::vector<std::string> updated = effects(module, statement).updates;
    return std::ranges::find(updated, field) != updated.end();
  };
  return std::any_of(program.body.begin() + index + 1, program.body.end(), updates);
}

bool check_overwritten(const Module& module, const Program& program, const std::map<std::string, int>& needed,
                       DiagnosticSink& sink) {
  bool good = true;
  const std::set<std::string> grown = grown_fields(module, program);
  const std::map<std::string, size_t> updates = last_updates(module, program);
  for (const auto& [field, index] : needed) {
    const size_t first = index;
    const auto update = updates.find(field);
    bool is_changed = update != updates.end() && update->second >= first;
    for (size_t i = first; i < program.body.size() && !is_changed; ++i) {
      is_changed = changes(module, program, i, field, grown.contains(field));
    }
    if (!is_changed) continue;
    const std::vector<std::string> kernels = effects(module, program.body[first]).kernels;
    const std::string reader = kernels.empty() ? program.name : kernels.front();
    const auto written = [&](const std::string& name) { return as_written(module, program, name); };
    sink.report("overwritten-value", place_of(module, reader), {written(reader), written(field)},
                "store the changed value in a field of its own");
    good = false;
  }
  return good;
}

}  // namespace dpde::adjoint
