// SPDX-License-Identifier: Apache-2.0
#include "random/shrink.h"

#include <algorithm>
#include <chrono>
#include <set>

#include "random/random_expression.h"
#include "stencil/analyse/effects.h"
#include "stencil/analyse/verify_stencil.h"
#include "stencil/build.h"
#include "stencil/text/print_stencil.h"

namespace dpde::testing {

using namespace stencil;

namespace {

/// Takes a candidate; true ends the round.
using Try = std::function<bool(RandomProgram)>;

Program& program_of(RandomProgram& p) { return p.module.programs.front(); }

/// `e` with the node of that number (parents first) replaced by `f` of it.
Expr replaced(const Expr& e, int& number, const std::function<Expr(const Expr&)>& f) {
  if (number-- == 0) return f(e);
  if (number < 0) return e;
  return map_children(e, [&](const Expr& child) { return number < 0 ? child : replaced(child, number, f); });
}

/// Every place of a kernel that holds an expression.
std::vector<Expr*> expressions_of(Kernel& kernel) {
  std::vector<Expr*> result;
  for (Store& store : kernel.stores) result.push_back(&store.value);
  for (Sum& sum : kernel.sums) result.push_back(&sum.value);
  for (Scatter& scatter : kernel.scatters) {
    result.push_back(&scatter.value);
    for (Expr& d : scatter.target.displacement) result.push_back(&d);
  }
  for (Let& let : kernel.lets) result.push_back(&let.value);
  return result;
}

/// Replacements of a node: its children, a number, the same read with a smaller offset.
std::vector<Expr> simpler(const Expr& e, const Kernel& kernel) {
  std::vector<Expr> result;
  if (!is<Literal>(e)) result.push_back(1.0);
  for_each_child(e, [&](const Expr& child) { result.push_back(child); });
  if (const Access* a = as<Access>(e)) {
    if (a->offset != Offset{}) result.push_back(access(a->field));
    for (int axis = 0; axis < max_rank; ++axis) {
      Offset closer = a->offset;
      if (closer[axis] != 0) closer[axis] -= closer[axis] > 0 ? 1 : -1;
      if (closer != a->offset) result.push_back(access(a->field, closer));
    }
  }
  if (const Interp* i = as<Interp>(e)) {
    result.push_back(access(i->field));
    Interp plain = *i;
    plain.offset = {};
    plain.along = {};
    if (!(plain == *i)) result.push_back(interp(plain));
  }
  if (const Local* l = as<Local>(e)) {
    for (const Let& let : kernel.lets) {
      if (let.name == l->name) result.push_back(let.value);
    }
  }
  return result;
}

template <class T, class F>
bool without_each(const std::vector<T>& list, const F& try_without) {
  for (std::size_t i = list.size(); i-- > 0;) {
    std::vector<T> shorter = list;
    shorter.erase(shorter.begin() + static_cast<std::ptrdiff_t>(i));
    if (try_without(std::move(shorter))) return true;
  }
  return false;
}

/// One pass in place of a repeat.
bool write_out(const RandomProgram& p, const Try& accept) {
  RandomProgram candidate = p;
  Program& program = program_of(candidate);
  const Repeat* repeat = program.body.size() == 1 ? std::get_if<Repeat>(&program.body[0]) : nullptr;
  if (repeat == nullptr || !repeat->counter.name.empty()) return false;
  for (Swap& swap : program.swaps) {
    const auto carry = std::ranges::find(repeat->carries, swap.next, &LoopCarried::result);
    if (carry != repeat->carries.end()) swap.next = carry->next;
  }
  program.body = std::vector(repeat->body);
  return accept(std::move(candidate));
}

/// Passes without numbers: the first one's in all.
bool drop_counter(const RandomProgram& p, const Try& accept) {
  RandomProgram candidate = p;
  std::vector<Statement>& body = program_of(candidate).body;
  Repeat* repeat = body.size() == 1 ? std::get_if<Repeat>(&body[0]) : nullptr;
  if (repeat == nullptr || repeat->counter.name.empty()) return false;
  const std::map<std::string, Expr> number{{repeat->counter.name, 0.0}};
  const auto first = [&](const Expr& e) { return substitute_params(e, number); };
  for (Kernel& kernel : candidate.module.kernels) kernel = map_expressions(kernel, first);
  for (Statement& statement : repeat->body) {
    if (Fill* fill = std::get_if<Fill>(&statement)) fill->axes = map_sides(fill->axes, first);
  }
  repeat->counter = {};
  return accept(std::move(candidate));
}

/// Statements of the block that the program repeats.
bool drop_inner_statements(const RandomProgram& p, const Try& accept) {
  const std::vector<Statement>& body = p.module.programs.front().body;
  const Repeat* repeat = body.size() == 1 ? std::get_if<Repeat>(&body[0]) : nullptr;
  return repeat != nullptr && without_each(repeat->body, [&](std::vector<Statement> shorter) {
           RandomProgram candidate = p;
           std::get<Repeat>(program_of(candidate).body[0]).body = std::move(shorter);
           return accept(std::move(candidate));
         });
}

bool drop_statements(const RandomProgram& p, const Try& accept) {
  const Program& program = p.module.programs.front();
  const auto with = [&](auto Program::*part) {
    return [&p, &accept, part](auto shorter) {
      RandomProgram candidate = p;
      program_of(candidate).*part = std::move(shorter);
      return accept(std::move(candidate));
    };
  };
  return without_each(program.body, with(&Program::body)) || without_each(program.swaps, with(&Program::swaps)) ||
         without_each(program.keeps, with(&Program::keeps));
}

bool drop_parts_of_kernels(const RandomProgram& p, const Try& accept) {
  for (std::size_t k = 0; k < p.module.kernels.size(); ++k) {
    const auto with = [&](auto Kernel::*part) {
      return [&p, &accept, k, part](auto shorter) {
        RandomProgram candidate = p;
        candidate.module.kernels[k].*part = std::move(shorter);
        return accept(std::move(candidate));
      };
    };
    const Kernel& kernel = p.module.kernels[k];
    if (without_each(kernel.stores, with(&Kernel::stores)) || without_each(kernel.sums, with(&Kernel::sums)) ||
        without_each(kernel.scatters, with(&Kernel::scatters)) || without_each(kernel.lets, with(&Kernel::lets)) ||
        without_each(kernel.custom_adjoints, with(&Kernel::custom_adjoints))) {
      return true;
    }
  }
  return false;
}

bool drop_activity(const RandomProgram& p, const Try& accept) {
  for (auto part : {&adjoint::Activity::fields, &adjoint::Activity::params}) {
    for (const std::string& name : p.wrt.*part) {
      RandomProgram candidate = p;
      (candidate.wrt.*part).erase(name);
      if (accept(std::move(candidate))) return true;
    }
  }
  return false;
}

bool shrink_grid(const RandomProgram& p, const Try& accept) {
  for (int axis = 0; axis < p.grid.rank; ++axis) {
    for (const int cells : {1, 2, p.grid.cells[axis] - 1}) {
      if (cells < 1 || cells >= p.grid.cells[axis]) continue;
      RandomProgram candidate = p;
      candidate.grid.cells[axis] = cells;
      if (accept(std::move(candidate))) return true;
    }
  }
  return false;
}

Expr without_axis(const Expr& e, int axis) {
  const Expr inner = map_children(e, [&](const Expr& child) { return without_axis(child, axis); });
  if (const Access* a = as<Access>(inner)) {
    if (a->field == std::string(1, "xyz"[axis])) return 1.0;
    Offset offset = a->offset;
    offset[axis] = 0;
    return access(a->field, offset);
  }
  if (const Inside* i = as<Inside>(inner)) {
    Offset offset = i->offset;
    offset[axis] = 0;
    return inside(offset, i->grow);
  }
  if (const Interp* i = as<Interp>(inner)) {
    Interp lower = *i;
    lower.offset[axis] = 0;
    lower.along[axis] = InterpolationBasis::linear;
    lower.displacement.pop_back();
    return interp(lower);
  }
  return inner;
}

/// Removes the last axis.
bool lower_rank(const RandomProgram& p, const Try& accept) {
  if (p.grid.rank == 1) return false;
  RandomProgram candidate = p;
  const int axis = --candidate.grid.rank;
  candidate.grid.cells[axis] = 1;
  for (Kernel& kernel : candidate.module.kernels) {
    --kernel.rank;
    kernel = map_expressions(kernel, [&](const Expr& e) { return without_axis(e, axis); });
    for (Scatter& scatter : kernel.scatters) {
      scatter.target.offset[axis] = 0;
      scatter.target.displacement.resize(static_cast<std::size_t>(axis), Expr(0.0));
    }
  }
  const std::vector<Statement>& body = program_of(candidate).body;
  if (body.size() == 1 && std::holds_alternative<Repeat>(body[0])) return false;  // one pass has less to change
  program_of(candidate).axes.pop_back();
  for (Statement& statement : program_of(candidate).body) {
    if (Fill* fill = std::get_if<Fill>(&statement)) fill->axes.pop_back();
    if (Fold* fold = std::get_if<Fold>(&statement)) fold->axes.pop_back();
    if (Reduce* reduce = std::get_if<Reduce>(&statement)) reduce->over[static_cast<std::size_t>(axis)] = false;
  }
  return accept(std::move(candidate));
}

bool simplify_sides(const RandomProgram& p, const Try& accept) {
  for (std::size_t s = 0; s < p.module.programs.front().body.size(); ++s) {
    for (int axis = 0; axis < p.grid.rank; ++axis) {
      for (Side AxisBoundary::*side : {&AxisBoundary::low, &AxisBoundary::high}) {
        for (const Side& simple : {Side{SideKind::zero_gradient}, Side{SideKind::value}}) {
          RandomProgram candidate = p;
          Statement& statement = program_of(candidate).body[s];
          Fill* fill = std::get_if<Fill>(&statement);
          Fold* fold = std::get_if<Fold>(&statement);
          if (!fill && !fold) continue;
          AxisBoundary& boundary = fill ? fill->axes[axis] : fold->axes[axis];
          const bool is_simple = boundary.*side == simple || (boundary.*side).kind == SideKind::zero_gradient;
          if (is_simple || boundary.topology == Topology::periodic) continue;
          boundary.*side = simple;
          if (accept(std::move(candidate))) return true;
        }
      }
    }
  }
  return false;
}

bool lower_growth(const RandomProgram& p, const Try& accept) {
  for (std::size_t s = 0; s < p.module.programs.front().body.size(); ++s) {
    RandomProgram candidate = p;
    Statement& statement = program_of(candidate).body[s];
    Run* run = std::get_if<Run>(&statement);
    Fold* fold = std::get_if<Fold>(&statement);
    int* grow = run ? &run->grow : fold ? &fold->grow : nullptr;
    if (!grow || *grow == 0) continue;
    --*grow;
    if (accept(std::move(candidate))) return true;
  }
  return false;
}

bool simplify_expressions(const RandomProgram& p, const Try& accept) {
  for (std::size_t k = 0; k < p.module.kernels.size(); ++k) {
    Kernel original = p.module.kernels[k];
    const std::vector<Expr*> places = expressions_of(original);
    for (std::size_t place = 0; place < places.size(); ++place) {
      for (int node = 0; node < node_count(*places[place]); ++node) {
        std::vector<Expr> options;
        int number = node;
        replaced(*places[place], number, [&](const Expr& e) { return options = simpler(e, original), e; });
        for (const Expr& option : options) {
          RandomProgram candidate = p;
          Expr& target = *expressions_of(candidate.module.kernels[k])[place];
          number = node;
          target = replaced(target, number, [&](const Expr&) { return option; });
          if (!(candidate.module == p.module) && accept(std::move(candidate))) return true;
        }
      }
    }
  }
  return false;
}

/// Removes kernels that are not run or have no effect.
void tidy(RandomProgram& p) {
  std::vector<Statement>& body = program_of(p).body;
  std::erase_if(body, [&](const Statement& statement) {
    const Run* run = std::get_if<Run>(&statement);
    const Kernel* kernel = run ? p.module.find_kernel(run->kernel) : nullptr;
    return run && (!kernel || (kernel->stores.empty() && kernel->sums.empty() && kernel->scatters.empty()));
  });
  const std::set<std::string> run = parts_of({program_of(p)}).kernels;
  std::erase_if(p.module.kernels, [&](const Kernel& kernel) { return !run.contains(kernel.name); });
}

bool has_result(const RandomProgram& p) {
  const Program& program = p.module.programs.front();
  return !program.swaps.empty() || !program.keeps.empty() || !interface_of(p.module, program).sums.empty();
}

}  // namespace

RandomProgram shrink(RandomProgram program, const std::function<bool(const RandomProgram&)>& fails, int most,
                     double seconds) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
  std::set<std::string> seen;
  const Try accept = [&](RandomProgram candidate) {
    tidy(candidate);
    if (std::chrono::steady_clock::now() > end) most = 0;
    if (most <= 0 || !seen.insert(describe(candidate)).second) return false;
    if (!has_result(candidate) || !verify(candidate.module).empty()) return false;
    --most;
    if (!fails(candidate)) return false;
    program = std::move(candidate);
    return true;
  };
  const auto round = [&] {
    const RandomProgram now = program;
    return drop_counter(now, accept) || write_out(now, accept) || drop_inner_statements(now, accept) ||
           drop_statements(now, accept) || drop_parts_of_kernels(now, accept) || lower_rank(now, accept) ||
           shrink_grid(now, accept) || simplify_expressions(now, accept) || simplify_sides(now, accept) ||
           lower_growth(now, accept) || drop_activity(now, accept);
  };
  while (most > 0 && round()) {
  }
  return program;
}

}  // namespace dpde::testing
