// SPDX-License-Identifier: Apache-2.0
// Statements in sequence. Kernels: interpret_kernel.cpp.
#include "stencil/interpret/interpret.h"

#include <algorithm>

#include "stencil/analyse/effects.h"
#include "stencil/build.h"
#include "support/assert.h"
#include "support/contains.h"
#include "support/match.h"

namespace dpde::stencil {

namespace {

int modulo(int i, int n) { return (i % n + n) % n; }

// ---- halos ---------------------------------------------------------------------------------------------------------

/// A halo cell, its mirror cell and the cell after it, and their weights; `side` is nullptr along periodic axes.
struct HaloCell {
  CellIndex place, mirror, second;
  const Side* side;
  GhostWeights ghost;
};

/// Layer k of a side of an axis with n cells: its position, its mirror cell's position, and the weights of its rule.
struct Layer {
  int place, mirror;
  GhostWeights ghost{1, 0, 0};
};

Layer bounded_layer(const Side& side, bool low_side, int k, int n, double h, const State& state, const Params& params) {
  const GhostRule& rule = rule_of(side);
  const int on_wall = rule.on_walls ? 1 : 0;
  const GhostRow& row = (on_wall == 1 && k == 0 ? rule.wall : rule.beyond).on(n);
  std::array<double, side_coefficients> coefficients{};
  std::ranges::transform(coefficients_of(side), coefficients.begin(), [&](const SideCoefficient& c) {
    const double value = uniform_value(c.value, state, params);
    return c.per_spacing ? value / h : value;
  });
  const auto cell = [&](int inside) { return low_side ? inside : n - 1 - on_wall - inside; };
  return {cell(-1 - k), cell(row.first + row.step * k), weights_of(row, coefficients, 2 * k + 1 - on_wall)};
}

/// The halo cells in layer k on both sides of an axis, including the halo of the axes before.
std::vector<HaloCell> layer_of_halo(const State& state, const AxisBoundary& boundary, int axis, int k,
                                    const CellIndex& width, const Params& params) {
  const int n = state.grid().cells[axis];
  const bool periodic = boundary.topology == Topology::periodic;
  const bool is_wall = is_on_walls(boundary) && k == 0;
  const auto spacing = params.find(std::string("h") + "xyz"[axis]);
  const double h = spacing == params.end() ? 0 : spacing->second;
  std::vector<HaloCell> cells;
  for (const bool first : {true, false}) {
    const bool low_side = first != is_wall;
    if (k == width[axis] && low_side) continue;
    const Side& side = low_side ? boundary.low : boundary.high;
    if (is_wall && (condition_of(side.kind).keeps_wall() || (!low_side && n == 1 && derives_wall(side, n)))) continue;
    const int around = low_side ? -1 - k : n + k;
    const Layer layer =
        periodic ? Layer{around, modulo(around, n)} : bounded_layer(side, low_side, k, n, h, state, params);
    CellIndex low{}, high = state.grid().cells;
    for (int before = 0; before < axis; ++before) {
      low[before] -= width[before];
      high[before] += width[before];
    }
    low[axis] = layer.place;
    high[axis] = layer.place + 1;
    for_each_cell(low, high, [&](const CellIndex& cell) {
      cells.push_back({cell, cell, cell, periodic ? nullptr : &side, layer.ghost});
      cells.back().mirror[axis] = layer.mirror;
      cells.back().second[axis] = layer.mirror + (low_side ? 1 : -1);
      if (periodic || !rule_of(side).turns) return;
      const int around_pole = axis == 0 ? 1 : 0, turn = state.grid().cells[around_pole] / 2;
      for (CellIndex* turned : {&cells.back().mirror, &cells.back().second})
        (*turned)[around_pole] = modulo(cell[around_pole] + turn, state.grid().cells[around_pole]);
    });
  }
  return cells;
}

double wall_value(const HaloCell& cell, const std::vector<AxisBoundary>& axes, const State& state,
                  const Params& params) {
  if (!cell.side) return 0;
  CellIndex place = cell.place;
  for (std::size_t axis = 0; axis < axes.size(); ++axis) {
    if (axes[axis].topology == Topology::periodic) place[axis] = modulo(place[axis], state.grid().cells[axis]);
  }
  if (const std::string* field = wall_field(*cell.side)) return state.at(*field, place);
  return uniform_value(cell.side->value, state, params);
}

}  // namespace

void apply(State& state, const Fill& fill, const Params& params) {
  const CellIndex width{state.halo(0), state.halo(1), state.halo(2)};
  for (int axis = 0; axis < state.grid().rank; ++axis) {
    const int layers = width[axis] + (is_on_walls(fill.axes[axis]) ? 1 : 0);
    for (int k = 0; k < layers; ++k) {
      for (const HaloCell& cell : layer_of_halo(state, fill.axes[axis], axis, k, width, params)) {
        const double constant = cell.ghost.rate * wall_value(cell, fill.axes, state, params);
        double inner = cell.ghost.weight == 0 ? 0 : cell.ghost.weight * state.at(fill.field, cell.mirror);
        if (cell.ghost.second_weight != 0) inner += cell.ghost.second_weight * state.at(fill.field, cell.second);
        state.at(fill.field, cell.place) = state.stored(inner + constant);
      }
    }
  }
}

void apply(State& state, const Fold& fold, const Params& params) {
  CellIndex width{};
  for (int axis = 0; axis < state.grid().rank; ++axis) {
    if (fold.axes[axis].topology == Topology::bounded) width[axis] = fold.grow;
  }
  for (int axis = state.grid().rank - 1; axis >= 0; --axis) {
    const int layers = width[axis] + (is_on_walls(fold.axes[axis]) ? 1 : 0);
    for (int k = layers - 1; k >= 0; --k) {
      std::vector<HaloCell> cells = layer_of_halo(state, fold.axes[axis], axis, k, width, params);
      std::reverse(cells.begin(), cells.end());
      for (const HaloCell& cell : cells) {
        const double value = state.at(fold.field, cell.place);
        if (const std::string* field = wall_field(*cell.side)) {
          double& wall = state.at(*field, cell.place);
          wall = state.stored(wall + cell.ghost.rate * value);
        }
        if (cell.ghost.second_weight != 0) {
          double& second = state.at(fold.field, cell.second);
          second = state.stored(second + cell.ghost.second_weight * value);
        }
        if (cell.ghost.weight != 0) {
          double& mirror = state.at(fold.field, cell.mirror);
          mirror = state.stored(mirror + cell.ghost.weight * value);
        }
        state.at(fold.field, cell.place) = 0;
      }
    }
  }
}

namespace {

/// One run of a program.
class Interpreter {
 public:
  Interpreter(const Module& module, State& state, const Params& params)
      : module_(module), state_(state), params_(params) {}

  void run(const Program& program) {
    for (const Statement& statement : program.body) {
      match(
          statement, [&](const Fill& fill) { apply(state_, fill, params_); },
          [&](const Fold& fold) { apply(state_, fold, params_); }, [&](const Reduce& reduce) { apply(state_, reduce); },
          [&](const NetworkCall& network_call) {
            apply(state_, network_call, *module_.find_network(network_call.network));
          },
          [&](const Transform& transform) { apply(state_, transform, params_); },
          [&](const Run& run) {
            apply(state_, *module_.find_kernel(run.kernel), run.grow, program.axes, params_, sums);
          },
          [&](const Solve& solve) { this->solve(solve, program); },
          [&](const Repeat& repeat) { this->repeat(repeat, program); });
    }
  }

  std::map<std::string, double> sums;

 private:
  using Values = std::map<std::string, std::vector<double>>;

  Values values_of(const auto& names) const {
    Values values;
    for (const std::string& name : names) {
      if (!is_coordinate(name)) values[name] = state_.get(name);
    }
    return values;
  }
  /// Cells, with halos, of the outside fields that a block reads and whose halos it does not invalidate. Unwritten
  /// fields are undefined before and after the block.
  Values cells_kept_by(const Effects& block) const {
    Values cells;
    for (const std::string& field : block.reads) {
      const std::vector<double>* known = state_.find_cells(field);
      if (known != nullptr && !is_coordinate(field) && !contains(block.invalidates_halo, field) &&
          !contains(block.block_locals, field))
        cells[field] = *known;
    }
    return cells;
  }
  /// Sets interiors; halos become NaN.
  void set(const Values& all) {
    for (const auto& [field, values] : all) state_.set(field, values);
  }

  void solve(const Solve& solve, const Program& program) {
    const Program block = operator_of(solve, program);
    const Effects known = effects(module_, solve);
    const Values seen = values_of(coefficients_of(module_, solve)), whole = cells_kept_by(known);
    const Image image = [&](const std::vector<double>& x) {
      set(seen);
      set_all(state_, solve.unknowns, x);
      run(block);
      return values_of_all(state_, solve.images);
    };
    std::vector<double> x = solution({solve, seen, params_}, image, state_);
    for (double& value : x) value = state_.stored(value);
    for (const std::string& field : known.block_locals) state_.poison(field);
    set(seen);
    for (const auto& [field, cells] : whole) state_.set_cells(field, cells);
    set_all(state_, solve.unknowns, x);
  }

  void repeat(const Repeat& repeat, const Program& program) {
    const Program pass = pass_of(repeat, program);
    const Effects known = effects(module_, repeat);
    Values outside, whole = cells_kept_by(known);
    for (const LoopCarried& carry : repeat.carries) whole.erase(carry.result);
    for (const TapeEntry& load : repeat.loads) {
      outside[load.field] = state_.get(load.field);
      if (state_.has(load.field)) whole[load.field] = state_.cells(load.field);
    }
    for (int k = 0; k < repeat.count; ++k) {
      params_[repeat.counter.name] = repeat.counter.is_backwards ? repeat.count - 1 - k : k;
      for (const TapeEntry& load : repeat.loads) {
        state_.set(load.field, stacks_[load.stack].back());
        stacks_[load.stack].pop_back();
      }
      const auto save_where = [&](bool is_own) {
        for (const TapeEntry& save : repeat.saves) {
          const bool is_written = contains(known.block_locals, save.field) && !outside.contains(save.field);
          if (is_written == is_own) stacks_[save.stack].push_back(state_.get(save.field));
        }
      };
      save_where(false);
      set(values_of(known.reads));
      run(pass);
      save_where(true);
      Values next;
      for (const LoopCarried& carry : repeat.carries) {
        if (k == 0) outside[carry.state] = state_.get(carry.state);
        next[k + 1 == repeat.count ? carry.result : carry.state] = state_.get(carry.next);
      }
      set(next);
      for (const std::string& field : known.block_locals) {
        if (!outside.contains(field)) state_.poison(field);
      }
    }
    set(values_of(known.invalidates_halo));
    set(outside);
    for (const auto& [field, cells] : whole) state_.set_cells(field, cells);
  }

  const Module& module_;
  State& state_;
  Params params_;
  std::map<std::string, std::vector<std::vector<double>>> stacks_;
};

}  // namespace

std::map<std::string, double> interpret(const Module& module, const Program& program, State& state,
                                        const Params& params) {
  require(static_cast<int>(program.axes.size()) == state.grid().rank, "one topology an axis");
  Interpreter interpreter(module, state, params);
  for (const Kernel* kernel : kernels_run(module, program))
    for (const Sum& sum : kernel->sums) interpreter.sums[sum.name] = 0;
  interpreter.run(program);
  std::vector<std::vector<double>> next;
  for (const Swap& swap : program.swaps) next.push_back(state.cells_to_write(swap.next));
  for (const Swap& swap : program.swaps) state.poison(swap.next);
  for (std::size_t i = 0; i < next.size(); ++i) state.set_cells(program.swaps[i].state, std::move(next[i]));
  return std::move(interpreter.sums);
}

}  // namespace dpde::stencil
