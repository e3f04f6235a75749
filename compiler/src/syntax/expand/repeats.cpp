// SPDX-License-Identifier: Apache-2.0
// One pass over the statements of a program, each block once, tracking the current field of each name.
#include "syntax/expand/repeats.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <utility>
#include <vector>

#include "syntax/expand/blocks.h"
#include "syntax/expand/kernel_copies.h"
#include "syntax/expand/rename.h"
#include "syntax/item_kinds.h"

namespace dpde::ast {
namespace {

bool has_repeat(const Program& program) {
  return std::any_of(program.items.begin(), program.items.end(),
                     [](const Item& item) { return holds<RepeatItem>(item.kind); });
}

const Kernel* find_kernel(const File& file, const std::string& name) {
  for (const Declaration& declaration : file.declarations) {
    const Kernel* kernel = std::get_if<Kernel>(&declaration.kind);
    if (kernel && kernel->name.name == name) return kernel;
  }
  return nullptr;
}

class ProgramResolver {
 public:
  ProgramResolver(const File& file, const Program& program, KernelCopies& copies, DiagnosticSink& sink)
      : file_(file), program_(program), copies_(copies), sink_(sink) {
    for (const Declaration& declaration : file.declarations) {
      if (const Kernel* kernel = std::get_if<Kernel>(&declaration.kind)) reserve_names(*kernel);
    }
    reserve_fields(program.items);
  }

  std::vector<Item> run() {
    passes_.emplace_back();
    find_kept_sums();
    for (const Item& item : program_.items) add(item);
    swap_inputs();
    return std::move(result_);
  }

 private:
  struct Meaning {
    std::string field;
    int pass = 0;  // pass that wrote it; 0: it outlives all passes
  };
  using Meanings = std::map<std::string, Meaning>;
  struct Pass {
    int number = 0;
    std::vector<std::pair<SwapItem, SourceRange>> swaps;
    std::set<std::string> written;            // fields
    std::map<std::string, SourceRange> read;  // names read before they are written in it
  };
  struct Lost {
    SourceRange write;
    std::size_t depth = 0;  // nesting depth of the pass
    std::string field;
    int pass = 0;
  };
  struct Carried {
    std::string name, state, next;
    SourceRange range;
  };

  void reserve_names(const Kernel& kernel) {
    for (const KernelParameter& parameter : kernel.parameters) names_.reserve(parameter.name.name);
    for (const Item& item : kernel.items) {
      match(
          item.kind, [&](const LetItem& let) { names_.reserve(let.name.name); },
          ignored<AssignItem, ScatterItem, AdjointItem>, [](const OutsideKernels auto&) {});
    }
  }
  void reserve_fields(const std::vector<Item>& items);
  void find_kept_sums();

  void add(const Item& item);
  void add_fill(FillItem fill, const Item& item);
  void add_reduce(ReduceItem reduce, const Item& item);
  void add_transform(TransformItem transform, const Item& item);
  void add_apply(ApplyItem apply, const Item& item);
  void add_run(RunItem run, const Item& item);
  void add_swap(const SwapItem& swap, const Item& item);
  void add_repeat(const RepeatItem& repeat, const Item& item);
  void add_solve(SolveItem solve, const Item& item);
  void check_swaps(const RepeatItem& repeat);
  void check_keep(const KeepItem& keep);
  void emit(ItemKind kind, SourceRange range) { result_.push_back({std::move(kind), range, {}}); }

  std::string read(const std::string& name, SourceRange range);
  std::string write(const std::string& name, SourceRange range);
  std::string begin_adding(const std::string& name, SourceRange range);
  std::string copy_of(const std::string& field, SourceRange range);
  void report_lost(const std::string& name, SourceRange range, const Lost& lost);
  void check_known(const Identifier& field);
  std::vector<Carried> end_pass(const Meanings& before, int count);
  std::vector<Identifier> results_of(const RepeatItem& repeat, const std::vector<Carried>& carried,
                                     const Meanings& before);
  void swap_inputs();

  const File& file_;
  const Program& program_;
  KernelCopies& copies_;
  DiagnosticSink& sink_;
  Numbered names_;
  std::vector<Item> result_;  // of the program or of the current block
  std::vector<Pass> passes_;  // enclosing passes, the whole program first
  int pass_count_ = 0;
  Meanings meanings_;  // of names that denote another field, or only temporarily
  std::map<std::string, SourceRange> written_at_;
  std::map<std::string, Lost> lost_;                       // written in a finished pass
  std::set<std::string> inputs_, used_;                    // fields read before they were written; all fields
  std::vector<std::pair<SwapItem, SourceRange>> carried_;  // the first swap of each state in a repeat
  std::map<std::string, const RepeatItem*> kept_sums_;     // kept fields, and the last repeat that adds to them
  std::set<std::string> swapped_;                          // states of swaps outside repeats
};

void ProgramResolver::reserve_fields(const std::vector<Item>& items) {
  for (const Item& item : items) {
    match(
        item.kind, [&](const FillItem& fill) { names_.reserve(fill.field.name); },
        [&](const ReduceItem& reduce) { names_.reserve(reduce.result.name); },
        [&](const TransformItem& transform) { names_.reserve(transform.result.name); },
        [&](const SwapItem& swap) { names_.reserve(swap.state.name); },
        [&](const ApplyItem& apply) {
          for (const Identifier& result : apply.to) names_.reserve(result.name);
        },
        [&](const RepeatItem& repeat) {
          reserve_fields(repeat.items);
          for (const Identifier& result : repeat.to) names_.reserve(result.name);
          if (repeat.counter) names_.reserve(repeat.counter->name);
        },
        [&](const SolveItem& solve) {
          reserve_fields(solve.items);
          for (const Identifier& unknown : solve.unknowns) names_.reserve(unknown.name);
        },
        ignored<RunItem, StackItem, KeepItem, AxesItem>, [](const OutsidePrograms auto&) {});
  }
}

/// Finds kept fields to which repeats add: the result of the last such repeat gets the field's name.
void ProgramResolver::find_kept_sums() {
  for (const Item& item : program_.items) {
    const KeepItem* keep = get_if<KeepItem>(&item.kind);
    for (std::size_t i = 0; keep && i < keep->names.size(); ++i) {
      for (const Item& other : program_.items) {
        const RepeatItem* repeat = get_if<RepeatItem>(&other.kind);
        if (repeat && adds_to(file_, *repeat, keep->names[i].name)) kept_sums_[keep->names[i].name] = repeat;
      }
    }
  }
}

void ProgramResolver::add(const Item& item) {
  match(
      item.kind, [&](const FillItem& fill) { add_fill(fill, item); },
      [&](const ReduceItem& reduce) { add_reduce(reduce, item); },
      [&](const TransformItem& transform) { add_transform(transform, item); },
      [&](const ApplyItem& apply) { add_apply(apply, item); }, [&](const RunItem& run) { add_run(run, item); },
      [&](const SwapItem& swap) { add_swap(swap, item); }, [&](const RepeatItem& repeat) { add_repeat(repeat, item); },
      [&](const SolveItem& solve) { add_solve(solve, item); },
      [&](const KeepItem& keep) {
        check_keep(keep);
        result_.push_back(item);
      },
      [&](const StackItem& stack) {
        used_.insert(stack.field.name);
        result_.push_back(item);
      },
      [&](const AxesItem&) { result_.push_back(item); }, [&](const OutsidePrograms auto&) { result_.push_back(item); });
}

void ProgramResolver::add_fill(FillItem fill, const Item& item) {
  for (BoundarySide& side : fill.sides) {
    side.value = rename(side.value, [&](const std::string& name) {
      return meanings_.contains(name) || lost_.contains(name) ? read(name, side.value.range()) : name;
    });
  }
  fill.written = fill.field.name;
  fill.field.name = read(fill.field.name, fill.field.range);
  emit(std::move(fill), item.range);
}

void ProgramResolver::add_reduce(ReduceItem reduce, const Item& item) {
  reduce.field.name = read(reduce.field.name, reduce.field.range);
  reduce.result.name = write(reduce.result.name, reduce.result.range);
  emit(std::move(reduce), item.range);
}

void ProgramResolver::add_transform(TransformItem transform, const Item& item) {
  for (TransformItem::Term& term : transform.terms) term.field.name = read(term.field.name, term.field.range);
  transform.result.name = write(transform.result.name, transform.result.range);
  emit(std::move(transform), item.range);
}

void ProgramResolver::add_apply(ApplyItem apply, const Item& item) {
  for (std::vector<Identifier>* fields : {&apply.inputs, &apply.by}) {
    for (Identifier& field : *fields) {
      if (field.name != "_") field.name = read(field.name, field.range);
    }
  }
  for (Identifier& field : apply.to) {
    if (field.name != "_") field.name = write(field.name, field.range);
  }
  emit(std::move(apply), item.range);
}

/// Inside the block, unknowns have the same names as after it.
void ProgramResolver::add_solve(SolveItem solve, const Item& item) {
  for (Identifier& right : solve.rights) right.name = read(right.name, right.range);
  for (Identifier& guess : solve.guesses) guess.name = read(guess.name, guess.range);
  for (std::size_t i = 1; solve.network && i < solve.network->inputs.size(); ++i) {
    Identifier& beside = solve.network->inputs[i];  // the first one exists only inside the solve
    beside.name = read(beside.name, beside.range);
  }
  for (Identifier& unknown : solve.unknowns) unknown.name = write(unknown.name, unknown.range);
  std::vector<Item> outer = std::exchange(result_, {});
  for (const Item& inner : std::exchange(solve.items, {})) add(inner);
  solve.items = std::exchange(result_, std::move(outer));
  for (Identifier& image : solve.images) image.name = read(image.name, image.range);
  emit(std::move(solve), item.range);
}

void ProgramResolver::add_run(RunItem run, const Item& item) {
  const Kernel* kernel = find_kernel(file_, run.kernel.name);
  if (!kernel) return emit(run, item.range);  // reported when the program is lowered
  Fields fields;
  const auto set = [&](const KernelParameter& parameter, const std::string& field) {
    if (field != parameter.name.name) fields[parameter.name.name] = field;
  };
  for (const KernelParameter& parameter : kernel->parameters) {
    const std::string& name = parameter.name.name;
    if (parameter.role == KernelRole::in) set(parameter, read(name, run.kernel.range));
  }
  for (const KernelParameter& parameter : kernel->parameters) {
    const std::string& name = parameter.name.name;
    if (parameter.role == KernelRole::inout) set(parameter, begin_adding(name, run.kernel.range));
    if (parameter.role == KernelRole::out) set(parameter, write(name, run.kernel.range));
  }
  if (!fields.empty()) run.kernel.name = copies_.name_of(*kernel, fields);
  emit(std::move(run), item.range);
}

/// Field that is added to. If the sum was begun outside the repeat, it is first copied.
std::string ProgramResolver::begin_adding(const std::string& name, SourceRange range) {
  const std::string field = read(name, range);
  if (passes_.size() == 1 || passes_.back().written.contains(field)) return field;
  const auto meaning = meanings_.find(name);
  const int owner = meaning == meanings_.end() ? 0 : meaning->second.pass;
  meanings_[name] = {copy_of(field, range), owner};
  return meanings_[name].field;
}

std::string ProgramResolver::copy_of(const std::string& field, SourceRange range) {
  const std::string copy = names_.next(field);
  used_.insert(copy);
  passes_.back().written.insert(copy);
  emit(RunItem{{copies_.copy("program " + program_.name.name, field, copy, range), range}, 0}, range);
  return copy;
}

void ProgramResolver::add_swap(const SwapItem& swap, const Item& item) {
  if (passes_.size() > 1) {
    passes_.back().swaps.emplace_back(swap, item.range);
    return;
  }
  swapped_.insert(swap.state.name);
  SwapItem renamed = swap;
  renamed.next.name = read(swap.next.name, swap.next.range);
  emit(std::move(renamed), item.range);
}

void ProgramResolver::check_keep(const KeepItem& keep) {
  for (const Identifier& name : keep.names) {
    if (read(name.name, name.range) == name.name) continue;
    sink_.report("kept-under-other-name", name.range, {name.name},
                 "let a kernel after the repeat write it to another field, and keep that");
  }
}

void ProgramResolver::check_swaps(const RepeatItem& repeat) {
  std::set<std::string> states;
  for (const Item& item : repeat.items) {
    const SwapItem* swap = get_if<SwapItem>(&item.kind);
    if (!swap) continue;
    const std::string& state = swap->state.name;
    const char* problem = state == swap->next.name ? "with itself" : !states.insert(state).second ? "twice" : nullptr;
    if (problem)
      sink_.report("bad-program", swap->state.range, {fmt::format("the repeat swaps {} {}", state, problem)});
  }
}

void ProgramResolver::add_repeat(const RepeatItem& repeat, const Item& item) {
  if (repeat.count < 1) sink_.report("bad-repeat", repeat.count_range, {"1 or more", std::to_string(repeat.count)});
  check_swaps(repeat);
  const Meanings before = meanings_;
  std::vector<Item> outer = std::exchange(result_, {});
  passes_.push_back({++pass_count_, {}, {}, {}});
  for (const Item& inner : repeat.items) add(inner);
  const std::vector<Carried> carried = end_pass(before, repeat.count);
  RepeatItem resolved{
      std::max(repeat.count, 1), false, repeat.count_range, std::exchange(result_, std::move(outer)), {}};
  resolved.counter = repeat.counter;
  resolved.is_backwards = repeat.is_backwards;
  passes_.pop_back();
  resolved.to = results_of(repeat, carried, before);
  emit(std::move(resolved), item.range);
}

/// Names of the repeat's results; updates the fields of names after it.
std::vector<Identifier> ProgramResolver::results_of(const RepeatItem& repeat, const std::vector<Carried>& carried,
                                                    const Meanings& before) {
  std::vector<Identifier> results;
  for (const Carried& each : carried) {
    const auto outer = before.find(each.name);
    if (results.size() < repeat.to.size()) {  // explicit name: the state's name keeps its earlier field
      const Identifier& given = repeat.to[results.size()];
      if (outer == before.end()) meanings_.erase(each.name);
      if (outer != before.end()) meanings_[each.name] = outer->second;
      results.push_back({write(given.name, given.range), given.range});
      continue;
    }
    const auto kept = kept_sums_.find(each.name);
    const bool has_name = kept != kept_sums_.end() && kept->second == &repeat && each.state != each.name;
    const std::string result = has_name ? each.name : names_.next(each.name);
    used_.insert(result);
    passes_.back().written.insert(result);
    meanings_[each.name] = {result, outer == before.end() ? 0 : outer->second.pass};
    results.push_back({result, each.range});
  }
  if (results.size() < repeat.to.size()) {
    sink_.report("bad-program", repeat.to.back().range,
                 {fmt::format("the repeat carries {} fields and names {}", results.size(), repeat.to.size())},
                 "one name for each swap in it");
  }
  return results;
}

std::string ProgramResolver::read(const std::string& name, SourceRange range) {
  const auto meaning = meanings_.find(name);
  const std::string& field = meaning == meanings_.end() ? name : meaning->second.field;
  for (auto pass = passes_.rbegin(); pass != passes_.rend() && !pass->written.contains(field); ++pass)
    pass->read.emplace(name, range);
  if (meaning != meanings_.end()) return field;
  const auto lost = lost_.find(name);
  if (lost != lost_.end()) {
    report_lost(name, range, lost->second);
    lost_.erase(lost);  // report only once
  }
  if (!used_.contains(name)) inputs_.insert(name);
  used_.insert(name);
  return name;
}

void ProgramResolver::report_lost(const std::string& name, SourceRange range, const Lost& lost) {
  const bool is_behind = passes_.size() < lost.depth;
  Diagnostic& diagnostic = sink_.report(
      "not-carried", range, {name, is_behind ? "out of it" : "to the next"},
      is_behind
          ? fmt::format("write swap u, {0} in the repeat and use u after it: u is then the {0} of the last pass", name)
          : fmt::format("write to a second field, out {0}_next: field, and swap {0}, {0}_next in the repeat", name));
  diagnostic.notes.push_back({lost.write, "it is written here"});
}

/// Name of a field for this write that was not written before.
std::string ProgramResolver::write(const std::string& name, SourceRange range) {
  const auto meaning = meanings_.find(name);
  const int pass = passes_.back().number;
  // A second write in one pass, or outside repeats, is checked by the rules for straight-line programs.
  const bool again = meaning != meanings_.end() && meaning->second.pass == pass;
  if (again) return meaning->second.field;
  if (passes_.size() == 1 && kept_sums_.contains(name) && !used_.contains(name)) {
    used_.insert(name);
    meanings_[name] = {names_.next(name), 0};
    passes_.back().written.insert(meanings_[name].field);
    return meanings_[name].field;
  }
  if (passes_.size() == 1 && !lost_.contains(name)) {
    used_.insert(name);
    passes_.back().written.insert(name);
    return name;
  }
  // Reuses the local field of a finished repeat that does not enclose this one.
  const auto lost = lost_.find(name);
  const bool is_free = lost != lost_.end() && passes_.size() > 1 && lost->second.pass < pass;
  const std::string field = is_free ? lost->second.field : used_.contains(name) ? names_.next(name) : name;
  used_.insert(field);
  passes_.back().written.insert(field);
  written_at_[name] = range;
  lost_.erase(name);
  meanings_[name] = {field, pass};
  return field;
}

void ProgramResolver::check_known(const Identifier& field) {
  if (meanings_.contains(field.name) || lost_.contains(field.name) || used_.contains(field.name)) return;
  sink_.report("program-result-not-written", field.range, {program_.name.name, field.name});
}

/// States of the block: those of its swaps, and changed fields that outlive the pass.
std::vector<ProgramResolver::Carried> ProgramResolver::end_pass(const Meanings& before, int count) {
  const int number = passes_.back().number;
  const auto field_before = [&](const std::string& name) {
    const auto outer = before.find(name);
    return outer == before.end() ? name : outer->second.field;
  };
  std::vector<Carried> carried;
  Meanings next;
  const std::vector<std::pair<SwapItem, SourceRange>> swaps = passes_.back().swaps;
  for (const auto& [swap, range] : swaps) {
    const auto outer = before.find(swap.state.name);
    check_known(swap.next);
    const std::string field = read(swap.next.name, swap.next.range);
    next.emplace(swap.state.name, Meaning{field, outer == before.end() ? 0 : outer->second.pass});
    carried.push_back({swap.state.name, field_before(swap.state.name), field, range});
    const auto same = [&](const auto& known) { return known.first.state.name == swap.state.name; };
    if (std::none_of(carried_.begin(), carried_.end(), same)) carried_.emplace_back(swap, range);
  }
  for (const auto& [name, meaning] : meanings_) {
    if (next.contains(name) || meaning.pass == number || meaning.field == field_before(name)) continue;
    carried.push_back({name, field_before(name), meaning.field, passes_.back().read[name]});
  }
  for (auto& [name, meaning] : next) {
    lost_.erase(name);
    meanings_[name] = meaning;
  }
  std::erase_if(meanings_, [&](const auto& entry) {
    if (entry.second.pass != number) return false;
    const Lost lost{written_at_[entry.first], passes_.size(), entry.second.field, number};
    const auto too_early = passes_.back().read.find(entry.first);
    if (count > 1 && too_early != passes_.back().read.end()) report_lost(entry.first, too_early->second, lost);
    lost_[entry.first] = lost;
    return true;
  });
  std::set<std::string> taken;
  for (Carried& each : carried) {
    const bool is_own = passes_.back().written.contains(each.next) && taken.insert(each.next).second;
    if (!is_own) each.next = copy_of(each.next, each.range);
    emit(SwapItem{{each.state, each.range}, {each.next, each.range}}, each.range);
  }
  return carried;
}

/// For inputs of the program that passes have changed, the result is their next state.
void ProgramResolver::swap_inputs() {
  for (const auto& [swap, range] : carried_) {
    const std::string& state = swap.state.name;
    const auto meaning = meanings_.find(state);
    if (meaning == meanings_.end() || meaning->second.field == state || !inputs_.contains(state) ||
        swapped_.contains(state))
      continue;
    SwapItem next = swap;
    next.next.name = meaning->second.field;
    result_.push_back({next, range, {}});
  }
}

}  // namespace

ResolvedRepeats resolve_repeats(const File& file, DiagnosticSink& sink) {
  KernelCopies copies(file);
  std::map<const Program*, std::vector<Item>> bodies;
  for (const Declaration& declaration : file.declarations) {
    const Program* program = std::get_if<Program>(&declaration.kind);
    if (program && has_repeat(*program)) bodies[program] = ProgramResolver(file, *program, copies, sink).run();
  }
  if (bodies.empty()) return {file, false, {}};
  ResolvedRepeats result{.file = {}, .has_repeats = true, .copies = {}};
  result.file.trailing_comments = file.trailing_comments;
  const auto add_copies = [&](const std::string& owner, const Declaration& declaration) {
    for (Kernel& copy : copies.of(owner)) {
      result.copies.insert(copy.name.name);
      result.file.declarations.push_back(
          {std::move(copy), declaration.range, {}, declaration.layout, declaration.imported});
    }
  };
  for (const Declaration& declaration : file.declarations) {
    Declaration& same = result.file.declarations.emplace_back(declaration);
    if (const Program* program = std::get_if<Program>(&declaration.kind); program && bodies.contains(program)) {
      std::get<Program>(same.kind).items = std::move(bodies[program]);
      add_copies("program " + program->name.name, declaration);
    }
    if (const Kernel* kernel = std::get_if<Kernel>(&declaration.kind)) add_copies(kernel->name.name, declaration);
  }
  return result;
}

}  // namespace dpde::ast
