// SPDX-License-Identifier: Apache-2.0
// Solves of programs: the operator with homogeneous boundary conditions as a block, and the contribution of boundary
// values to the right side.
#include <algorithm>
#include <utility>

#include "stencil/build.h"
#include "stencil/lower/iterations.h"
#include "stencil/lower/lowering.h"
#include "stencil/lower/walls.h"
#include "stencil/passes/place_fills.h"

namespace dpde::stencil {

namespace {

/// The state with homogeneous conditions, as satisfied by the difference of two fields with its boundary.
model::State homogeneous(model::State state) {
  for (model::AxisSides& sides : state.boundary) sides.low.value = sides.high.value = 0.0;
  return state;
}

bool has_values(const std::vector<AxisBoundary>& axes) {
  bool found = false;
  for_each_side(axes, [&](const Side& side) { found = found || !is_literal(side.value, 0); });
  return found;
}

}  // namespace

/// Moves the contribution of boundary values to the right side: the operator applied to a field that is 0 inside and
/// filled with these values.
void Lowering::add_walls_of(PreparedSolve& solve, const std::vector<AxisBoundary>& boundary,
                            const StateHalos& state_halos, Module& module, Program& program) const {
  const auto add = [&](Kernel made) { program.body.push_back(Run{add_kernel(module, std::move(made))}); };
  Kernel zero = kernel(solve.kernel.name + "_rest");
  zero.stores.push_back({solve.at_rest, false, 0.0, {}});
  add(std::move(zero));
  program.halos.push_back(rule_of_fill({solve.at_rest, boundary}));
  std::vector<Signature::Read> reads = signature(solve.kernel).reads;
  std::erase_if(reads, [&](const Signature::Read& read) { return read.field == solve.unknown; });
  state_halos(reads);
  Kernel walls = map_expressions(solve.kernel, [&](const Expr& e) {
    return rename_fields(e, [&](const std::string& field) { return field == solve.unknown ? solve.at_rest : field; });
  });
  walls.name += "_walls";
  walls.stores.front().field = solve.of_walls;
  add(std::move(walls));
  Kernel total = kernel(solve.kernel.name + "_right");
  total.stores.push_back({solve.total, false, access(solve.right) - access(solve.of_walls), {}});
  add(std::move(total));
  solve.right = solve.total;
}

/// Values on a high wall are not unknowns, except at an open end: their matrix row is that of the identity, and the
/// other rows use the boundary's value there. Returns the field that the operator reads instead of the unknown.
std::string Lowering::keep_wall_values(PreparedSolve& solve, Module& module, Program& block) const {
  const std::vector<Offset> beyond_walls = known_on_walls(solve.state, problem_);
  if (beyond_walls.empty()) return solve.unknown;
  solve.kernel = map_expressions(solve.kernel, [&](const Expr& e) {
    return rename_fields(
        e, [&](const std::string& field) { return field == solve.unknown ? solve.between_walls : field; });
  });
  Expr& image = solve.kernel.stores.front().value;
  for (const Offset& next : beyond_walls) image = select(inside(next, 0), image, access(solve.unknown));
  Kernel copy = kernel(solve.kernel.name + "_between");
  copy.stores.push_back({solve.between_walls, false, access(solve.unknown), {}});
  block.body.push_back(Run{add_kernel(module, std::move(copy))});
  return solve.between_walls;
}

void Lowering::add_solve(PreparedSolve solve, const Expr& time, const StateHalos& state_halos, Walls& walls,
                         Module& module, Program& program) const {
  const std::vector<AxisBoundary> boundary = walls.boundary(solve.state, time, module, program);
  if (has_values(boundary)) add_walls_of(solve, boundary, state_halos, module, program);
  Program block{program.name, program.axes, {}, {}, {}};
  Walls::Stored outer = walls.forget();
  const std::string inner = keep_wall_values(solve, module, block);
  for (const Signature::Read& read : signature(solve.kernel).reads) {
    if (!needs_fill(read)) continue;
    const model::State* state = state_beyond_walls(read.field);
    const model::State of_difference = homogeneous(solve.state);
    if (read.field == inner) state = &of_difference;
    std::vector<AxisBoundary> beyond = state ? walls.boundary(*state, time, module, block) : boundary_of(read.field);
    if (!has_rule(block.halos, read.field)) block.halos.push_back(rule_for(read.field, std::move(beyond), false));
  }
  walls.remember(std::move(outer));
  const Written written{solve.state.name, solve.kernel.stores.front().origin.range};
  const std::string name = solve.kernel.name;
  block.body.push_back(Run{add_kernel(module, std::move(solve.kernel))});
  Solve made{{solve.image}, {solve.right}, {solve.unknown}, std::move(block.body), solve.by, written};
  made.halos = std::move(block.halos);
  made.preconditioner = solve.preconditioner;
  if (solve.iterations)
    return add_iterations(made, *solve.iterations, solve.starts.empty() ? "" : solve.starts.front(),
                          problem_.scheme.real, name, module, program);
  for (const std::string& guess : solve.guesses) {
    if (state_of_.contains(guess)) made.guesses.push_back(guess);  // some problems are lowered without their guesses
  }
  made.guesses.insert(made.guesses.end(), solve.starts.begin(), solve.starts.end());
  program.body.push_back(std::move(made));
}

}  // namespace dpde::stencil
