// SPDX-License-Identifier: Apache-2.0
#include "stencil/analyse/operator_traits.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <random>
#include <vector>

#include "stencil/analyse/effects.h"
#include "stencil/analyse/operator_reach.h"
#include "stencil/build.h"
#include "stencil/passes/place_fills.h"
#include "stencil/space/comparisons.h"
#include "support/assert.h"
#include "support/match.h"

namespace dpde::stencil {

namespace {

/// Inputs of the operator: arbitrary numbers, for which terms cancel only if they always do.
class ArbitraryInputs {
 public:
  double number() { return spread_(generator_); }
  std::vector<double> field(std::size_t cells) {
    std::vector<double> values(cells);
    for (double& value : values) value = number();
    return values;
  }

 private:
  std::mt19937 generator_{1};
  std::uniform_real_distribution<double> spread_{0.5, 1.5};
};

/// The operator on a grid of its own, with arbitrary coefficients.
class SmallOperator {
 public:
  SmallOperator(const Module& module, const Program& operation, std::string unknown, const CellIndex& cells,
                const Params& known)
      : module_(module),
        operation_(operation),
        unknown_(std::move(unknown)),
        grid_{static_cast<int>(operation.axes.size()), cells},
        state_(grid_, halo_of(module, operation)) {
    const Interface interface = interface_of(module, operation);
    for (const std::string& field : interface.inputs) state_.set(field, arbitrary());
    for (std::size_t axis = 0; axis < operation.axes.size(); ++axis)
      state_.set_coordinate(static_cast<int>(axis), operation.axes[axis], inputs_.number(), inputs_.number());
    for (const std::string& param : interface.params) {
      const auto value = known.find(param);
      params_[param] = value == known.end() ? inputs_.number() : value->second;
    }
  }

  std::size_t size() const { return static_cast<std::size_t>(grid_.cells[0] * grid_.cells[1] * grid_.cells[2]); }
  std::vector<double> arbitrary() { return inputs_.field(size()); }
  std::vector<double> image_of(const std::vector<double>& values) {
    state_.set(unknown_, values);
    interpret(module_, operation_, state_, params_);
    return state_.get(operation_.keeps.front());
  }

 private:
  static int halo_of(const Module& module, const Program& operation) {
    int halo = 1;
    for (const auto& [field, widths] : required_halo(module, operation))
      halo = std::max(halo, *std::ranges::max_element(widths));
    return halo;
  }

  const Module& module_;
  const Program& operation_;
  std::string unknown_;
  Grid grid_;
  State state_;
  Params params_;
  ArbitraryInputs inputs_;
};

double sum_of(const std::vector<double>& values) { return std::accumulate(values.begin(), values.end(), 0.0); }

double product_of(const std::vector<double>& a, const std::vector<double>& b) {
  return std::inner_product(a.begin(), a.end(), b.begin(), 0.0);
}

/// The largest magnitude; NaN if any value is NaN.
double largest_of(const std::vector<double>& values) {
  double most = 0;
  for (const double value : values)
    most = std::isnan(most) || std::isnan(value) ? std::nan("") : std::max(std::abs(value), most);
  return most;
}

struct Seen {
  OperatorTraits traits;
  double size = 0;  // of the largest image
};

/// Tests arbitrary x and y with values near 1: if A is symmetric, (y, A*x) = (x, A*y); the sum of A*x is (A^T*1, x).
/// `size`: magnitude of images on more cells. On few cells images may consist of rounding errors only.
Seen traits_on(SmallOperator a, double size = 0) {
  const std::vector<double> x = a.arbitrary(), y = a.arbitrary();
  const std::vector<double> of_x = a.image_of(x), of_y = a.image_of(y);
  const std::vector<double> of_ones = a.image_of(std::vector<double>(a.size(), 1.0));
  const auto cells = static_cast<double>(a.size());
  const double rounding = 1024 * 0x1p-52 * std::max({largest_of(of_x), largest_of(of_y), size});
  return {{.is_symmetric = std::abs(product_of(y, of_x) - product_of(x, of_y)) <= cells * rounding,
           .takes_constants_to_zero = largest_of(of_ones) <= rounding,
           .sums_to_zero = std::abs(sum_of(of_x)) <= cells * rounding && std::abs(sum_of(of_y)) <= cells * rounding},
          std::max(largest_of(of_x), largest_of(of_y))};
}

/// A grid large enough that along each axis both neighbours of a cell differ, for any stencil radius.
CellIndex cells_for(const std::array<int, max_rank>& reach, std::size_t rank) {
  CellIndex cells{1, 1, 1};
  for (std::size_t axis = 0; axis < rank; ++axis) {
    const int least = reach[axis] < 0 ? 3 : 2 * reach[axis] + 1;
    cells[axis] = least + static_cast<int>(rank - axis);  // axes differ in length
  }
  return cells;
}

Module operator_module(const Module& module, const Program& program, const Solve& solve) {
  Module small{module};
  small.programs = {operator_of(solve, program)};
  place_fills(small);
  return small;
}

/// Whether values near 1 may hide a term: a function that saturates or has cases, a high or unknown power, a number of
/// another magnitude than the other terms.
bool may_hide_a_term(const Expr& part) {
  constexpr double most_number = 1e6, most_power = 8;
  return match(
      part->kind, [](const Param&) { return false; }, [](const Local&) { return false; },
      [](const Access&) { return false; }, [](const Interp&) { return false; }, [](const Inside&) { return false; },
      [](const Neg&) { return false; }, [](const Select&) { return true; },
      [&](const Literal& number) {
        const double size = std::abs(number.value);
        return size != 0 && !(size >= 1 / most_number && size <= most_number);
      },
      [&](const Binary& binary) {
        if (binary.op != BinaryOp::power) return false;
        const Literal* exponent = as<Literal>(binary.right);
        return exponent == nullptr || !(std::abs(exponent->value) <= most_power);
      },
      [](const Call& call) { return call.fn != Fn::sin && call.fn != Fn::cos && call.fn != Fn::sqrt; });
}

bool is_plain(const Kernel& kernel) {
  bool hides = false;
  const auto look = [&](const Expr& e) {
    visit(e, [&](const Expr& part) { hides = hides || may_hide_a_term(part) || is_decision(part); });
  };
  for (const Let& let : kernel.lets) look(let.value);
  for (const Store& store : kernel.stores) look(store.value);
  return !hides && kernel.scatters.empty();
}

/// Whether the block consists of fills and kernels only, whose formulas hide no terms.
bool is_plain(const Module& module, const Solve& solve) {
  return std::ranges::all_of(solve.body, [&](const Statement& statement) {
    return match(
        statement, [&](const Run& run) { return is_plain(kernel_of(module, run)); }, always<true, Fill, Fold>,
        always<false, Reduce, NetworkCall, Transform, Solve, Repeat>);
  });
}

OperatorTraits both(const OperatorTraits& a, const OperatorTraits& b) {
  return {a.is_symmetric && b.is_symmetric, a.takes_constants_to_zero && b.takes_constants_to_zero,
          a.sums_to_zero && b.sums_to_zero};
}

}  // namespace

OperatorTraits traits_of(const Module& module, const Program& program, const Solve& solve, const Params& known) {
  require(solve.is_linear && solve.unknowns.size() == 1, "a linear solve for one field");
  const Module small = operator_module(module, program, solve);
  const CellIndex cells = cells_for(reach_of_operator(module, solve, program.axes.size()), program.axes.size());
  return traits_on({small, small.programs.front(), solve.unknowns.front(), cells, known}).traits;
}

/// Also tests grids of one and two cells, which have special rules: both periodic neighbours are the same cell, and
/// slopes at walls use two values.
OperatorTraits certain_traits_of(const Module& module, const Program& program, const Solve& solve) {
  if (!solve.is_linear || solve.unknowns.size() != 1 || !is_plain(module, solve)) return {};
  const Module small = operator_module(module, program, solve);
  const std::size_t rank = program.axes.size();
  const auto on = [&](const CellIndex& cells, double size) {
    return traits_on({small, small.programs.front(), solve.unknowns.front(), cells, {}}, size);
  };
  const Seen many = on(cells_for(reach_of_operator(module, solve, rank), rank), 0);
  OperatorTraits found = many.traits;
  for (const int least : {1, 2}) {
    if (found == OperatorTraits{}) break;
    CellIndex cells{1, 1, 1};
    for (std::size_t axis = 0; axis < rank; ++axis) cells[axis] = least + static_cast<int>(axis % 2);
    found = both(found, on(cells, many.size).traits);
  }
  return found;
}

}  // namespace dpde::stencil
