// SPDX-License-Identifier: Apache-2.0
#include "stencil/analyse/effects.h"

#include <algorithm>

#include "stencil/analyse/symbol.h"
#include "stencil/build.h"
#include "stencil/walk.h"
#include "support/assert.h"

namespace dpde::stencil {

namespace {

using NameList = std::vector<std::string>;

void add_new(NameList& names, const std::string& name) {
  if (std::ranges::find(names, name) == names.end()) names.push_back(name);
}

NameList params_of(const std::vector<AxisBoundary>& axes) {
  NameList params;
  for_each_side_value(axes, [&](const Expr& value) {
    visit(value, [&](const Expr& e) {
      if (const Param* p = as<Param>(e)) add_new(params, p->name);
    });
  });
  return params;
}

Effects of_fill(const Fill& fill) {
  Effects e{.reads = {fill.field}, .fills = {fill.field}, .params = params_of(fill.axes)};
  for (const std::string& wall : wall_fields(fill.axes)) add_new(e.reads, wall);
  return e;
}

/// A fold adds the halo to the interior and to the fields of boundary values.
Effects of_fold(const Fold& fold) {
  std::set<std::string> folded = wall_fields(fold.axes);
  folded.insert(fold.field);
  const NameList names(folded.begin(), folded.end());
  return {.reads = names, .updates = names, .params = params_of(fold.axes)};
}

Effects of_transform(const Transform& transform) {
  Effects e{.writes = {transform.result}, .params = params_of(transform)};
  for (const Transform::Term& term : transform.terms) add_new(e.reads, term.field);
  const std::array<bool, max_rank> axes = axes_of(transform, 0);
  for (std::size_t axis = 0; axis < max_rank; ++axis) {
    if (axes[axis]) add_new(e.params, std::string("h").append(1, "xyz"[axis]));
  }
  return e;
}

Effects of_network_call(const NetworkCall& network_call) {
  return {
      .reads = fields_read(network_call), .writes = fields_written(network_call), .networks = {network_call.network}};
}

Effects of_run(const Kernel& kernel) {
  Signature s = signature(kernel);
  Effects e{.writes = std::move(s.writes),
            .updates = std::move(s.updates),
            .params = std::move(s.params),
            .sums = std::move(s.sums),
            .kernels = {kernel.name}};
  for (const Signature::Read& read : s.reads) e.reads.push_back(read.field);
  return e;
}

bool has(const NameList& names, const std::string& name) { return std::ranges::find(names, name) != names.end(); }

Effects of_repeat(const Module& module, const Repeat& repeat) {
  const Program pass = pass_of(repeat, {});
  const Interface known = interface_of(module, pass);
  Effects e{.params = known.params, .sums = known.sums, .networks = known.networks, .block_locals = known.written};
  std::erase(e.params, repeat.counter.name);
  for (const Kernel* kernel : kernels_run(module, pass)) e.kernels.push_back(kernel->name);
  const auto is_loaded = [&](const std::string& field) {
    return std::ranges::any_of(repeat.loads, [&](const TapeEntry& load) { return load.field == field; });
  };
  for (const std::string& field : known.inputs) {
    if (!is_loaded(field)) e.reads.push_back(field);
  }
  for (const LoopCarried& carry : repeat.carries) {
    add_new(e.reads, carry.state);
    e.writes.push_back(carry.result);
  }
  for (const TapeEntry& load : repeat.loads) add_new(e.block_locals, load.field);
  for_each_kind<Fill>(pass.body, [&](const Fill& fill) {
    if (has(e.reads, fill.field)) add_new(e.invalidates_halo, fill.field);
  });
  return e;
}

/// Adds the effects of a Newton step. It reads the fields that the block reads, the unknowns, and its own local fields.
void add_step(const Effects& step, const Solve& solve, Effects& e) {
  const auto add_inner = [&](const std::string& field) {
    const bool is_known = has(e.reads, field) || has(solve.unknowns, field);
    if (!is_known && !is_coordinate(field)) add_new(e.block_locals, field);
  };
  for (const auto* fields : {&step.block_locals, &step.writes, &step.reads}) std::ranges::for_each(*fields, add_inner);
  for (const std::string& param : step.params) add_new(e.params, param);
  for (const std::string& kernel : step.kernels) add_new(e.kernels, kernel);
  for (const std::string& field : step.invalidates_halo) {
    if (has(e.reads, field)) add_new(e.invalidates_halo, field);
  }
}

Effects of_solve(const Module& module, const Solve& solve) {
  const Program block = operator_of(solve, {});
  const Interface known = interface_of(module, block);
  Effects e{.reads = coefficients_of(module, solve),
            .writes = solve.unknowns,
            .params = known.params,
            .sums = known.sums,
            .networks = known.networks,
            .block_locals = known.written};
  if (solve.preconditioner) {
    add_new(e.networks, solve.preconditioner->network);
    e.block_locals.insert(e.block_locals.end(),
                          {solve.preconditioner->inputs.front(), solve.preconditioner->results.front()});
  }
  for (const Kernel* kernel : kernels_run(module, block)) e.kernels.push_back(kernel->name);
  for_each_kind<Fill>(block.body, [&](const Fill& fill) {
    if (has(e.reads, fill.field)) add_new(e.invalidates_halo, fill.field);
  });
  for (const std::string& right : solve.rights) add_new(e.reads, right);
  for (const std::string& guess : solve.guesses) add_new(e.reads, guess);
  for (const std::string& field : fields_beside_residual(solve)) add_new(e.reads, field);
  for (const Statement& step : solve.step) add_step(effects(module, step), solve, e);
  return e;
}

}  // namespace

Program operator_of(const Solve& solve, const Program& program) {
  return {program.name, program.axes, solve.body, {}, solve.images, solve.halos};
}

NameList coefficients_of(const Module& module, const Solve& solve) {
  NameList fields = interface_of(module, operator_of(solve, {})).inputs;
  std::erase_if(fields, [&](const std::string& field) { return has(solve.unknowns, field); });
  return fields;
}

NameList fields_beside_residual(const Solve& solve) {
  if (!solve.preconditioner) return {};
  return {solve.preconditioner->inputs.begin() + 1, solve.preconditioner->inputs.end()};
}

Program pass_of(const Repeat& repeat, const Program& program) {
  Program pass{program.name, program.axes, repeat.body, {}, {}, repeat.halos};
  for (const LoopCarried& carry : repeat.carries) pass.swaps.push_back({carry.state, carry.next});
  return pass;
}

NameList counters_of(const std::vector<Statement>& statements) {
  NameList counters;
  for_each_kind<Repeat>(statements, [&](const Repeat& repeat) {
    if (!repeat.counter.name.empty()) counters.push_back(repeat.counter.name);
  });
  return counters;
}

Effects effects(const Module& module, const Statement& statement) {
  return match(
      statement, [](const Fill& fill) { return of_fill(fill); }, [](const Fold& fold) { return of_fold(fold); },
      [](const Reduce& reduce) { return Effects{.reads = {reduce.field}, .writes = {reduce.result}}; },
      [](const NetworkCall& network_call) { return of_network_call(network_call); },
      [](const Transform& transform) { return of_transform(transform); },
      [&](const Run& run) { return of_run(kernel_of(module, run)); },
      [&](const Solve& solve) { return of_solve(module, solve); },
      [&](const Repeat& repeat) { return of_repeat(module, repeat); });
}

std::vector<const Kernel*> kernels_run(const Module& module, const Program& program) {
  std::vector<const Kernel*> kernels;
  for_each_kind<Run>(program.body, [&](const Run& run) {
    const Kernel* kernel = &kernel_of(module, run);
    if (std::ranges::find(kernels, kernel) == kernels.end()) kernels.push_back(kernel);
  });
  return kernels;
}

Parts parts_of(const std::vector<Program>& programs) {
  Parts parts;
  const auto add = [&](const Statement& statement) {
    match(
        statement, [&](const NetworkCall& call) { add_new(parts.networks, call.network); },
        [&](const Run& run) { parts.kernels.insert(run.kernel); },
        [&](const Solve& solve) {
          if (solve.preconditioner) add_new(parts.networks, solve.preconditioner->network);
        },
        ignored<Fill, Fold, Reduce, Transform, Repeat>);
  };
  for (const Program& program : programs) for_each_statement(program.body, add);
  return parts;
}

std::vector<Statement> without_fills(std::vector<Statement> statements) {
  erase_statements(statements, [](const Statement& statement) { return is_one_of<Fill>(statement); });
  return statements;
}

void forget_guesses(std::vector<Statement>& statements) {
  for_each_kind<Solve>(statements, [](Solve& solve) {
    solve.guesses.clear();
    solve.preconditioner.reset();
  });
}

}  // namespace dpde::stencil
