// SPDX-License-Identifier: Apache-2.0
#include "stability/frozen/frozen_evaluation.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "support/assert.h"
#include "support/match.h"
#include "support/maths/evaluate.h"

namespace dpde::stability {

using namespace stencil;

namespace {

constexpr std::size_t most_terms = 50'000;
constexpr std::size_t terms_beside_waves =
    24;                        // longer forms become one component, as their substitution multiplies terms
constexpr double tie = 1e-11;  // relative: above rounding, below the tolerance of equality in a maximum

/// A cell along one axis that an interpolation reads, with its weight.
struct Tap {
  int cell;
  double weight;
};

std::vector<Tap> taps_along(double displacement, InterpolationBasis along) {
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

NumbersOfStep::NumbersOfStep(const FrozenKernels& kernels, const FrozenPoint& point, double dt)
    : kernels_(kernels), point_(point), dt_(dt), dt_param_(kernels.param("dt")) {
  for (const std::string& name : kernels.params()) params_.push_back(parameter(name));
  for (std::size_t axis = 0; axis < spacing_.size(); ++axis)
    spacing_[axis] = parameter(std::string("h").append(1, "xyz"[axis]));
}

double NumbersOfStep::parameter(Id param) const {
  if (param == dt_param_) return dt_;
  return params_[static_cast<std::size_t>(param)];
}

double NumbersOfStep::parameter(const std::string& name) const {
  if (const auto counter = counters_.find(name); counter != counters_.end()) return counter->second;
  if (name == "dt") return dt_;
  const auto known = point_.params.find(name);
  return known == point_.params.end() ? unknown_value : known->second;
}

/// Names of counters are unique in the program.
void NumbersOfStep::count(const std::string& counter, double number) {
  counters_[counter] = number;
  if (const Id param = kernels_.param(counter); param >= 0) params_[static_cast<std::size_t>(param)] = number;
}

Evaluation::Evaluation(const FrozenKernels& kernels, const std::set<std::string>& varied,
                       const std::set<std::string>& rates, const FrozenPoint& point, double dt, FrozenStages& stages,
                       bool of_constraints)
    : kernels_(kernels),
      varied_(varied),
      rates_(rates),
      numbers_(kernels, point, dt),
      stages_(stages),
      of_constraints_(of_constraints),
      fields_(kernels.fields().size()),
      is_set_(fields_.size()) {}

void Evaluation::set(Id field, Value value) {
  const auto number = static_cast<std::size_t>(field);
  fields_[number] = std::move(value);
  is_set_[number] = true;
}

const Value& Evaluation::field_value(Id field) {
  const auto number = static_cast<std::size_t>(field);
  if (!is_set_[number]) {
    const auto& fields = numbers_.point().fields;
    const auto known = fields.find(kernels_.fields()[number].name);
    fields_[number].number = known == fields.end() ? unknown_value : known->second.value;
    if (known != fields.end()) fields_[number].slope = known->second.slope;
    is_set_[number] = true;
  }
  return fields_[number];
}

double Evaluation::coordinate(int axis, const Offset& offset) const {
  const auto a = static_cast<std::size_t>(axis);
  if (numbers_.point().are_coordinates_flat) return numbers_.point().place[a];
  return numbers_.point().place[a] + (offset[a] + base_[a]) * numbers_.spacing(a);
}

double Evaluation::number_at(Id field, const Offset& offset) {
  const int axis = kernels_.fields()[static_cast<std::size_t>(field)].axis;
  if (axis >= 0) return coordinate(axis, offset);
  const Value& value = field_value(field);
  double number = value.number;
  for (std::size_t a = 0; a < offset.size(); ++a)
    number += value.slope[a] == 0 ? 0 : value.slope[a] * (offset[a] + base_[a]);
  return number;
}

template <class Tell>
void Evaluation::for_each_tap(const FrozenKernels::Interp& interp, const Tell& tell) {
  std::array<std::vector<Tap>, 3> taps;
  taps.fill({{0, 1}});
  for (std::size_t axis = 0; axis < interp.displacement.size(); ++axis) {
    const double displacement = number(interp.displacement[axis]);
    is_too_far_ = is_too_far_ || !(std::abs(displacement) < farthest_offset / 4);
    if (is_too_far_) return;
    displacement_ = std::max(displacement_, std::abs(displacement));
    taps[axis] = taps_along(displacement, interp.along[axis]);
  }
  for (const Tap& z : taps[2]) {
    for (const Tap& y : taps[1]) {
      for (const Tap& x : taps[0]) {
        const Offset place{interp.offset[0] + x.cell, interp.offset[1] + y.cell, interp.offset[2] + z.cell};
        tell(place, x.weight * y.weight * z.weight);
      }
    }
  }
}

double Evaluation::number_of_interp(const FrozenKernels::Interp& interp) {
  double sum = 0;
  for_each_tap(interp, [&](const Offset& place, double weight) { sum += number_at(interp.field, place) * weight; });
  return sum;
}

namespace {

/// The result is unknown (NaN) if an operand is, for comparisons, too.
double known_binary(BinaryOp op, double left, double right) {
  return std::isnan(left) || std::isnan(right) ? unknown_value : evaluate_binary(op, left, right);
}

}  // namespace

double Evaluation::number_of_binary(const FrozenKernels::Binary& b) {
  const double left = number(b.left), right = number(b.right);
  switch (b.op) {
    case BinaryOp::add: return left + right;
    case BinaryOp::subtract: return left - right;
    case BinaryOp::multiply: return left * right;
    case BinaryOp::divide: return left / right;
    case BinaryOp::power: return std::pow(left, right);
    case BinaryOp::less:
    case BinaryOp::less_equal:
    case BinaryOp::greater:
    case BinaryOp::greater_equal:
    case BinaryOp::equal:
    case BinaryOp::not_equal:
    case BinaryOp::logical_and:
    case BinaryOp::logical_or: return known_binary(b.op, left, right);
  }
  unreachable("binary operator");
}

/// A tie: both sides are equal up to rounding, and not 0. An example are two differences along a straight line.
Evaluation::Condition Evaluation::compared(Id node) {
  const auto* b = std::get_if<FrozenKernels::Binary>(&kernels_.node(node).kind);
  constexpr BinaryOp comparisons[] = {BinaryOp::less, BinaryOp::less_equal, BinaryOp::greater, BinaryOp::greater_equal};
  if (b == nullptr || std::ranges::find(comparisons, b->op) == std::end(comparisons)) return {number(node)};
  const double left = number(b->left), right = number(b->right);
  if (std::isnan(left) || std::isnan(right)) return {unknown_value};
  return {evaluate_binary(b->op, left, right), left != 0 && std::abs(left - right) <= tie * std::abs(left)};
}

double Evaluation::call(const FrozenKernels::Call& c) {
  bool is_known = true;
  const double result = evaluate_call_of(c.fn, c.arguments, [&](Id argument) {
    const double of_argument = number(argument);
    is_known = is_known && !std::isnan(of_argument);
    return of_argument;
  });
  return is_known ? result : unknown_value;
}

double Evaluation::number(Id id) {
  return match(
      kernels_.node(id).kind, [](const FrozenKernels::Literal& l) { return l.value; },
      [&](const FrozenKernels::Param& p) { return numbers_.parameter(p.param); },
      [&](const FrozenKernels::Local& l) { return locals_[static_cast<std::size_t>(l.local)].number; },
      [&](const FrozenKernels::Access& a) { return number_at(a.field, a.offset); },
      [&](const FrozenKernels::Interp& i) { return number_of_interp(i); },
      [](const FrozenKernels::Inside&) { return 1.0; }, [&](const FrozenKernels::Neg& n) { return -number(n.operand); },
      [&](const FrozenKernels::Binary& b) { return number_of_binary(b); },
      [&](const FrozenKernels::Call& c) { return call(c); },
      [&](const FrozenKernels::Select& s) { return number_of_select(s); });
}

LinearForm Evaluation::form(Id id) {
  if (kernels_.node(id).is_number) return {};
  add_form(id, 1);
  return sum_.take();
}

/// A node is linear in perturbations, so a sum is added part by part, each with its factor. Each term of a part is thus
/// added once, at any depth.
void Evaluation::add_form(Id id, double factor) {
  const FrozenKernels::Node& node = kernels_.node(id);
  if (node.is_number) return;
  match(
      node.kind, ignored<FrozenKernels::Literal, FrozenKernels::Param, FrozenKernels::Inside, FrozenKernels::Call>,
      [&](const FrozenKernels::Local& l) { sum_.add(locals_[static_cast<std::size_t>(l.local)].form, {}, factor); },
      [&](const FrozenKernels::Access& a) { add_form_of(a.field, a.offset, factor); },
      [&](const FrozenKernels::Interp& i) {
        for_each_tap(i, [&](const Offset& place, double weight) {
          if (weight != 0) add_form_of(i.field, place, factor * weight);
        });
      },
      [&](const FrozenKernels::Neg& n) { add_form(n.operand, -factor); },
      [&](const FrozenKernels::Binary& b) { add_form_of_binary(b, factor); },
      [&](const FrozenKernels::Select& s) { add_form_of_select(s, factor); });
}

void Evaluation::add_form_of(Id field, const Offset& offset, double factor) {
  if (kernels_.fields()[static_cast<std::size_t>(field)].axis >= 0) return;
  sum_.add(field_value(field).form, offset, factor);
}

void Evaluation::add_form_of_binary(const FrozenKernels::Binary& b, double factor) {
  // A factor 0 adds no terms, not terms with coefficient 0.
  const auto add_times = [&](Id perturbed, Id by) {
    if (kernels_.node(perturbed).is_number) return;
    const double times = number(by);
    if (times != 0) {
      add_form(perturbed, factor * times);
    } else {
      number(perturbed);  // for its check whether an interpolation is too far
    }
  };
  switch (b.op) {
    case BinaryOp::add: add_form(b.left, factor), add_form(b.right, factor); return;
    case BinaryOp::subtract: add_form(b.left, factor), add_form(b.right, -factor); return;
    case BinaryOp::multiply: add_times(b.left, b.right), add_times(b.right, b.left); return;
    case BinaryOp::divide:
      if (const double by = 1 / number(b.right); by != 0) add_form(b.left, factor * by);
      return;
    case BinaryOp::power:
    case BinaryOp::less:
    case BinaryOp::less_equal:
    case BinaryOp::greater:
    case BinaryOp::greater_equal:
    case BinaryOp::equal:
    case BinaryOp::not_equal:
    case BinaryOp::logical_and:
    case BinaryOp::logical_or: return;
  }
  unreachable("binary operator");
}

/// At a kink the tangent is the mean of both sides' tangents: otherwise rounding would choose a side.
void Evaluation::add_form_of_select(const FrozenKernels::Select& s, double factor) {
  const auto [truth, is_tie] = compared(s.condition);
  if (std::isnan(truth)) {
    add_form(s.yes, unknown_value), add_form(s.no, unknown_value);
    return;
  }
  const Id taken = truth != 0 ? s.yes : s.no, left_out = truth != 0 ? s.no : s.yes;
  const double result = is_tie ? number(taken) : 0, other = is_tie ? number(left_out) : 0;
  const bool is_kink = is_tie && std::abs(other - result) <= tie * std::abs(result);
  add_form(taken, is_kink ? 0.5 * factor : factor);
  if (is_kink) add_form(left_out, 0.5 * factor);
}

double Evaluation::number_of_select(const FrozenKernels::Select& s) {
  const auto [truth, is_tie] = compared(s.condition);
  if (std::isnan(truth)) return unknown_value;
  const double result = number(truth != 0 ? s.yes : s.no);
  if (!is_tie) return result;
  const double other = number(truth != 0 ? s.no : s.yes);
  return std::abs(other - result) <= tie * std::abs(result) ? 0.5 * (result + other) : result;
}

std::vector<Value> Evaluation::stored_values(const FrozenKernels::Kernel& kernel) {
  locals_.resize(kernel.lets.size());
  for (std::size_t i = 0; i < kernel.lets.size(); ++i) locals_[i] = value(kernel.lets[i]);
  std::vector<Value> values;
  values.reserve(kernel.stores.size());
  for (const FrozenKernels::Store& store : kernel.stores)
    values.push_back({store.is_perturbation ? 0 : number(store.value), form(store.value)});
  return values;
}

/// Unperturbed values stay frozen within the step: the stages of the states are computed with dt = 0, at the point and
/// at its neighbours for the slopes. Otherwise growth by coefficients that change during the step would look like
/// growth by the scheme. nullopt if they have no values with dt = 0.
std::optional<std::vector<FrozenValue>> Evaluation::frozen_values(const FrozenKernels::Kernel& kernel) {
  const double step = numbers_.set_step(0);
  std::vector<FrozenValue> result;
  for (const Value& value : stored_values(kernel)) result.emplace_back(value.number);
  for (std::size_t axis = 0; axis < static_cast<std::size_t>(kernel.rank); ++axis) {
    base_[axis] = 1;
    const std::vector<Value> beside = stored_values(kernel);
    base_[axis] = 0;
    for (std::size_t i = 0; i < result.size(); ++i) result[i].slope[axis] = beside[i].number - result[i].value;
  }
  numbers_.set_step(step);
  const bool is_known = std::ranges::all_of(result, [](const FrozenValue& v) { return std::isfinite(v.value); });
  return is_known ? std::optional(std::move(result)) : std::nullopt;
}

/// The results of a kernel that computes states and no perturbations. They do not depend on dt, so the kernel runs once
/// per point.
std::optional<std::vector<Value>> Evaluation::values_of_states(const FrozenKernels::Kernel& kernel) {
  if (!kernel.makes_states) return std::nullopt;
  const std::size_t run = runs_++;
  if (run == stages_.size()) stages_.push_back(frozen_values(kernel));
  if (!stages_[run]) return std::nullopt;
  std::vector<Value> values;
  for (const FrozenValue& value : *stages_[run]) values.push_back({value.value, {}, value.slope});
  return values;
}

namespace {

Value with_sum_of_slopes(const Value& a, const Value& b) {
  Value sum{a.number + b.number, a.form.plus(b.form)};
  for (std::size_t axis = 0; axis < sum.slopes_of_form.size(); ++axis)
    sum.slopes_of_form[axis] = a.slopes_of_form[axis].plus(b.slopes_of_form[axis]);
  return sum;
}

LinearForm mean_slope(const LinearForm& below, const LinearForm& above) {
  LinearForm slope = above.plus(below.times(-1)).times(0.5);
  const bool varies =
      std::ranges::any_of(slope.terms(), [](const LinearForm::Term& term) { return term.coefficient != 0; });
  return varies ? slope : LinearForm();
}

}  // namespace

/// A transform of a product makes of a coefficient that varies what differences make of its values at the neighbours:
/// of psi times a slope of w a bracket has its wind from the slope of psi alone. What is a stage of the states' own
/// perturbations stays frozen while the step is made, as the states do: what there is with dt = 0 has slopes with dt =
/// 0.
void Evaluation::add_slopes_of_forms(const FrozenKernels::Kernel& kernel, std::vector<Value>& values) {
  const auto varies = [&](std::size_t store, std::size_t axis) {
    const auto field = static_cast<std::size_t>(kernel.stores[store].field);
    return kernels_.fields()[field].waves[axis] && !values[store].form.is_zero();
  };
  const auto slopes_along = [&](std::size_t axis, double step) {
    const double whole_step = numbers_.set_step(step);
    base_[axis] = -1;
    const std::vector<Value> below = stored_values(kernel);
    base_[axis] = 1;
    const std::vector<Value> above = stored_values(kernel);
    base_[axis] = 0;
    numbers_.set_step(whole_step);
    std::vector<LinearForm> slopes;
    for (std::size_t i = 0; i < below.size(); ++i) slopes.push_back(mean_slope(below[i].form, above[i].form));
    return slopes;
  };
  std::vector<Value> at_rest;
  for (std::size_t axis = 0; axis < base_.size(); ++axis) {
    std::vector<LinearForm> slopes, slopes_at_rest;
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (!varies(i, axis)) continue;
      if (at_rest.empty()) {
        const double step = numbers_.set_step(0);
        at_rest = stored_values(kernel);
        numbers_.set_step(step);
      }
      const bool is_there_at_rest = !at_rest[i].form.is_zero() && at_rest[i].form.is_finite();
      std::vector<LinearForm>& known = is_there_at_rest ? slopes_at_rest : slopes;
      if (known.empty()) known = slopes_along(axis, is_there_at_rest ? 0 : numbers_.step());
      values[i].slopes_of_form[axis] = known[i];
    }
  }
}

void Evaluation::run_kernel(const FrozenKernels::Kernel& kernel) {
  std::optional<std::vector<Value>> values = values_of_states(kernel);
  if (!values) {
    values = stored_values(kernel);
    add_slopes_of_forms(kernel, *values);
  }
  for (std::size_t i = 0; i < values->size(); ++i) {
    const FrozenKernels::Store& store = kernel.stores[i];
    Value& value = (*values)[i];
    is_too_far_ = is_too_far_ || value.form.terms().size() > most_terms;
    if (store.accumulate) value = with_sum_of_slopes(field_value(store.field), value);
    Value result = std::move(value);
    if (!waves_.empty() && result.form.terms().size() > terms_beside_waves) {
      WaveSum all{{{std::exchange(result.form, {}), WaveMultiplier::one()}}, {}};
      add_waves(result.form, std::move(all));
    }
    set(store.field, std::move(result));
  }
}

}  // namespace dpde::stability
