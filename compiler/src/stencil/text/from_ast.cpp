// SPDX-License-Identifier: Apache-2.0
// Programs and loops, and their number of axes: a kernel without offsets takes it from the programs that run it, a
// program from its fills and kernels. The verifier finds errors that the specific checks here do not cover.
#include "stencil/text/from_ast.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>

#include "stencil/analyse/effects.h"
#include "stencil/analyse/verify_stencil.h"
#include "stencil/build.h"
#include "stencil/text/as_written.h"
#include "stencil/text/boundary_from_ast.h"
#include "stencil/text/counters_from_ast.h"
#include "stencil/text/expr_from_ast.h"
#include "stencil/text/kernel_from_ast.h"
#include "stencil/text/networks_from_ast.h"
#include "stencil/text/repeats_from_ast.h"
#include "stencil/text/solves_from_ast.h"
#include "stencil/text/transforms_from_ast.h"
#include "support/match.h"
#include "syntax/expand/blocks.h"
#include "syntax/expand/repeats.h"

namespace dpde::stencil {

namespace {

class ModuleReader {
 public:
  ModuleReader(const ast::File& file, DiagnosticSink& sink) : source_(ast::resolve_repeats(file, sink)), sink_(sink) {}

  Module run() {
    if (source_.has_repeats && sink_.has_errors()) return module_;
    for_each<ast::Kernel>([&](const ast::Kernel& kernel) {
      if (!is_copy(kernel)) read_kernel(kernel);
    });
    if (source_.has_repeats && sink_.has_errors()) return module_;  // copies would repeat the same errors
    for_each<ast::Kernel>([&](const ast::Kernel& kernel) {
      if (is_copy(kernel)) read_kernel(kernel);
    });
    for_each<ast::Program>([&](const ast::Program& program) { spread_rank(program, false); });
    for_each<ast::Program>([&](const ast::Program& program) { spread_rank(program, true); });
    for (const KernelRead& read : kernels_) module_.kernels.push_back(read.kernel);
    module_.networks = read_networks(source_.file, sink_);
    for_each<ast::Program>([&](const ast::Program& program) { read_program(program); });
    for_each<ast::Loop>([&](const ast::Loop& loop) { read_loop(loop); });
    if (!sink_.has_errors()) report_problems();
    return module_;
  }

 private:
  template <class Kind, class F>
  void for_each(const F& f) {
    for (const ast::Declaration& declaration : source_.file.declarations) {
      if (const Kind* found = std::get_if<Kind>(&declaration.kind)) f(*found);
    }
  }

  bool is_copy(const ast::Kernel& kernel) const { return source_.copies.contains(kernel.name.name); }

  // ---- kernels and the number of axes ------------------------------------------------------------------------------
  KernelRead* find_kernel(const std::string& name) {
    const auto found =
        std::find_if(kernels_.begin(), kernels_.end(), [&](const KernelRead& k) { return k.kernel.name == name; });
    return found == kernels_.end() ? nullptr : &*found;
  }

  void read_kernel(const ast::Kernel& source) {
    if (find_kernel(source.name.name)) {
      sink_.report("name-taken", source.name.range, {source.name.name, "another kernel"});
      return;
    }
    kernels_.push_back(dpde::stencil::read_kernel(source, sink_));
    kernels_.back().kernel.origin = {source.copy_of, source.copied, source.name.range};
  }

  /// The number of axes that the program or its kernels show; nullopt if they show none.
  std::optional<int> told_rank(const ast::Program& source) {
    int rank = 0;
    for (const ast::Item& item : source.items) {
      if (const auto* axes = get_if<ast::AxesItem>(&item.kind)) {
        return std::min(static_cast<int>(axes->axes.size()), max_rank);
      }
    }
    ast::for_each_item(source.items, [&](const ast::Item& item) {
      if (const auto* reduce = get_if<ast::ReduceItem>(&item.kind)) {
        for (const ast::Identifier& axis : reduce->axes) rank = std::max(rank, axis_of(axis) + 1);
      }
      if (const auto* apply = get_if<ast::ApplyItem>(&item.kind))
        rank = std::max(rank, stencil::told_rank(source_.file, *apply).value_or(0));
      const auto* run = get_if<ast::RunItem>(&item.kind);
      const KernelRead* kernel = run ? find_kernel(run->kernel.name) : nullptr;
      if (kernel && kernel->rank_known) rank = std::max(rank, kernel->kernel.rank);
      const auto* fill = get_if<ast::FillItem>(&item.kind);
      for (std::size_t side = 0; fill && side < fill->sides.size(); ++side) {
        const std::optional<Place> place = place_of(fill->sides[side].place.name);
        if (place && place->axis >= 0) rank = std::max(rank, place->axis + 1);
      }
    });
    return rank == 0 ? std::nullopt : std::optional(rank);
  }

  /// Gives the program's number of axes to the kernels it runs that do not show their own.
  void spread_rank(const ast::Program& source, bool last) {
    std::optional<int> rank = told_rank(source);
    if (!rank && last) rank = 1;
    if (!rank) return;
    ranks_[source.name.name] = *rank;
    ast::for_each_item(source.items, [&](const ast::Item& item) {
      const auto* run = get_if<ast::RunItem>(&item.kind);
      KernelRead* kernel = run ? find_kernel(run->kernel.name) : nullptr;
      if (!kernel || kernel->rank_known) return;
      kernel->kernel.rank = *rank;
      kernel->rank_known = true;
    });
  }

  // ---- programs ----------------------------------------------------------------------------------------------------
  void read_program(const ast::Program& source) {
    if (module_.find_program(source.name.name)) {  // a kernel may have the same name as a program
      sink_.report("name-taken", source.name.range, {source.name.name, "another program"});
      return;
    }
    program_ = Program{source.name.name, read_topologies(source), {}, {}, {}};
    fields_ = fields_of(source);
    ranges_.clear();
    filled_.clear();
    for (const ast::Item& item : source.items) read_item(item);
    check_results(source);
    check_counters(module_, program_, source, fields_, sink_);
    statement_ranges_[program_.name] = ranges_;
    module_.programs.push_back(program_);
  }

  std::vector<std::string> fields_of(const ast::Program& source) {
    std::vector<std::string> fields;
    fields_known_ = true;
    ast::for_each_item(source.items, [&](const ast::Item& item) {
      std::ranges::move(fields_named(item), std::back_inserter(fields));
      if (const auto* apply = get_if<ast::ApplyItem>(&item.kind))
        fields_known_ = fields_known_ && module_.find_network(apply->network.name);
      const auto* run = get_if<ast::RunItem>(&item.kind);
      const Kernel* kernel = run ? module_.find_kernel(run->kernel.name) : nullptr;
      fields_known_ = fields_known_ && (!run || kernel);
      if (!kernel) return;
      const Signature s = signature(*kernel);
      for (const Signature::Read& read : s.reads) fields.push_back(read.field);
      fields.insert(fields.end(), s.writes.begin(), s.writes.end());
      fields.insert(fields.end(), s.updates.begin(), s.updates.end());
    });
    return fields;
  }

  /// Axes are periodic by default.
  std::vector<Topology> read_topologies(const ast::Program& source) {
    std::vector<Topology> axes(std::clamp(ranks_[source.name.name], 1, max_rank), Topology::periodic);
    ast::for_each_item(source.items, [&](const ast::Item& item) {
      if (const auto* stated = get_if<ast::AxesItem>(&item.kind)) read_axes(*stated, axes);
      const auto* fill = get_if<ast::FillItem>(&item.kind);
      if (!fill) return;
      for (const ast::BoundarySide& side : fill->sides) {
        const std::optional<Place> place = place_of(side.place.name);
        if (!place || is_name(side.value, "periodic")) continue;
        for (int axis = 0; axis < static_cast<int>(axes.size()); ++axis) {
          if (place->axis < 0 || place->axis == axis) axes[axis] = Topology::bounded;
        }
      }
    });
    return axes;
  }

  void read_axes(const ast::AxesItem& stated, std::vector<Topology>& axes) {
    for (std::size_t i = 0; i < stated.axes.size(); ++i) {
      const ast::Identifier& name = stated.axes[i].name;
      if (i >= max_rank || name.name != axis_letters.substr(i, 1)) {
        sink_.report("bad-program", name.range, {"the axes of a program are x, then y, then z"});
        return;
      }
      if (i < axes.size()) axes[i] = stated.axes[i].topology;
    }
  }

  void read_item(const ast::Item& item) {
    if (const auto* fill = get_if<ast::FillItem>(&item.kind)) {
      read_fill(*fill, item.range);
    } else if (const auto* reduce = get_if<ast::ReduceItem>(&item.kind)) {
      read_reduce(*reduce, item.range);
    } else if (const auto* transform = get_if<ast::TransformItem>(&item.kind)) {
      add(read_transform(*transform, fields_, program_.axes.size(), sink_), item.range);
    } else if (const auto* run = get_if<ast::RunItem>(&item.kind)) {
      read_run(*run, item.range);
    } else if (const auto* apply = get_if<ast::ApplyItem>(&item.kind)) {
      if (const auto call = read_network_call(source_.file, *apply, module_, sink_)) add(*call, item.range);
    } else if (const auto* repeat = get_if<ast::RepeatItem>(&item.kind)) {
      read_repeat(*repeat, item.range);
    } else if (const auto* solve = get_if<ast::SolveItem>(&item.kind)) {
      read_solve(*solve, item.range);
    } else if (const auto* swap = get_if<ast::SwapItem>(&item.kind)) {
      read_swap(*swap);
    } else if (const auto* keep = get_if<ast::KeepItem>(&item.kind)) {
      for (const ast::Identifier& name : keep->names) {
        check_written(name);
        program_.keeps.push_back(name.name);
      }
    } else if (!holds<ast::AxesItem>(item.kind)) {
      sink_.report("not-in-kernels", item.range, {"this item"});
    }
  }

  void add(Statement statement, SourceRange range) {
    const std::size_t before = program_.body.size();
    push(std::move(statement));
    ranges_.insert(ranges_.end(), program_.body.size() - before, range);
  }

  /// Adds a statement; in a repeat also the fills that it needs, before it.
  void push(Statement statement) {
    if (!pass_) return program_.body.push_back(std::move(statement));
    pass_->add(module_, std::move(statement), program_.body);
  }

  void read_repeat(const ast::RepeatItem& source, SourceRange range) {
    Repeat repeat = read_repeat_head(source);
    PassFills pass(program_.axes, repeat, filled_), *const outer = std::exchange(pass_, &pass);
    std::swap(repeat.body, program_.body);
    ranges_.push_back(range);
    for (const ast::Item& item : source.items) {
      if (holds<ast::StackItem>(item.kind)) continue;
      if (const auto* swap = get_if<ast::SwapItem>(&item.kind)) {
        check_written(swap->next);
      } else {
        blocks_.insert(item.range.begin);
        read_item(item);
      }
    }
    std::swap(repeat.body, program_.body);
    pass_ = outer;
    push(std::move(repeat));
  }

  void read_solve(const ast::SolveItem& source, SourceRange range) {
    Solve solve = read_solve_head(source, sink_);
    std::swap(solve.body, program_.body);
    const std::map<std::string, Fill> filled = filled_;
    PassFills* const outer = std::exchange(pass_, nullptr);
    ranges_.push_back(range);
    for (const ast::Item& item : source.items) {
      blocks_.insert(item.range.begin);
      read_item(item);
    }
    std::swap(solve.body, program_.body);
    filled_ = filled;
    pass_ = outer;
    push(std::move(solve));
  }

  void read_fill(const ast::FillItem& fill, SourceRange range) {
    const char* statement = fill.fold ? "fold" : "fill";
    const std::size_t rank = program_.axes.size();
    std::vector<AxisBoundary> axes(rank);
    std::vector<std::array<bool, 2>> said(rank, {false, false});
    for (const ast::BoundarySide& side : fill.sides) {
      const std::optional<Place> place = place_of(side.place.name);
      if (!place || place->axis >= static_cast<int>(rank)) {
        sink_.report("bad-program", side.place.range,
                     {fmt::format("{} is not an axis or a side of one", side.place.name)},
                     "write x, x.low, x.high, ... or all");
        return;
      }
      const AxisBoundary stated = read_side(side, *place, statement);
      for (std::size_t axis = 0; axis < rank; ++axis) {
        if (place->axis >= 0 && place->axis != static_cast<int>(axis)) continue;
        axes[axis].topology = stated.topology;
        if (place->low) axes[axis].low = stated.low;
        if (place->high) axes[axis].high = stated.high;
        said[axis][0] = said[axis][0] || place->low;
        said[axis][1] = said[axis][1] || place->high;
      }
    }
    check_fill(fill, statement, axes, said);
    check_distance(fill.grow, 0, range, sink_);
    const Written written{fill.written, fill.field.range};
    if (fill.fold) {
      add(Fold{fill.field.name, fill.grow, axes, written}, range);
      filled_.erase(fill.field.name);
    } else {
      add(Fill{fill.field.name, axes, written}, range);
      if (wall_fields(axes).empty()) filled_.insert_or_assign(fill.field.name, Fill{fill.field.name, axes, written});
    }
  }

  AxisBoundary read_side(const ast::BoundarySide& side, const Place& place, const char* statement) {
    AxisBoundary boundary;
    if (is_name(side.value, "periodic")) {
      if (!place.low || !place.high) {
        sink_.report("bad-program", side.value.range(), {"one side of an axis cannot be periodic by itself"});
      }
      return boundary;
    }
    boundary.topology = Topology::bounded;
    boundary.low = boundary.high = read_condition(side.value, statement);
    return boundary;
  }

  /// A condition of side_conditions.h, or on_wall(condition).
  Side read_condition(const ast::Expr& e, const char* statement) {
    const ast::Call* call = std::get_if<ast::Call>(&e->kind);
    const ast::Name* name = std::get_if<ast::Name>(&e->kind);
    if (call && call->callee == "on_wall") {
      Side side = takes(*call, 1, e.range()) ? read_condition(call->arguments[0].value, statement) : Side{};
      side.on_wall = true;
      return side;
    }
    BoundaryValueReader reader(fields_, statement, sink_);
    const std::string word = call ? call->callee : name ? name->name : "";
    const SideCondition* condition = find_condition(word, SideCondition::Level::programs);
    if (!condition || condition->is_word_alone() != (name != nullptr)) return {SideKind::value, read_wall(e, reader)};
    Side side{condition->kind};
    const std::vector<Expr*> parts = given_parts(side);
    if (call && !takes(*call, parts.size(), e.range())) return {};
    for (std::size_t i = 0; i < parts.size(); ++i) {
      const ast::Expr& given = call->arguments[i].value;
      *parts[i] = parts[i] == &side.value ? read_wall(given, reader) : reader.read(given);
    }
    return side;
  }

  bool takes(const ast::Call& call, std::size_t count, SourceRange range) {
    if (call.arguments.size() == count) return true;
    sink_.report("kernel-argument-count", range,
                 {call.callee, std::to_string(count), std::to_string(call.arguments.size())});
    return false;
  }

  /// A single field, read along the wall, or a value that is constant along it.
  Expr read_wall(const ast::Expr& e, BoundaryValueReader& reader) {
    const ast::Name* name = std::get_if<ast::Name>(&e->kind);
    if (name && std::find(fields_.begin(), fields_.end(), name->name) != fields_.end()) return access(name->name);
    return reader.read(e);
  }

  void check_fill(const ast::FillItem& fill, const char* statement, const std::vector<AxisBoundary>& axes,
                  const std::vector<std::array<bool, 2>>& said) {
    check_known(fill.field);
    for (std::size_t axis = 0; axis < axes.size(); ++axis) {
      if (!said[axis][0] || !said[axis][1]) {
        const char* side = said[axis][0] ? ".high" : said[axis][1] ? ".low" : "";
        sink_.report("fill-incomplete", fill.field.range,
                     {statement, fill.field.name, fmt::format("{}{}", axis_letters[axis], side)},
                     fmt::format("add {}{} = ..., as in {}{} = 0", axis_letters[axis], side, axis_letters[axis], side));
      } else if (axes[axis].topology != program_.axes[axis]) {
        const bool bounded = program_.axes[axis] == Topology::bounded;
        sink_.report(
            "program-axes", fill.field.range,
            {program_.name, fmt::format("{} axis {}", bounded ? "a bounded" : "a periodic", axis_letters[axis]),
             fmt::format("the {} of {}", statement, fill.field.name), bounded ? "a periodic one" : "a bounded one"});
      }
    }
  }

  void read_reduce(const ast::ReduceItem& source, SourceRange range) {
    Reduce reduce{source.result.name, source.kind, source.field.name, {}};
    const int rank = static_cast<int>(program_.axes.size());
    for (const ast::Identifier& name : source.axes) {
      const int axis = axis_of(name);
      if (axis < 0 || axis >= rank) {
        sink_.report("unknown-axis", name.range, {name.name},
                     fmt::format("{} has {}", program_.name, axes_phrase(rank)));
        return;
      }
      reduce.over[static_cast<std::size_t>(axis)] = true;
    }
    if (source.axes.empty()) std::fill_n(reduce.over.begin(), rank, true);
    add(reduce, range);
  }

  /// -1 for other names.
  static int axis_of(const ast::Identifier& name) {
    const std::size_t axis = name.name.size() == 1 ? axis_letters.find(name.name) : std::string_view::npos;
    return axis == std::string_view::npos ? -1 : static_cast<int>(axis);
  }

  void read_run(const ast::RunItem& run, SourceRange range) {
    const Kernel* kernel = module_.find_kernel(run.kernel.name);
    if (!kernel) {
      sink_.report("unknown-kernel", run.kernel.range, {run.kernel.name}, [&] {
        std::vector<std::string> names;
        for (const Kernel& k : module_.kernels) names.push_back(k.name);
        return did_you_mean(run.kernel.name, names);
      });
      return;
    }
    const int rank = static_cast<int>(program_.axes.size());
    if (kernel->rank != rank) {
      sink_.report(
          "program-axes", run.kernel.range,
          {program_.name, axes_phrase(rank), fmt::format("kernel {}", kernel->name), axes_phrase(kernel->rank)});
    }
    check_distance(run.grow, 0, range, sink_);
    add(Run{run.kernel.name, run.grow}, range);
  }

  static std::string axes_phrase(int rank) { return rank == 1 ? "1 axis" : fmt::format("{} axes", rank); }

  /// A swap may replace a state that was never read: derivatives of steps that do not depend on it do so.
  void read_swap(const ast::SwapItem& swap) {
    check_written(swap.next);
    program_.swaps.push_back({swap.state.name, swap.next.name});
  }

  /// Reports nothing if a kernel is unknown, as its fields are then unknown too.
  void check_known(const ast::Identifier& field) {
    if (!fields_known_ || std::find(fields_.begin(), fields_.end(), field.name) != fields_.end()) return;
    sink_.report("program-unknown-field", field.range, {program_.name, field.name},
                 [&] { return did_you_mean(field.name, fields_); });
  }

  void check_written(const ast::Identifier& field) {
    std::vector<std::string> written;
    for (const Statement& statement : program_.body) {
      const Effects e = effects(module_, statement);
      written.insert(written.end(), e.writes.begin(), e.writes.end());
      written.insert(written.end(), e.updates.begin(), e.updates.end());
    }
    if (!fields_known_ || std::find(written.begin(), written.end(), field.name) != written.end()) return;
    sink_.report("program-result-not-written", field.range, {program_.name, field.name},
                 [&] { return did_you_mean(field.name, written); });
  }

  void check_results(const ast::Program& source) {
    bool has_sums = false;
    for (const Statement& statement : program_.body) {
      has_sums = has_sums || !effects(module_, statement).sums.empty();
    }
    if (sink_.has_errors() || has_sums || program_.body.empty() || !program_.swaps.empty() || !program_.keeps.empty())
      return;
    sink_.report("program-without-result", source.name.range, {program_.name},
                 "name the fields it computes, as in keep v or swap u, v");
  }

  // ---- loops and the rest ------------------------------------------------------------------------------------------
  void read_loop(const ast::Loop& source) {
    Loop loop{source.counter.name, source.from, source.to, {}};
    for (const ast::Identifier& name : source.body) {
      if (!module_.find_program(name.name)) {
        sink_.report("unknown-program", name.range, {name.name}, [&] {
          std::vector<std::string> names;
          for (const Program& program : module_.programs) names.push_back(program.name);
          return did_you_mean(name.name, names);
        });
      }
      loop.programs.push_back(name.name);
    }
    module_.loops.push_back(loop);
  }

  void report_problems() {
    for (const Violation& problem : find_violations(module_)) {
      SourceRange range;
      for_each<ast::Kernel>([&](const ast::Kernel& k) {
        if (k.name.name == problem.declaration) range = k.name.range;
      });
      for_each<ast::Program>([&](const ast::Program& p) {
        if (p.name.name == problem.declaration) range = p.name.range;
      });
      if (problem.statement >= 0) range = statement_ranges_[problem.declaration][problem.statement];
      const Program* program = module_.find_program(problem.declaration);
      sink_.report("bad-program", range, {program ? as_written(module_, *program, problem.text) : problem.text},
                   blocks_.contains(range.begin) ? "each block is by itself: it fills what it reads around a cell, and "
                                                   "what it writes is known in it only"
                                                 : "");
    }
  }

  const ast::ResolvedRepeats source_;
  DiagnosticSink& sink_;
  Module module_;
  std::vector<KernelRead> kernels_;
  std::map<std::string, int> ranks_;  // of programs
  std::map<std::string, std::vector<SourceRange>> statement_ranges_;
  Program program_;                     // the one being read
  std::vector<std::string> fields_;     // of the kernels it runs
  bool fields_known_ = true;            // all of these kernels exist
  std::vector<SourceRange> ranges_;     // of its statements; those of a block follow their statement
  std::set<int> blocks_;                // begins of statements in repeats
  std::map<std::string, Fill> filled_;  // the last fill of each field, if each pass of a repeat can redo it
  PassFills* pass_ = nullptr;           // of the repeat that is read
};

}  // namespace

Module from_ast(const ast::File& file, DiagnosticSink& sink) { return ModuleReader(file, sink).run(); }

}  // namespace dpde::stencil
