// SPDX-License-Identifier: Apache-2.0
// Kernels evaluated point by point. Stores are applied only after all points have been evaluated, so that the rule
// "reads see the fields as they were" holds by construction. Names are looked up once a run of a kernel.
#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <limits>
#include <memory>
#include <variant>

#include "stencil/interpret.h"
#include "support/assert.h"
#include "support/evaluate.h"
#include "support/match.h"

namespace dpde::stencil {

namespace {

int wrapped(int i, int n) { return (i % n + n) % n; }

// ---- interpolation -------------------------------------------------------------------------------------------------

/// A cell along one axis and what an interpolation takes of it.
struct WeightedCell {
  int cell;
  double weight;
};

/// The cells along one axis around the point `at` displaced by `d`, and their weights.
std::vector<WeightedCell> taps_along(Topology topology, int n, int at, double d, Along along) {
  const double j = at + std::floor(d);
  double f = d - std::floor(d);
  const bool nowhere = !std::isfinite(d);  // no place: the weights are NaN and so is the result
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
  std::vector<WeightedCell> taps;
  int cell = low - 1;
  for (const std::array<double, 4>& c : weights_of(along)) {
    const double weight = c[0] + f * (c[1] + f * (c[2] + f * c[3]));
    const int place = topology == Topology::periodic ? wrapped(cell, n) : cell;
    if (c != std::array<double, 4>{}) taps.push_back({place, clamped && is_derivative(along) ? 0 : weight});
    ++cell;
  }
  return taps;
}

// ---- expressions ---------------------------------------------------------------------------------------------------

/// Where kernels run, and what their names mean.
struct Scope {
  const State& state;
  const std::vector<Topology>& axes;
  const Params& params;
  std::unordered_map<std::string, std::size_t> locals = {};  // their numbers
};

/// One point: the cell, and the locals by their numbers.
struct Point {
  Cell cell{};
  std::vector<double> locals = {};
};

struct Bound;
using Operand = std::shared_ptr<const Bound>;
/// A field that nobody has written is NaN.
struct BoundAccess {
  const std::vector<double>* cells;
  Offset offset;
};
struct BoundInterp {
  const Interp* interp;
  const std::vector<double>* cells;
  std::vector<Operand> displacement;  // one an axis
};
struct BoundLocal {
  std::size_t number;
};
struct BoundNeg {
  Operand operand;
};
struct BoundBinary {
  BinaryOp op;
  Operand left, right;
};
struct BoundCall {
  Fn fn;
  std::vector<Operand> arguments;
};
struct BoundSelect {
  Operand condition, yes, no;
};
/// An expression with its names looked up, and what is the same at all points computed.
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

Cell displaced(Cell cell, const Offset& offset) {
  for (int axis = 0; axis < max_rank; ++axis) cell[axis] += offset[axis];
  return cell;
}

/// What expressions are worth on a grid.
class Evaluation {
 public:
  explicit Evaluation(const Scope& scope) : state_(scope.state), axes_(scope.axes) {}

  double value(const Operand& e, const Point& at) const {
    return match(
        e->kind, [](const double& number) { return number; }, [&](const BoundLocal& l) { return at.locals[l.number]; },
        [&](const BoundAccess& a) { return read(a.cells, displaced(at.cell, a.offset)); },
        [&](const BoundInterp& i) {
          double sum = 0;
          for_each_tap(i, at, [&](const Cell& c, double weight) { sum += weight * read(i.cells, c); });
          return sum;
        },
        [&](const Inside& i) { return is_inside(i, at) ? 1.0 : 0.0; },
        [&](const BoundNeg& n) { return -value(n.operand, at); },
        [&](const BoundBinary& b) { return evaluate_binary(b.op, value(b.left, at), value(b.right, at)); },
        [&](const BoundCall& c) {
          return evaluate_call_of(c.fn, c.arguments, [&](const Operand& a) { return value(a, at); });
        },
        [&](const BoundSelect& s) { return value(s.condition, at) != 0 ? value(s.yes, at) : value(s.no, at); });
  }

  /// Calls f(cell, weight) for each cell the interpolation takes.
  void for_each_tap(const BoundInterp& bound, const Point& at,
                    const std::function<void(const Cell&, double)>& f) const {
    std::array<std::vector<WeightedCell>, max_rank> taps;
    Cell counts{1, 1, 1};
    taps.fill({{0, 1}});
    for (std::size_t axis = 0; axis < axes_.size(); ++axis) {
      taps[axis] = taps_along(axes_[axis], state_.grid().cells[axis], at.cell[axis] + bound.interp->offset[axis],
                              value(bound.displacement[axis], at), bound.interp->along[axis]);
      counts[axis] = static_cast<int>(taps[axis].size());
    }
    for_each_cell({}, counts, [&](const Cell& c) {
      const WeightedCell &x = taps[0][c[0]], &y = taps[1][c[1]], &z = taps[2][c[2]];
      f({x.cell, y.cell, z.cell}, x.weight * y.weight * z.weight);
    });
  }

 private:
  double read(const std::vector<double>* cells, const Cell& cell) const {
    return cells == nullptr ? std::numeric_limits<double>::signaling_NaN() : (*cells)[state_.index(cell)];
  }

  bool is_inside(const Inside& inside, const Point& at) const {
    const Cell place = displaced(at.cell, inside.offset);
    for (std::size_t axis = 0; axis < axes_.size(); ++axis) {
      const int n = state_.grid().cells[axis];
      if (axes_[axis] == Topology::periodic) continue;
      if (place[axis] < -inside.grow || place[axis] >= n + inside.grow) return false;
    }
    return true;
  }

  const State& state_;
  const std::vector<Topology>& axes_;
};

// ---- kernels -------------------------------------------------------------------------------------------------------

/// One addition or assignment to a cell, waiting until all points have been evaluated.
struct Write {
  const std::string* field;
  Cell cell;
  bool accumulate;
  double value;
};

/// A kernel with its names looked up; one of each list for one of the kernel's.
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

/// What a kernel writes, in the order of its points.
struct Writes {
  std::vector<Write> stores, scatters;
};

Writes evaluate(const Kernel& kernel, const Cell& low, const Cell& high, Scope& scope,
                std::map<std::string, double>& sums) {
  Writes result;
  const BoundKernel bound = bind(kernel, scope);
  const Evaluation evaluation(scope);
  Point point;
  for_each_cell(low, high, [&](const Cell& cell) {
    point.cell = cell;
    point.locals.clear();
    for (const Operand& let : bound.lets) point.locals.push_back(evaluation.value(let, point));
    for (std::size_t i = 0; i < bound.stores.size(); ++i) {
      const Store& s = kernel.stores[i];
      result.stores.push_back({&s.field, cell, s.accumulate, evaluation.value(bound.stores[i], point)});
    }
    for (std::size_t i = 0; i < bound.sums.size(); ++i)
      sums[kernel.sums[i].name] += evaluation.value(bound.sums[i], point);
    for (std::size_t i = 0; i < bound.scatters.size(); ++i) {
      const double value = evaluation.value(bound.scatters[i], point);
      evaluation.for_each_tap(bound.targets[i], point, [&](const Cell& corner, double weight) {
        result.scatters.push_back({&kernel.scatters[i].target.field, corner, true, weight * value});
      });
    }
  });
  return result;
}

}  // namespace

double uniform_value(const Expr& e, const State& state, const Params& params) {
  const std::vector<Topology> no_axes;
  const Scope scope{state, no_axes, params};
  return Evaluation(scope).value(bind(e, scope), {});
}

void apply(State& state, const Kernel& kernel, int grow, const std::vector<Topology>& axes, const Params& params,
           std::map<std::string, double>& sums) {
  Cell low{}, high = state.grid().cells;
  for (std::size_t axis = 0; axis < axes.size(); ++axis) {
    if (axes[axis] == Topology::periodic) continue;
    low[axis] -= grow;
    high[axis] += grow;
  }
  Scope scope{state, axes, params};
  const Writes writes = evaluate(kernel, low, high, scope, sums);
  for (const std::vector<Write>* list : {&writes.stores, &writes.scatters}) {
    for (const Write& write : *list) {
      double& target = state.at(*write.field, write.cell);
      target = state.stored(write.accumulate ? target + write.value : write.value);
    }
  }
}

}  // namespace dpde::stencil
