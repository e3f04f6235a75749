// SPDX-License-Identifier: Apache-2.0
#include "adjoint/recomputation.h"

#include <algorithm>

#include "adjoint/regions.h"
#include "adjoint/solves.h"
#include "stencil/as_written.h"
#include "stencil/build.h"
#include "stencil/effects.h"
#include "support/match.h"

namespace dpde::adjoint {

using namespace stencil;

namespace {

/// The fill in the program itself, not in its repeats, that a field has behind it the statements before `end`.
const Fill* last_fill(const Program& program, const std::string& field, std::size_t end) {
  const Fill* last = nullptr;
  for (std::size_t i = 0; i < end; ++i) {
    match(
        program.body[i], [&](const Fill& fill) { last = fill.field == field ? &fill : last; }, [](const Fold&) {},
        [](const Reduce&) {}, [](const NetworkCall&) {}, [](const Transform&) {}, [](const Run&) {},
        [](const Solve&) {}, [](const Repeat&) {});
  }
  return last;
}

/// Whether statement `index`, a fill, leaves another halo than the fill of its field before that.
bool refills(const Program& program, size_t index, const Fill& fill) {
  const Fill* other = last_fill(program, fill.field, index);
  return other != nullptr && (*other != fill || !wall_fields(fill.axes).empty());
}

/// The last run that adds to each field, and its place in the program.
std::map<std::string, size_t> last_updates(const Module& module, const Program& program) {
  std::map<std::string, size_t> last;
  for (size_t i = 0; i < program.body.size(); ++i) {
    const Effects e = effects(module, program.body[i]);
    if (e.kernels.empty()) continue;
    for (const std::string& field : e.updates) last[field] = i;
  }
  return last;
}

/// A statement but for a run. Behind a block the adjoint has the fill from before it again. `is_grown`: the field was
/// computed beyond the interior, where its first fill changes it too.
bool changes(const Program& program, size_t index, const std::string& field, bool is_grown) {
  const auto is_filled_anew = [&] {
    bool found = false;
    for_each_fill(std::span(program.body).subspan(index, 1),
                  [&](const Fill& fill) { found = found || (fill.field == field && is_grown); });
    return found;
  };
  return match(
      program.body[index],
      [&](const Fill& fill) { return fill.field == field && (is_grown || refills(program, index, fill)); },
      [&](const Fold& fold) { return fold.field == field || wall_fields(fold.axes).contains(field); },
      [](const Reduce&) { return false; }, [](const NetworkCall&) { return false; },
      [](const Transform&) { return false; }, [](const Run&) { return false; },
      [&](const Solve&) { return is_filled_anew(); }, [&](const Repeat&) { return is_filled_anew(); });
}

/// What of a repeat is needed for its results and for what it saves; nullopt where nothing is.
std::optional<Repeat> needed_of(const Module& module, const Program& program, Repeat repeat,
                                const std::set<std::string>& needed, const Saves& saves, std::size_t index,
                                Module& kernels) {
  const auto is_needed = [&](const Carry& carry) { return needed.contains(carry.result); };
  std::erase_if(repeat.saves, [&](const Stacked& save) { return !needed.contains(save.stack); });
  const auto saved = saves.find(index);
  if (saved != saves.end()) repeat.saves.insert(repeat.saves.end(), saved->second.begin(), saved->second.end());
  if (repeat.saves.empty() && std::ranges::none_of(repeat.carries, is_needed)) return std::nullopt;
  std::set<std::string> inside;
  for (const Carry& carry : repeat.carries) inside.insert(carry.next);
  for (const Stacked& save : repeat.saves) inside.insert(save.field);
  repeat.body = recomputation(module, pass_of(repeat, program), inside, {}, kernels);
  return repeat;
}

}  // namespace

std::vector<Statement> recomputation(const Module& module, const Program& program, std::set<std::string> needed,
                                     const Saves& saves, Module& kernels) {
  std::vector<Statement> kept;
  for (std::size_t index = program.body.size(); index-- > 0;) {
    const Statement* statement = &program.body[index];
    std::optional<Repeat> repeat;
    const bool keep = match(
        *statement,
        [&](const Fill& fill) {
          if (!needed.contains(fill.field)) return false;
          needed.merge(wall_fields(fill.axes));
          return true;
        },
        [&](const Fold& fold) {
          const std::set<std::string> walls = wall_fields(fold.axes);
          const bool into_needed =
              std::any_of(walls.begin(), walls.end(), [&](const std::string& wall) { return needed.contains(wall); });
          if (into_needed) needed.insert(fold.field);
          return needed.contains(fold.field);
        },
        [&](const Reduce& reduce) {
          if (!needed.contains(reduce.result)) return false;
          needed.insert(reduce.field);
          return true;
        },
        [&](const NetworkCall& network_call) {
          const std::vector<std::string> written = fields_written(network_call);
          if (std::none_of(written.begin(), written.end(),
                           [&](const std::string& field) { return needed.contains(field); }))
            return false;
          for (const std::string& field : fields_read(network_call)) needed.insert(field);
          return true;
        },
        [&](const Transform& transform) {
          if (!needed.contains(transform.result)) return false;
          for (const Transform::Term& term : transform.terms) needed.insert(term.field);
          return true;
        },
        [&](const Run& run) {
          const Kernel& kernel = *module.find_kernel(run.kernel);
          const Signature s = signature(kernel);
          const auto is_needed = [&](const std::string& field) { return needed.contains(field); };
          if (std::none_of(s.writes.begin(), s.writes.end(), is_needed) &&
              std::none_of(s.updates.begin(), s.updates.end(), is_needed)) {
            return false;
          }
          for (const auto& read : s.reads) needed.insert(read.field);
          if (!kernels.find_kernel(kernel.name)) kernels.kernels.push_back(kernel);
          return true;
        },
        [&](const Solve& solve) {
          if (std::ranges::none_of(solve.unknowns, [&](const auto& field) { return needed.contains(field); }))
            return false;
          for (const std::string& field : effects(module, solve).reads) needed.insert(field);
          add_kernels(kernels, module, operator_of(solve, program));
          return true;
        },
        [&](const Repeat& whole) {
          repeat = needed_of(module, program, whole, needed, saves, index, kernels);
          if (!repeat) return false;
          for (const std::string& field : effects(module, *repeat).reads) needed.insert(field);
          for (const Stacked& load : repeat->loads) needed.insert(load.stack);
          return true;
        });
    if (keep) kept.push_back(repeat ? Statement(*repeat) : *statement);
  }
  std::reverse(kept.begin(), kept.end());
  return kept;
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
      is_changed = changes(program, i, field, grown.contains(field));
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
