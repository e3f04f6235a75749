// SPDX-License-Identifier: Apache-2.0
// The reference semantics of stencil programs: every rule of stencil.h, point by point, slow and obvious.
// Invariant: unwritten memory is NaN, so that a read of it shows in the result.
#pragma once

#include <array>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "stencil/stencil.h"
#include "support/assert.h"

namespace dpde::stencil {

struct Grid {
  int rank = 1;
  std::array<int, max_rank> cells{1, 1, 1};  // 1 beyond rank
};

using Params = std::map<std::string, double>;

using CellIndex = std::array<int, max_rank>;
/// Calls f for every cell of the box [low, high), x fastest.
template <class F>
void for_each_cell(const CellIndex& low, const CellIndex& high, const F& f) {
  for (int k = low[2]; k < high[2]; ++k) {
    for (int j = low[1]; j < high[1]; ++j) {
      for (int i = low[0]; i < high[0]; ++i) f(CellIndex{i, j, k});
    }
  }
}

/// Weights of one network, in its order, with their tangents `rates`. Empty rates are 0. Adjoints add to `bars`, and to
/// `rate_bars`, which start at 0.
struct Weights {
  std::vector<double> values, rates, bars, rate_bars;
  /// Functions of a network of the host, as in dpde_host_network (dpde/network_abi.h); arrays as in network::Tensor.
  std::function<void(const double* inputs, const double* weights, double* outputs)> host_value;
  std::function<void(const double* inputs, const double* weights, const double* seeds, double* input_bars,
                     double* weight_bars)>
      host_vector_jacobian;
};

/// Cached pseudo-inverses of operators, for many runs of a program with the same coefficients.
class Inverses;
std::shared_ptr<Inverses> new_inverses();

/// Fields by name, each with the same halo on both sides of every axis. With precision f32 every stored value (also in
/// halos and after each in-place addition) is rounded to a float; all other arithmetic is in doubles.
class State {
 public:
  State(Grid grid, int halo, Precision real = Precision::f64) : grid_(grid), halo_(halo), real_(real) {}

  const Grid& grid() const { return grid_; }
  /// Halo width along `axis`; 0 beyond the rank.
  int halo(int axis) const { return axis < grid_.rank ? halo_ : 0; }
  Precision real() const { return real_; }
  /// The value as a cell stores it.
  double stored(double value) const { return rounded(value, real_); }
  bool has(const std::string& field) const { return fields_.contains(field); }

  /// The value of a cell; -halo <= cell < cells + halo. The writing form creates a missing field, all NaN.
  double& at(const std::string& field, std::array<int, max_rank> cell);
  double at(const std::string& field, std::array<int, max_rank> cell) const;
  double& at(const std::string& field, int i, int j = 0, int k = 0) { return at(field, std::array{i, j, k}); }
  double at(const std::string& field, int i, int j = 0, int k = 0) const { return at(field, std::array{i, j, k}); }

  /// Sets the interior (x fastest); the halo becomes NaN.
  void set(const std::string& field, const std::vector<double>& interior);
  std::vector<double> get(const std::string& field) const;

  /// All cells of a field, halo included; set_cells restores them.
  const std::vector<double>& cells(const std::string& field) const { return fields_.at(field); }
  const std::vector<double>* find_cells(const std::string& field) const;
  /// Index of a cell in cells().
  std::size_t index(const std::array<int, max_rank>& cell) const {
    std::size_t index = 0;
    for (int axis = max_rank - 1; axis >= 0; --axis) {
      const int width = grid_.cells[axis] + 2 * halo(axis);
      const int place = cell[axis] + halo(axis);
      require(place >= 0 && place < width, "a cell inside the halo");
      index = index * static_cast<std::size_t>(width) + static_cast<std::size_t>(place);
    }
    return index;
  }
  void set_cells(const std::string& field, std::vector<double> cells) { fields_[field] = std::move(cells); }
  /// Creates the field as at() does.
  std::vector<double>& cells_to_write(const std::string& field);

  /// Makes every cell NaN.
  void poison(const std::string& field);
  /// Sets field x, y or z to the coordinates of the cell centres, low + (i + 1/2)*spacing, halo included.
  void set_coordinate(int axis, Topology topology, double low, double spacing);

  /// By the name of the network.
  std::map<std::string, Weights> weights;
  /// Cache of the pseudo-inverses; null: each solve computes its own.
  std::shared_ptr<Inverses> inverses;

 private:
  std::size_t cell_count() const;  // of the interior

  Grid grid_;
  int halo_;
  Precision real_;
  std::unordered_map<std::string, std::vector<double>> fields_;  // hashed: looked up for each read
};

/// Value of an expression of params and numbers.
double uniform_value(const Expr& e, const State& state, const Params& params);

/// Runs a kernel at all points of its region, `grow` cells farther beyond bounded axes, and adds to `sums`.
void apply(State& state, const Kernel& kernel, int grow, const std::vector<Topology>& axes, const Params& params,
           std::map<std::string, double>& sums);

/// Fills the whole halo of a field.
void apply(State& state, const Fill& fill, const Params& params);
/// Adds `grow` halo cells of a field on each side of bounded axes onto its interior, and clears them.
void apply(State& state, const Fold& fold, const Params& params);

/// Sets the interior of the result.
void apply(State& state, const Reduce& reduce);

/// Sets the interior of the results. The network is evaluated in doubles, whatever its precision.
void apply(State& state, const NetworkCall& network_call, const network::Network& network);

/// Sets the interior of the result.
void apply(State& state, const Transform& transform, const Params& params);

/// Applies an operator to the concatenated interior values of its unknowns; returns those of its images.
using Image = std::function<std::vector<double>(const std::vector<double>&)>;
/// All data that determine an operator.
struct OperatorParts {
  Solve solve;
  std::map<std::string, std::vector<double>> coefficients;
  Params params;
  bool operator==(const OperatorParts&) const = default;
};
/// Minimum-norm least-squares solution (2-norm). For a nonlinear operator, Newton's method starts from the right sides,
/// with a Jacobian of difference quotients; NaNs if it fails. `state` has the precision to which images are rounded.
std::vector<double> solution(const OperatorParts& parts, const Image& image, const State& state);
/// The concatenated interiors of fields.
std::vector<double> values_of_all(const State& state, const std::vector<std::string>& fields);
void set_all(State& state, const std::vector<std::string>& fields, const std::vector<double>& values);

/// Runs `program` once and applies its swaps, after which the memory of each `next` is NaN. Fields not present are
/// created. Returns the sums. `params` holds every parameter the program reads; the halo of `state` is required_halo or
/// wider.
std::map<std::string, double> interpret(const Module& module, const Program& program, State& state,
                                        const Params& params);

}  // namespace dpde::stencil
