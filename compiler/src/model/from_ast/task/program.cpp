// SPDX-License-Identifier: Apache-2.0
// A hand-written program as the step of a scene. States are what it swaps; parameters and coefficients are what its
// kernels take beside them; its fills say how the boundaries are, and must agree with the grid.
#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <iterator>

#include "model/from_ast/parts.h"
#include "support/names/bound_names.h"
#include "support/match.h"
#include "support/names/wave_names.h"

namespace dpde::model {

namespace {

void declare_param(Draft& draft, const std::string& name, SourceRange range) {
  if (find_bound_name(name) || draft.scope.find(name)) return;
  draft.scope.declare(name, {Role::parameter, range});
  draft.problem.params.push_back({name});
}

void declare_states(Draft& draft) {
  for (const auto& [swap, range] : items_of<ast::SwapItem>(draft.program->items)) {
    if (draft.scope.find(swap.state.name)) continue;
    draft.scope.declare(swap.state.name, {Role::state, swap.state.range});
    State state;
    state.name = swap.state.name;
    state.origin = {range};
    draft.problem.states.push_back(std::move(state));
  }
  if (!draft.problem.states.empty()) return;
  draft.sink.report("no-state", draft.program->name.range, {draft.program->name.name},
                    "write swap u, v where v is the next u");
}

/// Fields that are read before any kernel has written them are given from outside.
void declare_input(Draft& draft, const ast::Identifier& name, const std::set<std::string>& written) {
  if (written.contains(name.name) || draft.scope.find(name.name)) return;
  draft.scope.declare(name.name, {Role::coefficient, name.range});
  draft.problem.coefficients.push_back({name.name, {}});
}

void declare_kernel(Draft& draft, const ast::Kernel& kernel, std::set<std::string>& written) {
  for (const ast::KernelParameter& parameter : kernel.parameters) {
    const std::string& name = parameter.name.name;
    switch (parameter.role) {
      case ast::KernelRole::param:
        if (!written.contains(name)) declare_param(draft, name, parameter.name.range);
        break;
      case ast::KernelRole::sum: break;
      case ast::KernelRole::out:
      case ast::KernelRole::inout: written.insert(name); break;
      case ast::KernelRole::in: declare_input(draft, parameter.name, written); break;
    }
  }
}

using OfName = std::function<void(const std::string& name, SourceRange range)>;

/// The names in a value of a side, or in a multiplier, that are no words of it.
void for_each_name(const ast::Expr& e, const OfName& f) {
  match(
      e->kind, [](const ast::Number&) {}, [](const ast::Text&) {},
      [&](const ast::Name& n) {
        if (!is_side_word(n.name)) f(n.name, e.range());
      },
      [&](const ast::Unary& u) { for_each_name(u.operand, f); },
      [&](const ast::Binary& b) {
        for_each_name(b.left, f);
        for_each_name(b.right, f);
      },
      [&](const ast::Call& c) {
        for (const ast::Argument& argument : c.arguments) for_each_name(argument.value, f);
      },
      [&](const ast::Component& c) { for_each_name(c.operand, f); }, [](const ast::Tuple&) {},
      [](const ast::Offsets&) {}, [](const ast::Error&) {});
}

void declare_names_of(Draft& draft, const ast::Expr& e, const std::set<std::string>& written) {
  for_each_name(e, [&](const std::string& name, SourceRange range) {
    if (!written.contains(name)) declare_param(draft, name, range);
  });
}

int largest_rank(const ast::Expr& e) {
  int rank = 0;
  const auto look = [&](const ast::Expr& part) { rank = std::max(rank, largest_rank(part)); };
  match(
      e->kind, [](const ast::Number&) {}, [](const ast::Text&) {}, [](const ast::Name&) {},
      [&](const ast::Unary& u) { look(u.operand); },
      [&](const ast::Binary& b) {
        look(b.left);
        look(b.right);
      },
      [&](const ast::Call& c) {
        for (const ast::Argument& argument : c.arguments) look(argument.value);
      },
      [&](const ast::Component& c) { look(c.operand); }, [](const ast::Tuple&) {},
      [&](const ast::Offsets& o) { rank = static_cast<int>(o.offsets.size()); }, [](const ast::Error&) {});
  return rank;
}

/// 0 where neither the head nor an offset of the body tells.
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

std::vector<const ast::Kernel*> kernels_of(const Draft& draft, const ast::Program& program) {
  std::vector<const ast::Kernel*> kernels;
  for (const auto& [run, range] : items_of<ast::RunItem>(program.items)) {
    const auto* kernel = find_declaration<ast::Kernel>(draft.file, run.kernel.name);
    if (kernel) kernels.push_back(kernel);  // one that is missing is reported by the stencil level
  }
  return kernels;
}

/// What the scene gives a value, its task seeks or the command sets.
std::set<std::string> names_given(const Draft& draft) {
  std::set<std::string> names;
  for (const auto& [item, range] : items_of<ast::ValueItem>(draft.scene->items)) names.insert(item.name.name);
  for (const auto& [name, text] : draft.selection.overrides) names.insert(name);
  if (draft.task == nullptr) return names;
  for (const auto& [unknown, range] : items_of<ast::UnknownItem>(draft.task->items)) names.insert(unknown.name.name);
  return names;
}

/// The other programs of the file may be those of the scene's starts, coefficients, observables and losses, in text
/// that was emitted: what they take, and the scene gives, is a parameter or coefficient as of the step.
void declare_what_others_take(Draft& draft) {
  const std::set<std::string> given = names_given(draft);
  const auto declare_given_param = [&](const std::string& name, SourceRange range) {
    if (given.contains(name)) declare_param(draft, name, range);
  };
  for (const ast::Declaration& declaration : draft.file.declarations) {
    const auto* program = std::get_if<ast::Program>(&declaration.kind);
    if (program == nullptr || program == draft.program) continue;
    for (const ast::Kernel* kernel : kernels_of(draft, *program)) {
      for (const ast::KernelParameter& parameter : kernel->parameters) {
        if (parameter.role == ast::KernelRole::param)
          declare_given_param(parameter.name.name, parameter.name.range);
        else if (parameter.role == ast::KernelRole::in && given.contains(parameter.name.name))
          declare_input(draft, parameter.name, {});
      }
    }
    for (const auto& [fill, range] : items_of<ast::FillItem>(program->items)) {
      for (const ast::BoundarySide& side : fill.sides) for_each_name(side.value, declare_given_param);
    }
  }
}

void check_ranks(Draft& draft) {
  const int axes = static_cast<int>(draft.problem.axes.size());
  std::set<int> seen;  // of a kernel and its copies in a repeat one is enough
  for (const ast::Kernel* kernel : kernels_of(draft, *draft.program)) {
    const int rank = rank_of(*kernel);
    if (rank == 0 || rank == axes || !seen.insert(kernel->name.range.begin).second) continue;
    const auto words = [](int count) { return fmt::format("{} {}", count, count == 1 ? "axis" : "axes"); };
    draft.sink.report("rank-differs", kernel->name.range, {kernel->name.name, words(rank), words(axes)});
  }
}

/// Whether what the fill says of this axis agrees with the grid; reports otherwise.
bool agrees(Draft& draft, const ast::FillItem& fill, const ast::BoundarySide& side, const Axis& axis) {
  const auto* word = std::get_if<ast::Name>(&side.value->kind);
  const bool fill_is_periodic = word && word->name == "periodic";
  if (fill_is_periodic == (axis.topology == Topology::periodic)) return true;
  const auto name = [](bool periodic) { return std::string(periodic ? "periodic" : "bounded"); };
  draft.sink.report(
      "fill-differs", side.place.range,
      {draft.program->name.name, fill.field.name, name(fill_is_periodic), axis.name, name(!fill_is_periodic)},
      fill_is_periodic ? fmt::format("write periodic at the grid line of {}", axis.name)
                       : fmt::format("leave periodic out of the grid line of {}", axis.name));
  return false;
}

bool is_for_axis(const ast::BoundarySide& side, const Axis& axis) {
  return side.place.name == "all" || side.place.name.substr(0, side.place.name.find('.')) == axis.name;
}

/// Whether a value is a field that the program computes, or the number of a pass: the model level knows no such thing,
/// and what it knows of a program's boundaries is for readers only.
bool is_computed(const Draft& draft, const ast::Expr& e) {
  if (const auto* name = std::get_if<ast::Name>(&e->kind))
    return !is_side_word(name->name) && !draft.scope.find(name->name);
  if (const auto* unary = std::get_if<ast::Unary>(&e->kind)) return is_computed(draft, unary->operand);
  if (const auto* binary = std::get_if<ast::Binary>(&e->kind))
    return is_computed(draft, binary->left) || is_computed(draft, binary->right);
  const auto* call = std::get_if<ast::Call>(&e->kind);
  return call && std::ranges::any_of(call->arguments,
                                     [&](const ast::Argument& argument) { return is_computed(draft, argument.value); });
}

void bind_fill(Draft& draft, const ast::FillItem& fill, State& state) {
  std::vector<std::array<SourceRange, 2>> seen(draft.problem.axes.size());
  SidesOfField into{state.name, state.boundary, seen};
  for (const ast::BoundarySide& side : fill.sides) {
    bool fine = true, bounded = false;
    for (const Axis& axis : draft.problem.axes) {
      if (!is_for_axis(side, axis)) continue;
      fine = agrees(draft, fill, side, axis) && fine;
      bounded = bounded || axis.topology == Topology::bounded;
    }
    if (fine && bounded && !is_computed(draft, side.value)) bind_side(draft, side, into);
  }
}

}  // namespace

void declare_program(Draft& draft) {
  declare_states(draft);
  std::set<std::string> written;
  const auto reductions = items_of<ast::ReduceItem>(draft.program->items);
  for (const auto& [reduce, range] : reductions) written.insert(reduce.result.name);
  const auto networks = items_of<ast::ApplyItem>(draft.program->items);
  for (const auto& [apply, range] : networks) {
    for (const ast::Identifier& result : apply.to) written.insert(result.name);
  }
  const auto transforms = items_of<ast::TransformItem>(draft.program->items);
  for (const auto& [transform, range] : transforms) written.insert(transform.result.name);
  const auto solves = items_of<ast::SolveItem>(draft.program->items);
  for (const auto& [solve, range] : solves) {
    for (const ast::Identifier& unknown : solve.unknowns) written.insert(unknown.name);
  }
  for (const auto& [repeat, range] : items_of<ast::RepeatItem>(draft.program->items)) {
    for (const ast::Identifier& result : repeat.to) written.insert(result.name);
    if (repeat.counter) written.insert(repeat.counter->name);
  }
  for (const auto& [load, range] : items_of<ast::StackItem>(draft.program->items)) written.insert(load.field.name);
  for (const ast::Kernel* kernel : kernels_of(draft, *draft.program)) declare_kernel(draft, *kernel, written);
  for (const auto& [reduce, range] : reductions) declare_input(draft, reduce.field, written);
  for (const auto& [solve, range] : solves) {
    for (const ast::Identifier& right : solve.rights) declare_input(draft, right, written);
  }
  for (const auto& [apply, range] : networks) {
    for (const ast::Identifier& input : apply.inputs) declare_input(draft, input, written);
  }
  std::set<std::string> not_params = written;
  not_params.insert(std::begin(wave_names), std::end(wave_names));
  for (const auto& [transform, range] : transforms) {
    for (const ast::TransformItem::Term& term : transform.terms) {
      declare_input(draft, term.field, written);
      declare_names_of(draft, term.by, not_params);
    }
  }
  for (const auto& [fill, range] : items_of<ast::FillItem>(draft.program->items)) {
    for (const ast::BoundarySide& side : fill.sides) declare_names_of(draft, side.value, written);
  }
  declare_what_others_take(draft);
}

void bind_fills(Draft& draft) {
  check_ranks(draft);
  for (const auto& [item, range] : items_of<ast::BoundaryItem>(draft.scene->items)) {
    draft.sink.report("boundary-of-program", range, {item.field.name, draft.program->name.name},
                      "change the fill of the program, or leave this line out");
  }
  for (State& state : draft.problem.states) {
    state.boundary.resize(draft.problem.axes.size());
    for (const auto& [fill, range] : items_of<ast::FillItem>(draft.program->items)) {
      if (!fill.fold && fill.field.name == state.name) {
        bind_fill(draft, fill, state);
        break;  // a second fill of the same field is the next step of the same boundary
      }
    }
  }
}

const ast::Loop* find_loop(const Draft& draft) {
  if (!draft.program) return nullptr;
  for (const ast::Declaration& declaration : draft.file.declarations) {
    const auto* loop = std::get_if<ast::Loop>(&declaration.kind);
    if (loop && loop->body.size() == 1 && loop->body.front().name == draft.program->name.name) return loop;
  }
  return nullptr;
}

}  // namespace dpde::model
