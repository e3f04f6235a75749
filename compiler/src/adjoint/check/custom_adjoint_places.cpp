// SPDX-License-Identifier: Apache-2.0
#include "adjoint/check/custom_adjoint_places.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <functional>
#include <set>

#include "stencil/build.h"
#include "support/assert.h"

namespace dpde::adjoint {

using namespace stencil;

namespace {

constexpr std::array<int, max_rank> longest{
    64, 64, 16};  // cells of a box along an axis, by rank: an error in one cell still shows in a sum over all
constexpr std::size_t most_boxes = 128;  // along each axis
constexpr std::size_t most_changes = 32;
constexpr int small_grid = 4096;  // cells: up to here a box is the whole grid
constexpr int more_places = 2;    // random ones, in addition to ends and changes

bool reads_coordinate(const Expr& e) {
  const Access* access = as<Access>(e);
  return access && is_coordinate(access->field);
}

void for_each_formula(const Kernel& kernel, const std::function<void(const Expr&)>& f) {
  for_each_expression(kernel, f);
  for (const CustomAdjoint& given : kernel.custom_adjoints) f(given.value);
}

Expr without_locals(const Kernel& kernel, const Expr& e) {
  if (const Local* local = as<Local>(e)) {
    const auto let =
        std::find_if(kernel.lets.begin(), kernel.lets.end(), [&](const Let& x) { return x.name == local->name; });
    return let == kernel.lets.end() ? e : without_locals(kernel, let->value);
  }
  return map_children(e, [&](const Expr& child) { return without_locals(kernel, child); });
}

/// Whether `e` has coordinates, parameters and numbers only, with at least one coordinate.
bool is_of_place(const Expr& e) {
  bool has_coordinate = false, has_other = false;
  visit(e, [&](const Expr& part) {
    if (reads_coordinate(part)) {
      has_coordinate = true;
    } else {
      has_other = has_other || is<Access, Interp, Inside, Local>(part);
    }
  });
  return has_coordinate && !has_other;
}

/// An expression whose value changes where `e` takes another branch or the other side of a kink; nullopt if `e` has no
/// branches.
std::optional<Expr> branch_of(const Expr& e) {
  if (const Binary* b = as<Binary>(e)) {
    const bool compares = precedence(b->op) == precedence(BinaryOp::less);
    return compares ? std::optional(select(e, 1.0, 0.0)) : std::nullopt;
  }
  const Call* c = as<Call>(e);
  if (!c) return std::nullopt;
  switch (c->fn) {
    case Fn::abs:
    case Fn::sign: return call(Fn::sign, c->arguments);
    case Fn::floor:
    case Fn::fraction: return call(Fn::floor, c->arguments);
    case Fn::min:
    case Fn::max: return select(binary(BinaryOp::less, c->arguments[0], c->arguments[1]), 1.0, 0.0);
    case Fn::sin:
    case Fn::cos:
    case Fn::tan:
    case Fn::asin:
    case Fn::acos:
    case Fn::atan:
    case Fn::sinh:
    case Fn::cosh:
    case Fn::tanh:
    case Fn::exp:
    case Fn::log:
    case Fn::erf:
    case Fn::sqrt: return std::nullopt;
  }
  unreachable("function");
}

std::vector<Expr> branches_of(const Kernel& kernel) {
  std::vector<Expr> branches;
  for_each_formula(kernel, [&](const Expr& whole) {
    visit(without_locals(kernel, whole), [&](const Expr& e) {
      const std::optional<Expr> branch = branch_of(e);
      if (branch && is_of_place(*branch) && std::find(branches.begin(), branches.end(), *branch) == branches.end())
        branches.push_back(*branch);
    });
  });
  return branches;
}

/// The cells along `axis` that differ from the previous one in a branch, evaluated at the middle of the other axes.
std::vector<int> changes_along(int axis, const std::vector<Expr>& branches, const Surroundings& surroundings) {
  const int rank = static_cast<int>(surroundings.axes.size());
  Kernel kernel{"branches", rank, {}, {}, {}, {}};
  for (const Expr& branch : branches)
    kernel.stores.push_back({fmt::format("branch_{}", kernel.stores.size()), false, branch, {}});
  if (kernel.stores.empty()) return {};
  Module module{
      {kernel},
      {Program{
          "p", std::vector<Topology>(static_cast<std::size_t>(rank), Topology::bounded), {Run{kernel.name}}, {}, {}}},
      {}};
  Params params = surroundings.params;
  for (const std::string& name : signature(kernel).params) params.emplace(name, 1.0);
  int halo = 1;
  for (const Signature::Read& read : signature(kernel).reads)
    halo = std::max(halo, *std::max_element(read.halo.begin(), read.halo.end()));
  const int cells = surroundings.axes[axis].cells;
  Grid grid{rank, {1, 1, 1}};
  grid.cells[axis] = cells;
  State state(grid, halo);
  for (int a = 0; a < rank; ++a) {
    const Surroundings::Axis& along = surroundings.axes[a];
    state.set_coordinate(a, Topology::bounded, along.low + (a == axis ? 0 : along.cells / 2) * along.spacing,
                         along.spacing);
  }
  interpret(module, module.programs.front(), state, params);
  std::set<int> changes;
  for (const Store& store : kernel.stores) {
    const std::vector<double> values = state.get(store.field);
    for (int i = 1; i < cells; ++i) {
      if (values[i] != values[i - 1]) changes.insert(i);
    }
  }
  return {changes.begin(), changes.end()};
}

struct Interval {
  int first, cells;
};

/// Intervals of one axis: those that cover it, and short ones at its ends, at changes of branches and at random.
struct Intervals {
  std::vector<Interval> covering, special;
};

Intervals intervals_of(int axis, int least, const std::vector<Expr>& branches, const Surroundings& surroundings,
                       std::mt19937_64& random) {
  const int cells = surroundings.axes[axis].cells;
  Intervals result;
  const int most = longest[surroundings.axes.size() - 1];
  for (int first = 0; first < cells; first += most) result.covering.push_back({first, std::min(most, cells - first)});
  const int length = std::min(least, cells);
  const auto add = [&](int first) { result.special.push_back({std::clamp(first, 0, cells - length), length}); };
  add(0);
  add(cells - length);
  std::vector<int> changes = changes_along(axis, branches, surroundings);
  std::shuffle(changes.begin(), changes.end(), random);
  if (changes.size() > most_changes) changes.resize(most_changes);
  for (const int change : changes) add(change - length / 2);
  for (int i = 0; i < more_places; ++i) add(std::uniform_int_distribution<int>(0, cells - length)(random));
  return result;
}

/// Cycles through a list, in a new random order each time; the first `foremost` entries always come before the others.
class Round {
 public:
  Round(std::vector<Interval> list, std::size_t foremost)
      : list_(std::move(list)), foremost_(static_cast<std::ptrdiff_t>(foremost)) {}
  const Interval& next(std::mt19937_64& random) {
    if (at_ == 0) {
      std::shuffle(list_.begin(), list_.begin() + foremost_, random);
      std::shuffle(list_.begin() + foremost_, list_.end(), random);
    }
    const Interval& result = list_[at_];
    at_ = (at_ + 1) % list_.size();
    return result;
  }

 private:
  std::vector<Interval> list_;
  std::ptrdiff_t foremost_;
  std::size_t at_ = 0;
};

}  // namespace

bool names_coordinates(const Kernel& kernel) {
  bool found = false;
  for_each_formula(
      kernel, [&](const Expr& whole) { visit(whole, [&](const Expr& e) { found = found || reads_coordinate(e); }); });
  return found;
}

std::vector<Box> boxes_of(const Kernel& kernel, const Surroundings& surroundings,
                          const std::array<int, max_rank>& least, std::mt19937_64& random) {
  const int rank = static_cast<int>(surroundings.axes.size());
  const std::vector<Expr> branches = branches_of(kernel);
  std::vector<Intervals> axes;
  for (int axis = 0; axis < rank; ++axis)
    axes.push_back(intervals_of(axis, least[axis], branches, surroundings, random));
  std::vector<Box> boxes;
  std::int64_t cells = 1;
  Box whole{{rank, {1, 1, 1}}};
  for (int axis = 0; axis < rank; ++axis) {
    const Surroundings::Axis& of = surroundings.axes[axis];
    cells *= whole.grid.cells[axis] = of.cells;
    whole.low[axis] = of.low;
    whole.spacing[axis] = of.spacing;
  }
  if (cells <= small_grid) boxes.push_back(whole);
  for (int along = 0; along < rank; ++along) {
    std::vector<Round> rounds;
    std::size_t count = 1;
    for (int axis = 0; axis < rank; ++axis) {
      std::vector<Interval> list = axes[axis].special;
      if (axis == along) list.insert(list.end(), axes[axis].covering.begin(), axes[axis].covering.end());
      count *= list.size();
      rounds.emplace_back(std::move(list), axes[axis].special.size());
    }
    for (std::size_t n = 0; n < std::min(count, most_boxes); ++n) {
      Box box = whole;
      for (int axis = 0; axis < rank; ++axis) {
        const Interval& interval = rounds[axis].next(random);
        box.grid.cells[axis] = interval.cells;
        box.low[axis] += interval.first * box.spacing[axis];
      }
      boxes.push_back(box);
    }
  }
  return boxes;
}

}  // namespace dpde::adjoint
