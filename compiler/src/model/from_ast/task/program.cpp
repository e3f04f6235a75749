// SPDX-License-Identifier: Apache-2.0
// A hand-written program as the step of a scene. Its states are the fields that it swaps; its parameters and
// coefficients are the other inputs of its kernels. Its fills define the boundaries and must agree with the grid.
#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <iterator>

#include "model/from_ast/parts.h"
#include "support/match.h"
#include "support/names/bound_names.h"
#include "support/names/wave_names.h"

namespace dpde::model {

namespace {

void declare_param(Elaboration& elaboration, const std::string& name, SourceRange range) {
  if (find_bound_name(name) || elaboration.names.scope.find(name)) return;
  elaboration.names.scope.declare(name, {Role::parameter, range});
  elaboration.problem.params.push_back({name});
}

void declare_states(Elaboration& elaboration) {
  for (const auto& [swap, range] : items_of<ast::SwapItem>(elaboration.blocks.program->items)) {
    if (elaboration.names.scope.find(swap.state.name)) continue;
    elaboration.names.scope.declare(swap.state.name, {Role::state, swap.state.range});
    State state;
    state.name = swap.state.name;
    state.origin = {range};
    elaboration.problem.states.push_back(std::move(state));
  }
  if (!elaboration.problem.states.empty()) return;
  elaboration.sink.report("no-state", elaboration.blocks.program->name.range, {elaboration.blocks.program->name.name},
                          "write swap u, v where v is the next u");
}

/// A field that is read before any kernel writes it is an input.
void declare_input(Elaboration& elaboration, const ast::Identifier& name, const std::set<std::string>& written) {
  if (written.contains(name.name) || elaboration.names.scope.find(name.name)) return;
  elaboration.names.scope.declare(name.name, {Role::coefficient, name.range});
  elaboration.problem.coefficients.push_back({name.name, {}});
}

void declare_kernel(Elaboration& elaboration, const ast::Kernel& kernel, std::set<std::string>& written) {
  for (const ast::KernelParameter& parameter : kernel.parameters) {
    const std::string& name = parameter.name.name;
    switch (parameter.role) {
      case ast::KernelRole::param:
        if (!written.contains(name)) declare_param(elaboration, name, parameter.name.range);
        break;
      case ast::KernelRole::sum: break;
      case ast::KernelRole::out:
      case ast::KernelRole::inout: written.insert(name); break;
      case ast::KernelRole::in: declare_input(elaboration, parameter.name, written); break;
    }
  }
}

using OfName = std::function<void(const std::string& name, SourceRange range)>;

/// Names in the value of a side or in a multiplier, except its keywords.
void for_each_name(const ast::Expr& e, const OfName& f) {
  if (is_one_of<ast::Tuple>(e->kind)) return;
  match_some(e->kind, [&](const ast::Name& n) {
    if (!is_side_word(n.name)) f(n.name, e.range());
  });
  for_each_part(e, [&](const ast::Expr& part) { for_each_name(part, f); });
}

void declare_names_of(Elaboration& elaboration, const ast::Expr& e, const std::set<std::string>& written) {
  for_each_name(e, [&](const std::string& name, SourceRange range) {
    if (!written.contains(name)) declare_param(elaboration, name, range);
  });
}

int largest_rank(const ast::Expr& e) {
  int rank = 0;
  match_some(e->kind, [&](const ast::Offsets& o) { rank = static_cast<int>(o.offsets.size()); });
  for_each_part(e, [&](const ast::Expr& part) { rank = std::max(rank, largest_rank(part)); });
  return rank;
}

/// 0 if neither the head nor an offset of the body determines it.
int rank_of(const ast::Kernel& kernel) {
  if (kernel.axes) return *kernel.axes;
  int rank = 0;
  for (const ast::Item& item : kernel.items) {
    if (const auto* let = get_if<ast::LetItem>(&item.kind)) rank = std::max(rank, largest_rank(let->value));
    if (const auto* assign = get_if<ast::AssignItem>(&item.kind)) rank = std::max(rank, largest_rank(assign->value));
    if (const auto* adjoint = get_if<ast::AdjointItem>(&item.kind)) rank = std::max(rank, largest_rank(adjoint->value));
    if (const auto* scatter = get_if<ast::ScatterItem>(&item.kind)) {
      rank = std::max({rank, largest_rank(scatter->target), largest_rank(scatter->value)});
    }
  }
  return rank;
}

std::vector<const ast::Kernel*> kernels_of(const Elaboration& elaboration, const ast::Program& program) {
  std::vector<const ast::Kernel*> kernels;
  for (const auto& [run, range] : items_of<ast::RunItem>(program.items)) {
    const auto* kernel = find_declaration<ast::Kernel>(elaboration.file, run.kernel.name);
    if (kernel) kernels.push_back(kernel);  // a missing kernel is reported by the stencil level
  }
  return kernels;
}

/// Names that the scene gives a value, that its task optimises, or that the command line sets.
std::set<std::string> names_given(const Elaboration& elaboration) {
  std::set<std::string> names;
  for (const auto& [item, range] : items_of<ast::ValueItem>(elaboration.blocks.scene->items))
    names.insert(item.name.name);
  for (const auto& [name, text] : elaboration.selection.overrides) names.insert(name);
  if (elaboration.blocks.task == nullptr) return names;
  for (const auto& [unknown, range] : items_of<ast::UnknownItem>(elaboration.blocks.task->items))
    names.insert(unknown.name.name);
  return names;
}

/// In emitted text, other programs of the file may compute the scene's initial states, coefficients, observables and
/// losses. Their inputs, if the scene gives them a value, become parameters or coefficients as for the step.
void declare_what_others_take(Elaboration& elaboration) {
  const std::set<std::string> given = names_given(elaboration);
  const auto declare_given_param = [&](const std::string& name, SourceRange range) {
    if (given.contains(name)) declare_param(elaboration, name, range);
  };
  for (const ast::Declaration& declaration : elaboration.file.declarations) {
    const auto* program = std::get_if<ast::Program>(&declaration.kind);
    if (program == nullptr || program == elaboration.blocks.program) continue;
    for (const ast::Kernel* kernel : kernels_of(elaboration, *program)) {
      for (const ast::KernelParameter& parameter : kernel->parameters) {
        if (parameter.role == ast::KernelRole::param)
          declare_given_param(parameter.name.name, parameter.name.range);
        else if (parameter.role == ast::KernelRole::in && given.contains(parameter.name.name))
          declare_input(elaboration, parameter.name, {});
      }
    }
    for (const auto& [fill, range] : items_of<ast::FillItem>(program->items)) {
      for (const ast::BoundarySide& side : fill.sides) for_each_name(side.value, declare_given_param);
    }
  }
}

void check_ranks(Elaboration& elaboration) {
  const int axes = static_cast<int>(elaboration.problem.axes.size());
  std::set<int> seen;  // position of each kernel; a kernel's copies in a repeat are checked once
  for (const ast::Kernel* kernel : kernels_of(elaboration, *elaboration.blocks.program)) {
    const int rank = rank_of(*kernel);
    if (rank == 0 || rank == axes || !seen.insert(kernel->name.range.begin).second) continue;
    const auto words = [](int count) { return fmt::format("{} {}", count, count == 1 ? "axis" : "axes"); };
    elaboration.sink.report("rank-differs", kernel->name.range, {kernel->name.name, words(rank), words(axes)});
  }
}

/// Whether the fill's condition for this axis agrees with the grid; reports otherwise.
bool agrees(Elaboration& elaboration, const ast::FillItem& fill, const ast::BoundarySide& side, const Axis& axis) {
  const auto* word = std::get_if<ast::Name>(&side.value->kind);
  const bool fill_is_periodic = word && word->name == "periodic";
  if (fill_is_periodic == (axis.topology == Topology::periodic)) return true;
  const auto name = [](bool periodic) { return std::string(periodic ? "periodic" : "bounded"); };
  elaboration.sink.report("fill-differs", side.place.range,
                          {elaboration.blocks.program->name.name, fill.field.name, name(fill_is_periodic), axis.name,
                           name(!fill_is_periodic)},
                          fill_is_periodic ? fmt::format("write periodic at the grid line of {}", axis.name)
                                           : fmt::format("leave periodic out of the grid line of {}", axis.name));
  return false;
}

bool is_for_axis(const ast::BoundarySide& side, const Axis& axis) {
  return side.place.name == "all" || side.place.name.substr(0, side.place.name.find('.')) == axis.name;
}

/// Whether a value is a field computed by the program, or the number of a pass. The model level does not represent
/// these; it keeps a program's boundaries for display only.
bool is_computed(const Elaboration& elaboration, const ast::Expr& e) {
  if (const auto* name = std::get_if<ast::Name>(&e->kind))
    return !is_side_word(name->name) && !elaboration.names.scope.find(name->name);
  if (const auto* unary = std::get_if<ast::Unary>(&e->kind)) return is_computed(elaboration, unary->operand);
  if (const auto* binary = std::get_if<ast::Binary>(&e->kind))
    return is_computed(elaboration, binary->left) || is_computed(elaboration, binary->right);
  const auto* call = std::get_if<ast::Call>(&e->kind);
  return call && std::ranges::any_of(call->arguments, [&](const ast::Argument& argument) {
           return is_computed(elaboration, argument.value);
         });
}

void bind_fill(Elaboration& elaboration, const ast::FillItem& fill, State& state) {
  std::vector<std::array<SourceRange, 2>> seen(elaboration.problem.axes.size());
  SidesOfField into{state.name, state.boundary, seen};
  for (const ast::BoundarySide& side : fill.sides) {
    bool fine = true, bounded = false;
    for (const Axis& axis : elaboration.problem.axes) {
      if (!is_for_axis(side, axis)) continue;
      fine = agrees(elaboration, fill, side, axis) && fine;
      bounded = bounded || axis.topology == Topology::bounded;
    }
    if (fine && bounded && !is_computed(elaboration, side.value)) bind_side(elaboration, side, into);
  }
}

}  // namespace

void declare_program(Elaboration& elaboration) {
  declare_states(elaboration);
  std::set<std::string> written;
  const auto reductions = items_of<ast::ReduceItem>(elaboration.blocks.program->items);
  for (const auto& [reduce, range] : reductions) written.insert(reduce.result.name);
  const auto networks = items_of<ast::ApplyItem>(elaboration.blocks.program->items);
  for (const auto& [apply, range] : networks) {
    for (const ast::Identifier& result : apply.to) written.insert(result.name);
  }
  const auto transforms = items_of<ast::TransformItem>(elaboration.blocks.program->items);
  for (const auto& [transform, range] : transforms) written.insert(transform.result.name);
  const auto solves = items_of<ast::SolveItem>(elaboration.blocks.program->items);
  for (const auto& [solve, range] : solves) {
    for (const ast::Identifier& unknown : solve.unknowns) written.insert(unknown.name);
  }
  for (const auto& [repeat, range] : items_of<ast::RepeatItem>(elaboration.blocks.program->items)) {
    for (const ast::Identifier& result : repeat.to) written.insert(result.name);
    if (repeat.counter) written.insert(repeat.counter->name);
  }
  for (const auto& [load, range] : items_of<ast::StackItem>(elaboration.blocks.program->items))
    written.insert(load.field.name);
  for (const ast::Kernel* kernel : kernels_of(elaboration, *elaboration.blocks.program))
    declare_kernel(elaboration, *kernel, written);
  for (const auto& [reduce, range] : reductions) declare_input(elaboration, reduce.field, written);
  for (const auto& [solve, range] : solves) {
    for (const ast::Identifier& right : solve.rights) declare_input(elaboration, right, written);
  }
  for (const auto& [apply, range] : networks) {
    for (const ast::Identifier& input : apply.inputs) declare_input(elaboration, input, written);
  }
  std::set<std::string> not_params = written;
  not_params.insert(std::begin(wave_names), std::end(wave_names));
  for (const auto& [transform, range] : transforms) {
    for (const ast::TransformItem::Term& term : transform.terms) {
      declare_input(elaboration, term.field, written);
      declare_names_of(elaboration, term.by, not_params);
    }
  }
  for (const auto& [fill, range] : items_of<ast::FillItem>(elaboration.blocks.program->items)) {
    for (const ast::BoundarySide& side : fill.sides) declare_names_of(elaboration, side.value, written);
  }
  declare_what_others_take(elaboration);
}

void bind_fills(Elaboration& elaboration) {
  check_ranks(elaboration);
  for (const auto& [item, range] : items_of<ast::BoundaryItem>(elaboration.blocks.scene->items)) {
    elaboration.sink.report("boundary-of-program", range, {item.field.name, elaboration.blocks.program->name.name},
                            "change the fill of the program, or leave this line out");
  }
  for (State& state : elaboration.problem.states) {
    state.boundary.resize(elaboration.problem.axes.size());
    for (const auto& [fill, range] : items_of<ast::FillItem>(elaboration.blocks.program->items)) {
      if (!fill.fold && fill.field.name == state.name) {
        bind_fill(elaboration, fill, state);
        break;  // a second fill of the same field belongs to a later step of the same boundary
      }
    }
  }
}

const ast::Loop* find_loop(const Elaboration& elaboration) {
  if (!elaboration.blocks.program) return nullptr;
  for (const ast::Declaration& declaration : elaboration.file.declarations) {
    const auto* loop = std::get_if<ast::Loop>(&declaration.kind);
    if (loop && loop->body.size() == 1 && loop->body.front().name == elaboration.blocks.program->name.name) return loop;
  }
  return nullptr;
}

}  // namespace dpde::model
