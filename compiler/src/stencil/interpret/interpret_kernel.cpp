// SPDX-License-Identifier: Apache-2.0
// Kernels. Each subexpression is evaluated at all points before the next one. Stores are applied after all evaluations,
// so that the rule "reads see the fields as they were" holds by construction. Names are looked up once per run of a
// kernel.
#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <memory>
#include <variant>

#include "stencil/interpret/interpret.h"
#include "support/assert.h"
#include "support/match.h"
#include "support/maths/evaluate.h"

namespace dpde::stencil {

namespace {

int wrapped(int i, int n) { return (i % n + n) % n; }

// ---- interpolation -------------------------------------------------------------------------------------------------

/// A cell along one axis and its weight in an interpolation.
struct WeightedCell {
  int cell;
  double weight;
};

/// The weighted cells along one axis.
struct Taps {
  std::array<WeightedCell, 4> cells{};
  int count = 0;

  void add(int cell, double weight) { cells[count++] = {cell, weight}; }
};

/// The cells along one axis around the point `at` displaced by `d`, and their weights.
Taps taps_along(Topology topology, int n, int at, double d, InterpolationBasis along) {
  const double j = at + std::floor(d);
  double f = d - std::floor(d);
  const bool nowhere = !std::isfinite(d);  // no position: the weights and the result are NaN
  int low = 0;
  bool clamped = false;
  if (nowhere) {
    f = d - d;
  } else if (topology == Topology::bounded) {
    const bool below = j < -1 || (j == -1 && f < 0.5);
    const bool above = j > n - 1 || (j == n - 1 && f > 0.5);
    clamped = below || above;
    if (clamped) f = 0.5;
    low = below ? -1 : above ? n - 1 : static_cast<int>(j);
  } else {
    low = wrapped(static_cast<int>(std::fmod(j, n)), n);
  }
  Taps taps;
  int cell = low - 1;
  for (const std::array<double, 4>& c : weights_of(along)) {
    const double weight = c[0] + f * (c[1] + f * (c[2] + f * c[3]));
    const int place = topology == Topology::periodic ? wrapped(cell, n) : cell;
    if (c != std::array<double, 4>{}) taps.add(place, clamped && is_derivative(along) ? 0 : weight);
    ++cell;
  }
  return taps;
}

// ---- expressions ---------------------------------------------------------------------------------------------------

/// The state of a run and the values of names.
struct Scope {
  const State& state;
  const std::vector<Topology>& axes;
  const Params& params;
  std::unordered_map<std::string, std::size_t> locals = {};  // their numbers
};

struct Bound;
using Operand = std::shared_ptr<const Bound>;
/// A read of a field; the values of an unwritten field are NaN.
struct BoundAccess {
  const std::vector<double>* cells;
  Offset offset;
};
struct BoundInterp {
  const Interp* interp;
  const std::vector<double>* cells;
  std::vector<Operand> displacement;  // one per axis
};
struct BoundLocal {
  std::size_t number;
};
using BoundNeg = NegOf<Operand>;
using BoundBinary = BinaryOf<Operand>;
using BoundCall = CallOf<Operand>;
using BoundSelect = SelectOf<Operand>;
/// An expression with its names looked up and its uniform parts evaluated.
struct Bound {
  std::variant<double, BoundLocal, BoundAccess, BoundInterp, Inside, BoundNeg, BoundBinary, BoundCall, BoundSelect>
      kind;
};

Operand bind(const Expr& e, const Scope& scope);

BoundInterp bind(const Interp& interp, const Scope& scope) {
  BoundInterp result{&interp, scope.state.find_cells(interp.field), {}};
  for (const Expr& along : interp.displacement) result.displacement.push_back(bind(along, scope));
  return result;
}

Operand bind(const Expr& e, const Scope& scope) {
  const auto of = [&](const Expr& child) { return bind(child, scope); };
  const auto make = [](auto kind) { return std::make_shared<const Bound>(Bound{std::move(kind)}); };
  const auto number = [](const Operand& operand) { return std::get_if<double>(&operand->kind); };
  return match(
      e->kind, [&](const Literal& l) { return make(l.value); },
      [&](const Param& p) {
        const auto found = scope.params.find(p.name);
        require(found != scope.params.end(), "every parameter has a value");
        return make(found->second);
      },
      [&](const Local& l) {
        const auto found = scope.locals.find(l.name);
        require(found != scope.locals.end(), "a local is defined before use");
        return make(BoundLocal{found->second});
      },
      [&](const Access& a) {
        return make(BoundAccess{scope.state.find_cells(a.field), a.offset});
      },
      [&](const Interp& i) { return make(bind(i, scope)); }, [&](const Inside& i) { return make(i); },
      [&](const Neg& n) {
        Operand a = of(n.operand);
        return number(a) ? make(-*number(a)) : make(BoundNeg{std::move(a)});
      },
      [&](const Binary& b) {
        Operand left = of(b.left), right = of(b.right);
        return number(left) && number(right) ? make(evaluate_binary(b.op, *number(left), *number(right)))
                                             : make(BoundBinary{b.op, std::move(left), std::move(right)});
      },
      [&](const Call& c) {
        std::vector<Operand> arguments;
        std::ranges::transform(c.arguments, std::back_inserter(arguments), of);
        return std::ranges::all_of(arguments, number)
                   ? make(evaluate_call_of(c.fn, arguments, [&](const Operand& a) { return *number(a); }))
                   : make(BoundCall{c.fn, std::move(arguments)});
      },
      [&](const Select& s) {
        return make(BoundSelect{of(s.condition), of(s.yes), of(s.no)});
      });
}

CellIndex displaced(CellIndex cell, const Offset& offset) {
  for (int axis = 0; axis < max_rank; ++axis) cell[axis] += offset[axis];
  return cell;
}

/// One for each point, x fastest.
using Values = std::vector<double>;

/// Values of expressions at the points of a box.
class Evaluation {
 public:
  Evaluation(const Scope& scope, const CellIndex& low, const CellIndex& high)
      : state_(scope.state), axes_(scope.axes), low_(low), high_(high) {
    for (int axis = 0; axis < max_rank; ++axis) count_ *= static_cast<std::size_t>(std::max(high[axis] - low[axis], 0));
  }

  Values values(const Operand& e) const {
    return match(
        e->kind, [&](const double& number) { return Values(count_, number); },
        [&](const BoundLocal& l) { return locals_[l.number]; }, [&](const BoundAccess& a) { return read(a); },
        [&](const BoundInterp& i) { return interpolated(i); }, [&](const Inside& i) { return where_inside(i); },
        [&](const BoundNeg& n) {
          Values result = values(n.operand);
          for (double& value : result) value = -value;
          return result;
        },
        [&](const BoundBinary& b) {
          Values result = values(b.left);
          const Values right = values(b.right);
          for (std::size_t p = 0; p < count_; ++p) result[p] = evaluate_binary(b.op, result[p], right[p]);
          return result;
        },
        [&](const BoundCall& c) {
          const std::vector<Values> arguments = values_of_all(c.arguments);
          Values result(count_);
          for (std::size_t p = 0; p < count_; ++p)
            result[p] = evaluate_call_of(c.fn, arguments, [&](const Values& a) { return a[p]; });
          return result;
        },
        [&](const BoundSelect& s) {
          Values result = values(s.yes);
          const Values condition = values(s.condition), no = values(s.no);
          for (std::size_t p = 0; p < count_; ++p) result[p] = condition[p] != 0 ? result[p] : no[p];
          return result;
        });
  }
  std::vector<Values> values_of_all(const std::vector<Operand>& all) const {
    std::vector<Values> result;
    for (const Operand& e : all) result.push_back(values(e));
    return result;
  }
  /// Evaluates the next local.
  void define(const Operand& e) { locals_.push_back(values(e)); }

  /// Calls f(cell, weight) for each cell of the interpolation at point number `p`, cell `at`.
  template <class F>
  void for_each_tap(const Interp& interp, const std::vector<Values>& displacement, std::size_t p, const CellIndex& at,
                    const F& f) const {
    std::array<Taps, max_rank> taps;
    for (Taps& along : taps) along.add(0, 1);
    CellIndex counts{1, 1, 1};
    for (std::size_t axis = 0; axis < axes_.size(); ++axis) {
      taps[axis] = taps_along(axes_[axis], state_.grid().cells[axis], at[axis] + interp.offset[axis],
                              displacement[axis][p], interp.along[axis]);
      counts[axis] = taps[axis].count;
    }
    for_each_cell({}, counts, [&](const CellIndex& c) {
      const WeightedCell &x = taps[0].cells[c[0]], &y = taps[1].cells[c[1]], &z = taps[2].cells[c[2]];
      f(CellIndex{x.cell, y.cell, z.cell}, x.weight * y.weight * z.weight);
    });
  }

 private:
  Values read(const BoundAccess& access) const {
    if (access.cells == nullptr) return Values(count_, std::numeric_limits<double>::signaling_NaN());
    Values result;
    result.reserve(count_);
    for_each_cell(low_, high_, [&](const CellIndex& at) {
      result.push_back((*access.cells)[state_.index(displaced(at, access.offset))]);
    });
    return result;
  }

  Values interpolated(const BoundInterp& bound) const {
    const std::vector<Values> displacement = values_of_all(bound.displacement);
    Values result;
    for_each_cell(low_, high_, [&](const CellIndex& at) {
      double sum = 0;
      for_each_tap(*bound.interp, displacement, result.size(), at, [&](const CellIndex& c, double weight) {
        const double value =
            bound.cells == nullptr ? std::numeric_limits<double>::signaling_NaN() : (*bound.cells)[state_.index(c)];
        sum += weight * value;
      });
      result.push_back(sum);
    });
    return result;
  }

  Values where_inside(const Inside& inside) const {
    Values result;
    for_each_cell(low_, high_, [&](const CellIndex& at) { result.push_back(is_inside(inside, at) ? 1.0 : 0.0); });
    return result;
  }

  bool is_inside(const Inside& inside, const CellIndex& at) const {
    const CellIndex place = displaced(at, inside.offset);
    for (std::size_t axis = 0; axis < axes_.size(); ++axis) {
      const int n = state_.grid().cells[axis];
      if (axes_[axis] == Topology::periodic) continue;
      if (place[axis] < -inside.grow || place[axis] >= n + inside.grow) return false;
    }
    return true;
  }

  const State& state_;
  const std::vector<Topology>& axes_;
  const CellIndex low_, high_;
  std::size_t count_ = 1;
  std::vector<Values> locals_;
};

// ---- kernels -------------------------------------------------------------------------------------------------------

/// A kernel with its names looked up; each list has the order of the kernel's list.
struct BoundKernel {
  std::vector<Operand> lets, stores, sums, scatters;
  std::vector<BoundInterp> targets;
};

BoundKernel bind(const Kernel& kernel, Scope& scope) {
  BoundKernel result;
  for (const Let& let : kernel.lets) {
    result.lets.push_back(bind(let.value, scope));
    scope.locals[let.name] = result.lets.size() - 1;
  }
  for (const Store& s : kernel.stores) result.stores.push_back(bind(s.value, scope));
  for (const Sum& s : kernel.sums) result.sums.push_back(bind(s.value, scope));
  for (const Scatter& s : kernel.scatters) {
    result.scatters.push_back(bind(s.value, scope));
    result.targets.push_back(bind(s.target, scope));
  }
  return result;
}

}  // namespace

double uniform_value(const Expr& e, const State& state, const Params& params) {
  if (const Literal* number = as<Literal>(e)) return number->value;
  const std::vector<Topology> no_axes;
  const Scope scope{state, no_axes, params};
  return Evaluation(scope, {}, {1, 1, 1}).values(bind(e, scope)).front();
}

void apply(State& state, const Kernel& kernel, int grow, const std::vector<Topology>& axes, const Params& params,
           std::map<std::string, double>& sums) {
  CellIndex low{}, high = state.grid().cells;
  for (std::size_t axis = 0; axis < axes.size(); ++axis) {
    if (axes[axis] == Topology::periodic) continue;
    low[axis] -= grow;
    high[axis] += grow;
  }
  Scope scope{state, axes, params};
  const BoundKernel bound = bind(kernel, scope);
  Evaluation evaluation(scope, low, high);
  for (const Operand& let : bound.lets) evaluation.define(let);
  const std::vector<Values> stores = evaluation.values_of_all(bound.stores),
                            scatters = evaluation.values_of_all(bound.scatters);
  std::vector<std::vector<Values>> displacements;
  for (const BoundInterp& target : bound.targets)
    displacements.push_back(evaluation.values_of_all(target.displacement));
  for (std::size_t s = 0; s < bound.sums.size(); ++s) {
    double& sum = sums[kernel.sums[s].name];
    for (const double value : evaluation.values(bound.sums[s])) sum += value;
  }
  const auto write = [&](double& target, double value, bool accumulate) {
    target = state.stored(accumulate ? target + value : value);
  };
  for (std::size_t s = 0; s < stores.size(); ++s) {
    std::vector<double>& cells = state.cells_to_write(kernel.stores[s].field);
    auto value = stores[s].begin();
    for_each_cell(low, high,
                  [&](const CellIndex& at) { write(cells[state.index(at)], *value++, kernel.stores[s].accumulate); });
  }
  if (scatters.empty()) return;
  std::size_t point = 0;
  for_each_cell(low, high, [&](const CellIndex& at) {
    for (std::size_t s = 0; s < scatters.size(); ++s) {
      const Interp& target = kernel.scatters[s].target;
      evaluation.for_each_tap(target, displacements[s], point, at, [&](const CellIndex& cell, double weight) {
        write(state.at(target.field, cell), weight * scatters[s][point], true);
      });
    }
    ++point;
  });
}

}  // namespace dpde::stencil
