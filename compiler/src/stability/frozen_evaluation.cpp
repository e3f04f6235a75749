// SPDX-License-Identifier: Apache-2.0
#include "stability/frozen_evaluation.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "stencil/build.h"
#include "support/evaluate.h"
#include "support/match.h"

namespace dpde::stability {

using namespace stencil;

namespace {

constexpr std::size_t most_terms = 50'000;
constexpr std::size_t terms_beside_waves = 24;  // where more are one component: put into each other, they multiply
constexpr double tie = 1e-11;  // relative: what rounding leaves, and less than what a maximum calls equal

Value operator+(const Value& a, const Value& b) { return {a.number + b.number, a.form.plus(b.form)}; }
Value operator-(const Value& a) { return {-a.number, a.form.times(-1)}; }
Value operator-(const Value& a, const Value& b) { return a + -b; }
/// Linear in perturbations: at most one of them has any in what tangents do.
Value operator*(const Value& a, const Value& b) {
  return {a.number * b.number, a.form.times(b.number).plus(b.form.times(a.number))};
}

/// Cells along one axis that an interpolation takes, with their weights.
struct Tap {
  int cell;
  double weight;
};

std::vector<Tap> taps_along(double displacement, Along along) {
  const double below = std::floor(displacement), f = displacement - below;
  std::vector<Tap> taps;
  int cell = static_cast<int>(below) - 1;
  for (const std::array<double, 4>& c : weights_of(along)) {
    if (c != std::array<double, 4>{}) taps.push_back({cell, c[0] + f * (c[1] + f * (c[2] + f * c[3]))});
    ++cell;
  }
  return taps;
}

}  // namespace

const Value& Evaluation::field_value(const std::string& name) {
  const auto [entry, is_new] = fields_.try_emplace(name);
  if (is_new) {
    const auto known = point_.fields.find(name);
    entry->second.number = known == point_.fields.end() ? unknown_value : known->second.value;
    if (known != point_.fields.end()) entry->second.slope = known->second.slope;
  }
  return entry->second;
}

double Evaluation::parameter(const std::string& name) const {
  if (const auto counter = counters_.find(name); counter != counters_.end()) return counter->second;
  if (name == "dt") return dt_;
  if (is_late_ && name == "t") return std::numeric_limits<double>::infinity();
  const auto known = point_.params.find(name);
  return known == point_.params.end() ? unknown_value : known->second;
}

Value Evaluation::access(const std::string& name, const Offset& offset) {
  if (is_coordinate(name)) {
    const auto axis = static_cast<std::size_t>(name[0] - 'x');
    return {point_.place[axis] + (offset[axis] + base_[axis]) * parameter("h" + name)};
  }
  const Value& field = field_value(name);
  double number = field.number;
  for (std::size_t axis = 0; axis < offset.size(); ++axis)
    number += field.slope[axis] == 0 ? 0 : field.slope[axis] * (offset[axis] + base_[axis]);
  return {number, offset == Offset{} ? field.form : field.form.shifted(offset)};
}

Value Evaluation::interpolate(const Interp& interp) {
  std::array<std::vector<Tap>, 3> taps;
  taps.fill({{0, 1}});
  for (std::size_t axis = 0; axis < interp.displacement.size(); ++axis) {
    const double displacement = value(interp.displacement[axis]).number;
    is_too_far_ = is_too_far_ || !(std::abs(displacement) < farthest_offset / 4);
    if (is_too_far_) return {};
    displacement_ = std::max(displacement_, std::abs(displacement));
    taps[axis] = taps_along(displacement, interp.along[axis]);
  }
  Value sum;
  for (const Tap& z : taps[2]) {
    for (const Tap& y : taps[1]) {
      for (const Tap& x : taps[0]) {
        const Offset place{interp.offset[0] + x.cell, interp.offset[1] + y.cell, interp.offset[2] + z.cell};
        sum = sum + access(interp.field, place) * Value{x.weight * y.weight * z.weight, {}};
      }
    }
  }
  return sum;
}

Value Evaluation::binary(const Binary& b) {
  const Value left = value(b.left), right = value(b.right);
  switch (b.op) {
    case BinaryOp::add: return left + right;
    case BinaryOp::subtract: return left - right;
    case BinaryOp::multiply: return left * right;
    case BinaryOp::divide: return {left.number / right.number, left.form.times(1 / right.number)};
    case BinaryOp::power: return {std::pow(left.number, right.number), {}};
    case BinaryOp::less:
    case BinaryOp::less_equal:
    case BinaryOp::greater:
    case BinaryOp::greater_equal:
    case BinaryOp::equal:
    case BinaryOp::not_equal:
    case BinaryOp::logical_and:
    case BinaryOp::logical_or: break;
  }
  // What depends on a number that is not known is not known either, conditions too.
  if (std::isnan(left.number) || std::isnan(right.number)) return {unknown_value, {}};
  return {evaluate_binary(b.op, left.number, right.number), {}};
}

namespace {

bool holds_param(const Expr& e, const std::string& name) {
  if (const Param* param = std::get_if<Param>(&e->kind)) return param->name == name;
  bool found = false;
  for_each_child(e, [&](const Expr& child) { found = found || holds_param(child, name); });
  return found;
}

}  // namespace

/// Schemes with a memory ask whether t < dt/2, which is their first step: it is not that one which is analysed, however
/// long the step is.
Evaluation::Condition Evaluation::condition_of(const Expr& e) {
  if (!holds_param(e, "t") || !holds_param(e, "dt")) return compared(e);
  const double step = std::exchange(dt_, 0);
  is_late_ = std::isnan(parameter("t"));
  const double truth = value(e).number;
  is_late_ = false;
  dt_ = step;
  return {truth};
}

/// A tie: both sides are the same but for rounding, and not 0: two rises of a straight line as an example.
Evaluation::Condition Evaluation::compared(const Expr& e) {
  const Binary* b = std::get_if<Binary>(&e->kind);
  constexpr BinaryOp comparisons[] = {BinaryOp::less, BinaryOp::less_equal, BinaryOp::greater, BinaryOp::greater_equal};
  if (b == nullptr || std::ranges::find(comparisons, b->op) == std::end(comparisons)) return {value(e).number};
  const double left = value(b->left).number, right = value(b->right).number;
  if (std::isnan(left) || std::isnan(right)) return {unknown_value};
  return {evaluate_binary(b->op, left, right), left != 0 && std::abs(left - right) <= tie * std::abs(left)};
}

Value Evaluation::value(const Expr& e) {
  return match(
      e->kind,
      [](const Literal& l) {
        return Value{l.value, {}};
      },
      [&](const Param& p) {
        return Value{parameter(p.name), {}};
      },
      [&](const Local& l) { return locals_.at(l.name); }, [&](const Access& a) { return access(a.field, a.offset); },
      [&](const Interp& i) { return interpolate(i); },
      [](const Inside&) {
        return Value{1, {}};
      },
      [&](const Neg& n) { return -value(n.operand); }, [&](const Binary& b) { return binary(b); },
      [&](const Call& c) {
        bool is_known = true;
        const double result = evaluate_call_of(c.fn, c.arguments, [&](const Expr& argument) {
          const double number = value(argument).number;
          is_known = is_known && !std::isnan(number);
          return number;
        });
        return Value{is_known ? result : unknown_value, {}};
      },
      [&](const Select& s) { return select(s); });
}

/// At a kink the tangent is the mean of those of both sides: rounding would choose one of them.
Value Evaluation::select(const Select& s) {
  const auto [truth, is_tie] = condition_of(s.condition);
  if (std::isnan(truth)) return (value(s.yes) + value(s.no)) * Value{unknown_value} + Value{unknown_value};
  Value result = value(truth != 0 ? s.yes : s.no);
  if (!is_tie) return result;
  const Value other = value(truth != 0 ? s.no : s.yes);
  const bool is_kink = std::abs(other.number - result.number) <= tie * std::abs(result.number);
  return is_kink ? (result + other) * Value{0.5} : result;
}

std::vector<Value> Evaluation::stored_values(const Kernel& kernel) {
  locals_.clear();
  for (const Let& let : kernel.lets) locals_[let.name] = value(let.value);
  std::vector<Value> values;
  for (const Store& store : kernel.stores) values.push_back(value(store.value));
  return values;
}

/// What is not perturbed stays frozen in the step, too: stages of the state itself are made with dt = 0, at the point
/// and at its neighbours for their slopes. Else growth by coefficients that change while the step is made would look
/// like growth by the scheme. nullopt where they have no values with dt = 0.
std::optional<std::vector<FrozenValue>> Evaluation::frozen_values(const Kernel& kernel) {
  const double step = std::exchange(dt_, 0);
  std::vector<FrozenValue> result;
  for (const Value& value : stored_values(kernel)) result.emplace_back(value.number);
  for (std::size_t axis = 0; axis < static_cast<std::size_t>(kernel.rank); ++axis) {
    base_[axis] = 1;
    const std::vector<Value> beside = stored_values(kernel);
    base_[axis] = 0;
    for (std::size_t i = 0; i < result.size(); ++i) result[i].slope[axis] = beside[i].number - result[i].value;
  }
  dt_ = step;
  const bool is_known = std::ranges::all_of(result, [](const FrozenValue& v) { return std::isfinite(v.value); });
  return is_known ? std::optional(std::move(result)) : std::nullopt;
}

/// Of a kernel that makes states, and no perturbations: the same for every step, so that it is run once a point.
std::optional<std::vector<Value>> Evaluation::values_of_states(const Kernel& kernel) {
  const auto is_of_states = [&](const Store& store) { return varied_.contains(store.field); };
  if (!std::ranges::all_of(kernel.stores, is_of_states)) return std::nullopt;
  const std::size_t run = runs_++;
  if (run == stages_.size()) stages_.push_back(frozen_values(kernel));
  if (!stages_[run]) return std::nullopt;
  std::vector<Value> values;
  for (const FrozenValue& value : *stages_[run]) values.push_back({value.value, {}, value.slope});
  return values;
}

void Evaluation::run_kernel(const Kernel& kernel) {
  std::optional<std::vector<Value>> values = values_of_states(kernel);
  if (!values) values = stored_values(kernel);
  for (std::size_t i = 0; i < values->size(); ++i) {
    const Store& store = kernel.stores[i];
    const Value& value = (*values)[i];
    is_too_far_ = is_too_far_ || value.form.terms().size() > most_terms;
    Value result = store.accumulate ? field_value(store.field) + value : value;
    if (!waves_.empty() && result.form.terms().size() > terms_beside_waves) {
      add_waves(result, {{{std::exchange(result.form, {}), WaveMultiplier::one()}}, {}});
    }
    fields_[store.field] = std::move(result);
  }
}

}  // namespace dpde::stability
