// SPDX-License-Identifier: Apache-2.0
// One walk over the statements of a program, pass by pass, with the present meaning of each name.
#include "syntax/unroll.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <vector>

#include "syntax/rename.h"

namespace dpde::ast {
namespace {

using Fields = std::map<std::string, std::string>;  // what stands for a field

bool has_repeat(const Program& program) {
  return std::any_of(program.items.begin(), program.items.end(),
                     [](const Item& item) { return std::holds_alternative<RepeatItem>(item.kind); });
}

double statements_in(const std::vector<Item>& items) {
  double total = 0;
  for (const Item& item : items) {
    const RepeatItem* repeat = std::get_if<RepeatItem>(&item.kind);
    total += repeat ? std::max(repeat->count, 1) * statements_in(repeat->items) : 1;
  }
  return total;
}

const Kernel* find_kernel(const File& file, const std::string& name) {
  for (const Declaration& declaration : file.declarations) {
    const Kernel* kernel = std::get_if<Kernel>(&declaration.kind);
    if (kernel && kernel->name.name == name) return kernel;
  }
  return nullptr;
}

/// Names with a number that is not taken: v_2, v_3, ...; u_2.x of a component.
class Numbered {
 public:
  void reserve(const std::string& name) { used_.insert(name); }
  std::string next(const std::string& name) {
    const std::size_t dot = std::min(name.find('.'), name.size());
    int& number = numbers_.try_emplace(name, 1).first->second;
    std::string result;
    do {
      result = fmt::format("{}_{}{}", name.substr(0, dot), ++number, name.substr(dot));
    } while (!used_.insert(result).second);
    return result;
  }

 private:
  std::set<std::string> used_;
  std::map<std::string, int> numbers_;
};

/// Kernels on other fields than their own.
class KernelCopies {
 public:
  explicit KernelCopies(const File& file) {
    for (const Declaration& declaration : file.declarations) {
      if (const Kernel* kernel = std::get_if<Kernel>(&declaration.kind)) names_.reserve(kernel->name.name);
      if (const Program* program = std::get_if<Program>(&declaration.kind)) names_.reserve(program->name.name);
    }
  }

  /// The name of the kernel with `fields` in the place of its own.
  std::string name_of(const Kernel& kernel, const Fields& fields) {
    const auto [known, is_new] = known_.try_emplace({kernel.name.name, fields});
    if (!is_new) return known->second;
    Kernel copy = rename(kernel, [&](const std::string& name) {
      const auto found = fields.find(name);
      return found == fields.end() ? name : found->second;
    });
    copy.name.name = known->second = names_.next(kernel.name.name);
    made_[kernel.name.name].push_back(std::move(copy));
    return known->second;
  }

  /// In the order in which they were made.
  std::vector<Kernel> of(const std::string& kernel) const {
    const auto found = made_.find(kernel);
    return found == made_.end() ? std::vector<Kernel>() : found->second;
  }

 private:
  Numbered names_;
  std::map<std::pair<std::string, Fields>, std::string> known_;
  std::map<std::string, std::vector<Kernel>> made_;
};

class ProgramUnroller {
 public:
  ProgramUnroller(const File& file, const Program& program, KernelCopies& copies, DiagnosticSink& sink)
      : file_(file), program_(program), copies_(copies), sink_(sink) {
    for (const Declaration& declaration : file.declarations) {
      if (const Kernel* kernel = std::get_if<Kernel>(&declaration.kind)) reserve_names(*kernel);
    }
    reserve_fields(program.items);
  }

  std::vector<Item> run() {
    passes_.emplace_back();
    if (is_short_enough()) {
      for (const Item& item : program_.items) add(item);
    }
    swap_inputs();
    return std::move(result_);
  }

 private:
  struct Meaning {
    std::string field;
    int pass = 0;  // in which it was written; 0: it outlives all
  };
  using Meanings = std::map<std::string, Meaning>;
  struct Pass {
    int number = 0;
    std::vector<std::pair<SwapItem, SourceRange>> swaps;
  };
  struct Lost {
    SourceRange write;
    std::size_t depth = 0;  // of the pass
  };

  void reserve_names(const Kernel& kernel) {
    for (const KernelParameter& parameter : kernel.parameters) names_.reserve(parameter.name.name);
    for (const Item& item : kernel.items) {
      if (const LetItem* let = std::get_if<LetItem>(&item.kind)) names_.reserve(let->name.name);
    }
  }
  void reserve_fields(const std::vector<Item>& items);
  bool is_short_enough();

  void add(const Item& item);
  void add_fill(FillItem fill, const Item& item);
  void add_reduce(ReduceItem reduce, const Item& item);
  void add_apply(ApplyItem apply, const Item& item);
  void add_run(RunItem run, const Item& item);
  bool reads_what_it_adds_to(const Kernel& kernel, const Fields& fields, SourceRange range);
  void add_swap(const SwapItem& swap, const Item& item);
  void add_repeat(const RepeatItem& repeat);
  void check_swaps(const RepeatItem& repeat);
  void check_keep(const KeepItem& keep);
  void emit(ItemKind kind, const Item& item) { result_.push_back({std::move(kind), item.range, {}}); }

  std::string read(const std::string& name, SourceRange range);
  std::string write(const std::string& name, SourceRange range);
  void report_lost(const std::string& name, SourceRange range, const Lost& lost);
  void check_known(const Identifier& field);
  void end_pass(const Meanings& before);
  void swap_inputs();

  const File& file_;
  const Program& program_;
  KernelCopies& copies_;
  DiagnosticSink& sink_;
  Numbered names_;
  std::vector<Item> result_;
  std::vector<Pass> passes_;  // that are under way, the whole program first
  int pass_count_ = 0;
  Meanings meanings_;  // of names that do not stand for themselves, or not for ever
  std::map<std::string, SourceRange> written_at_;
  std::map<std::string, Lost> lost_;                       // written in a pass that is over
  std::set<std::string> inputs_, used_;                    // fields that were read before they were written; all fields
  std::vector<std::pair<SwapItem, SourceRange>> carried_;  // the first swap of each state in a repeat
  std::set<std::string> swapped_;                          // states of swaps outside of repeats
};

void ProgramUnroller::reserve_fields(const std::vector<Item>& items) {
  for (const Item& item : items) {
    if (const FillItem* fill = std::get_if<FillItem>(&item.kind)) names_.reserve(fill->field.name);
    if (const ReduceItem* reduce = std::get_if<ReduceItem>(&item.kind)) names_.reserve(reduce->result.name);
    if (const SwapItem* swap = std::get_if<SwapItem>(&item.kind)) names_.reserve(swap->state.name);
    if (const ApplyItem* apply = std::get_if<ApplyItem>(&item.kind)) {
      for (const Identifier& result : apply->to) names_.reserve(result.name);
    }
    if (const RepeatItem* repeat = std::get_if<RepeatItem>(&item.kind)) reserve_fields(repeat->items);
  }
}

bool ProgramUnroller::is_short_enough() {
  const double total = statements_in(program_.items);
  if (total <= max_repeated_statements) return true;
  for (const Item& item : program_.items) {
    const RepeatItem* repeat = std::get_if<RepeatItem>(&item.kind);
    if (!repeat) continue;
    sink_.report("repeats-too-long", repeat->count_range,
                 {program_.name.name, fmt::format("{:.0f}", total), std::to_string(max_repeated_statements)},
                 "make fewer passes, or smaller steps of the scene");
    break;
  }
  return false;
}

void ProgramUnroller::add(const Item& item) {
  if (const FillItem* fill = std::get_if<FillItem>(&item.kind)) return add_fill(*fill, item);
  if (const ReduceItem* reduce = std::get_if<ReduceItem>(&item.kind)) return add_reduce(*reduce, item);
  if (const ApplyItem* apply = std::get_if<ApplyItem>(&item.kind)) return add_apply(*apply, item);
  if (const RunItem* run = std::get_if<RunItem>(&item.kind)) return add_run(*run, item);
  if (const SwapItem* swap = std::get_if<SwapItem>(&item.kind)) return add_swap(*swap, item);
  if (const RepeatItem* repeat = std::get_if<RepeatItem>(&item.kind)) return add_repeat(*repeat);
  if (const KeepItem* keep = std::get_if<KeepItem>(&item.kind)) check_keep(*keep);
  result_.push_back(item);
}

void ProgramUnroller::add_fill(FillItem fill, const Item& item) {
  for (BoundarySide& side : fill.sides) {
    side.value = rename(side.value, [&](const std::string& name) {
      return meanings_.contains(name) || lost_.contains(name) ? read(name, side.value.range()) : name;
    });
  }
  fill.written = fill.field.name;
  fill.field.name = read(fill.field.name, fill.field.range);
  emit(std::move(fill), item);
}

void ProgramUnroller::add_reduce(ReduceItem reduce, const Item& item) {
  reduce.field.name = read(reduce.field.name, reduce.field.range);
  reduce.result.name = write(reduce.result.name, reduce.result.range);
  emit(std::move(reduce), item);
}

void ProgramUnroller::add_apply(ApplyItem apply, const Item& item) {
  for (std::vector<Identifier>* fields : {&apply.inputs, &apply.by}) {
    for (Identifier& field : *fields) {
      if (field.name != "_") field.name = read(field.name, field.range);
    }
  }
  for (Identifier& field : apply.to) {
    if (field.name != "_") field.name = write(field.name, field.range);
  }
  emit(std::move(apply), item);
}

void ProgramUnroller::add_run(RunItem run, const Item& item) {
  const Kernel* kernel = find_kernel(file_, run.kernel.name);
  if (!kernel) return emit(run, item);  // reported by who reads the program
  Fields fields;
  const auto set = [&](const KernelParameter& parameter, const std::string& field) {
    if (field != parameter.name.name) fields[parameter.name.name] = field;
  };
  for (const KernelParameter& parameter : kernel->parameters) {
    const bool is_read = parameter.role == KernelRole::in || parameter.role == KernelRole::inout;
    if (is_read) set(parameter, read(parameter.name.name, run.kernel.range));
  }
  if (reads_what_it_adds_to(*kernel, fields, run.kernel.range)) return;
  for (const KernelParameter& parameter : kernel->parameters) {
    if (parameter.role == KernelRole::out) set(parameter, write(parameter.name.name, run.kernel.range));
  }
  if (!fields.empty()) run.kernel.name = copies_.name_of(*kernel, fields);
  emit(std::move(run), item);
}

/// Behind `swap u, w` both names are the field that w was: a kernel that reads one and adds to the other cannot run any
/// more.
bool ProgramUnroller::reads_what_it_adds_to(const Kernel& kernel, const Fields& fields, SourceRange range) {
  const auto field_of = [&](const KernelParameter& parameter) {
    const auto known = fields.find(parameter.name.name);
    return known == fields.end() ? parameter.name.name : known->second;
  };
  for (const KernelParameter& added : kernel.parameters) {
    if (added.role != KernelRole::inout) continue;
    for (const KernelParameter& other : kernel.parameters) {
      const bool is_read = other.role == KernelRole::in || other.role == KernelRole::inout;
      if (!is_read || other.name.name == added.name.name || field_of(other) != field_of(added)) continue;
      sink_.report("bad-program", range,
                   {fmt::format("here {} and {} are one field, which {} would read and add to", other.name.name,
                                added.name.name, kernel.name.name)},
                   "behind a swap both its names mean the second field: let a kernel write the sum to a field of its "
                   "own, out, and swap that");
      return true;
    }
  }
  return false;
}

void ProgramUnroller::add_swap(const SwapItem& swap, const Item& item) {
  if (passes_.size() > 1) {
    passes_.back().swaps.emplace_back(swap, item.range);
    return;
  }
  swapped_.insert(swap.state.name);
  SwapItem renamed = swap;
  renamed.next.name = read(swap.next.name, swap.next.range);
  emit(std::move(renamed), item);
}

void ProgramUnroller::check_keep(const KeepItem& keep) {
  for (const Identifier& name : keep.names) {
    if (read(name.name, name.range) == name.name) continue;
    sink_.report("kept-under-other-name", name.range, {name.name},
                 "let a kernel behind the repeat write it to another field, and keep that");
  }
}

void ProgramUnroller::check_swaps(const RepeatItem& repeat) {
  std::set<std::string> states;
  for (const Item& item : repeat.items) {
    const SwapItem* swap = std::get_if<SwapItem>(&item.kind);
    if (!swap) continue;
    const std::string& state = swap->state.name;
    const char* problem = state == swap->next.name ? "with itself" : !states.insert(state).second ? "twice" : nullptr;
    if (problem)
      sink_.report("bad-program", swap->state.range, {fmt::format("the repeat swaps {} {}", state, problem)});
  }
}

void ProgramUnroller::add_repeat(const RepeatItem& repeat) {
  if (repeat.count < 1) {
    sink_.report("bad-repeat", repeat.count_range,
                 {std::to_string(max_repeated_statements), std::to_string(repeat.count)});
  }
  check_swaps(repeat);
  for (int pass = 0; pass < std::max(repeat.count, 1); ++pass) {
    const Meanings before = meanings_;
    passes_.push_back({++pass_count_, {}});
    for (const Item& item : repeat.items) add(item);
    end_pass(before);
    passes_.pop_back();
  }
}

std::string ProgramUnroller::read(const std::string& name, SourceRange range) {
  const auto meaning = meanings_.find(name);
  if (meaning != meanings_.end()) return meaning->second.field;
  const auto lost = lost_.find(name);
  if (lost != lost_.end()) {
    report_lost(name, range, lost->second);
    lost_.erase(lost);  // once is enough
  }
  if (!used_.contains(name)) inputs_.insert(name);
  used_.insert(name);
  return name;
}

void ProgramUnroller::report_lost(const std::string& name, SourceRange range, const Lost& lost) {
  const bool is_behind = passes_.size() < lost.depth;
  Diagnostic& diagnostic = sink_.report(
      "not-carried", range, {name, is_behind ? "out of it" : "to the next"},
      is_behind
          ? fmt::format("write swap u, {0} in the repeat and use u behind it: u is then the {0} of the last pass", name)
          : fmt::format("write to a second field, out {0}_next: field, and swap {0}, {0}_next in the repeat", name));
  diagnostic.notes.push_back({lost.write, "it is written here"});
}

/// A field that no pass before has written.
std::string ProgramUnroller::write(const std::string& name, SourceRange range) {
  const auto meaning = meanings_.find(name);
  const int pass = passes_.back().number;
  // A second time in one pass, or outside of repeats, is the business of the rules for straight lines.
  const bool again = meaning != meanings_.end() && meaning->second.pass == pass;
  if (again) return meaning->second.field;
  if (passes_.size() == 1 && !lost_.contains(name)) {
    used_.insert(name);
    return name;
  }
  const std::string field = used_.contains(name) ? names_.next(name) : name;
  used_.insert(field);
  written_at_[name] = range;
  lost_.erase(name);
  meanings_[name] = {field, pass};
  return field;
}

void ProgramUnroller::check_known(const Identifier& field) {
  if (meanings_.contains(field.name) || lost_.contains(field.name) || used_.contains(field.name)) return;
  sink_.report("program-result-not-written", field.range, {program_.name.name, field.name});
}

void ProgramUnroller::end_pass(const Meanings& before) {
  const int number = passes_.back().number;
  Meanings next;
  for (const auto& [swap, range] : passes_.back().swaps) {
    const auto outer = before.find(swap.state.name);
    const int owner = outer == before.end() ? 0 : outer->second.pass;
    check_known(swap.next);
    const Meaning meaning{read(swap.next.name, swap.next.range), owner};
    next.emplace(swap.state.name, meaning);
    const auto same = [&](const auto& known) { return known.first.state.name == swap.state.name; };
    if (std::none_of(carried_.begin(), carried_.end(), same)) carried_.emplace_back(swap, range);
  }
  for (auto& [name, meaning] : next) {
    lost_.erase(name);
    meanings_[name] = meaning;
  }
  std::erase_if(meanings_, [&](const auto& entry) {
    if (entry.second.pass != number) return false;
    lost_[entry.first] = {written_at_[entry.first], passes_.size()};
    return true;
  });
}

/// What the passes have made of the program's inputs is their next state.
void ProgramUnroller::swap_inputs() {
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

Unrolled unrolled(const File& file, DiagnosticSink& sink) {
  KernelCopies copies(file);
  std::map<const Program*, std::vector<Item>> bodies;
  for (const Declaration& declaration : file.declarations) {
    const Program* program = std::get_if<Program>(&declaration.kind);
    if (program && has_repeat(*program)) bodies[program] = ProgramUnroller(file, *program, copies, sink).run();
  }
  if (bodies.empty()) return {file, {}};
  Unrolled result;
  result.file.trailing_comments = file.trailing_comments;
  for (const Declaration& declaration : file.declarations) {
    Declaration& same = result.file.declarations.emplace_back(declaration);
    if (const Program* program = std::get_if<Program>(&declaration.kind); program && bodies.contains(program)) {
      std::get<Program>(same.kind).items = std::move(bodies[program]);
    }
    if (const Kernel* kernel = std::get_if<Kernel>(&declaration.kind)) {
      for (Kernel& copy : copies.of(kernel->name.name)) {
        result.copies.insert(copy.name.name);
        result.file.declarations.push_back(
            {std::move(copy), declaration.range, {}, declaration.layout, declaration.imported});
      }
    }
  }
  return result;
}

}  // namespace dpde::ast
