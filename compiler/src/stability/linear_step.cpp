// SPDX-License-Identifier: Apache-2.0
#include "stability/linear_step.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "stability/coupled_waves.h"
#include "stability/survey.h"
#include "stencil/build.h"
#include "stencil/effects.h"
#include "stencil/passes/passes.h"
#include "stencil/symbol.h"
#include "support/contains.h"
#include "support/evaluate.h"
#include "support/match.h"

namespace dpde::stability {

using namespace stencil;

namespace {

constexpr std::size_t most_terms = 50'000;
constexpr double rounding = 1e-12;              // of sums of weights
constexpr std::size_t terms_beside_waves = 24;  // where more are one component: put into each other, they multiply
constexpr double unknown_value = std::numeric_limits<double>::quiet_NaN();

/// The value at the point, its change from cell to cell, and how it is perturbed.
struct Value {
  double number = 0;
  Form form = {};
  std::array<double, 3> slope = {};  // of fields; no expression has one
};

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

/// One run of the tangent.
class Evaluation {
 public:
  Evaluation(const Module& module, const std::set<std::string>& varied, const FrozenPoint& point, double dt,
             FrozenStages& stages, bool of_constraints)
      : module_(module), varied_(varied), point_(point), dt_(dt), stages_(stages), of_constraints_(of_constraints) {}

  void perturb(const std::string& field, int component) { fields_[field] = {0, Form(component)}; }
  void run(const std::vector<Statement>& body);
  const Value& at(const std::string& field) { return field_value(field); }
  bool is_too_far() const { return is_too_far_; }
  std::vector<WaveSum> take_waves() { return std::move(waves_); }

 private:
  const Value& field_value(const std::string& name);
  double parameter(const std::string& name) const;
  Value access(const std::string& name, const Offset& offset);
  Value interpolate(const Interp& interp);
  Value binary(const Binary& b);
  Value value(const Expr& e);
  double condition_of(const Expr& e);
  std::vector<Value> stored_values(const Kernel& kernel);
  std::optional<std::vector<FrozenValue>> frozen_values(const Kernel& kernel);
  std::optional<std::vector<Value>> values_of_states(const Kernel& kernel);
  void run_kernel(const Kernel& kernel);
  void reduce(const Reduce& reduce);
  std::vector<NumberMonomial> numbers_of(const Expr& symbol);
  void transform(const Transform& transform);
  void add_waves(Value& to, WaveSum waves);
  void run_block(const Solve& solve);
  void solve(const Solve& solve);
  void solve_coupled(const Solve& solve);
  void solve_by_newton(const Solve& solve);
  void repeat(const Repeat& repeat);

  const Module& module_;
  const std::set<std::string>& varied_;
  const FrozenPoint& point_;
  double dt_;
  FrozenStages& stages_;
  const bool of_constraints_;
  std::size_t runs_ = 0;       // of kernels that make states
  std::array<int, 3> base_{};  // the cell that a kernel is run at, from the point
  std::map<std::string, Value> fields_, locals_;
  std::map<std::string, double> counters_;
  std::vector<WaveSum> waves_;
  bool is_too_far_ = false;
};

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
    default: break;
  }
  // What depends on a number that is not known is not known either, conditions too.
  if (std::isnan(left.number) || std::isnan(right.number)) return {unknown_value, {}};
  return {evaluate_binary(b.op, left.number, right.number), {}};
}

bool holds_param(const Expr& e, const std::string& name) {
  if (const Param* param = std::get_if<Param>(&e->kind)) return param->name == name;
  bool found = false;
  for_each_child(e, [&](const Expr& child) { found = found || holds_param(child, name); });
  return found;
}

/// Schemes with a memory ask whether t < dt/2, which is their first step: it is not that one which is analysed, however
/// long the step is.
double Evaluation::condition_of(const Expr& e) {
  if (!holds_param(e, "t") || !holds_param(e, "dt")) return value(e).number;
  const double step = std::exchange(dt_, 0);
  const double condition = value(e).number;
  dt_ = step;
  return condition;
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
        const double a = value(c.arguments.front()).number, b = value(c.arguments.back()).number;
        const bool is_known = !std::isnan(a) && !std::isnan(b);
        return Value{is_known ? evaluate_call(c.fn, a, b) : unknown_value, {}};
      },
      [&](const Select& s) {
        const double condition = condition_of(s.condition);
        if (std::isnan(condition)) return (value(s.yes) + value(s.no)) * Value{unknown_value} + Value{unknown_value};
        return value(condition != 0 ? s.yes : s.no);
      });
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

/// A wave has no mean: its reduction is not perturbed.
void Evaluation::reduce(const Reduce& reduce) {
  const Value field = field_value(reduce.field);
  const bool adds = reduce.kind == Reduction::sum;
  fields_[reduce.result] = {field.number * (adds ? parameter("cells") : 1)};
}

/// In angles: the spacings go into the numbers.
std::vector<NumberMonomial> Evaluation::numbers_of(const Expr& symbol) {
  std::vector<NumberMonomial> numbers;
  for (const Monomial& monomial : polynomial_of(symbol).value_or(std::vector<Monomial>{})) {
    double coefficient = value(monomial.coefficient).number;
    for (std::size_t axis = 0; axis < monomial.powers.size(); ++axis) {
      if (monomial.powers[axis] > 0)
        coefficient /= std::pow(parameter(std::string("h").append(1, "xyz"[axis])), monomial.powers[axis]);
    }
    numbers.push_back({coefficient, monomial.powers});
  }
  return numbers;
}

/// What is not perturbed is taken as a straight line about the point; a state with dt = 0, as those that kernels make.
void Evaluation::transform(const Transform& transform) {
  const bool is_state = varied_.contains(transform.result);
  const double step = is_state ? std::exchange(dt_, 0) : dt_;
  Value result;
  WaveSum waves;
  for (const Transform::Term& term : transform.terms) {
    WaveMultiplier by{term.by.function, {}, numbers_of(term.by.factor), term.by.within_two_thirds};
    if (term.by.function) by.argument = numbers_of(term.by.argument);
    const Value& field = field_value(term.field);
    const double of_constant = by.of_constant();
    const std::array<double, 3> of_slopes = by.of_slopes();
    result.number += of_constant == 0 ? 0 : of_constant * field.number;
    for (std::size_t axis = 0; axis < of_slopes.size(); ++axis) {
      if (field.slope[axis] == 0 && std::isfinite(of_constant)) continue;
      result.number += of_slopes[axis] * field.slope[axis];
      result.slope[axis] += of_constant * field.slope[axis];
    }
    if (by.is_constant()) {
      result.form = result.form.plus(field.form.times(of_constant));
    } else if (!field.form.is_zero()) {
      waves.terms.push_back({field.form, std::move(by)});
    }
  }
  dt_ = step;
  if (!waves.terms.empty()) add_waves(result, std::move(waves));
  fields_[transform.result] = std::move(result);
}

void Evaluation::add_waves(Value& to, WaveSum waves) {
  to.form = to.form.plus(Form(most_states + static_cast<int>(waves_.size())));
  waves_.push_back(std::move(waves));
  is_too_far_ = is_too_far_ || most_states + waves_.size() >= most_components;
}

/// Nothing in it is a stage of the states.
void Evaluation::run_block(const Solve& solve) {
  for (const Statement& statement : solve.body) {
    const Run* run = std::get_if<Run>(&statement);
    if (run == nullptr) continue;
    const Kernel& kernel = kernel_of(module_, *run);
    const std::vector<Value> values = stored_values(kernel);
    for (std::size_t i = 0; i < values.size(); ++i) fields_[kernel.stores[i].field] = values[i];
  }
}

/// What is not perturbed is nothing here but rates, which are 0.
void Evaluation::solve_coupled(const Solve& solve) {
  const std::size_t count = solve.unknowns.size();
  std::vector<std::vector<Form>> matrix(count, std::vector<Form>(count));
  std::vector<Form> rights;
  for (const std::string& right : solve.rights) rights.push_back(field_value(right).form);
  for (std::size_t k = 0; k < count; ++k) {
    for (std::size_t i = 0; i < count; ++i) fields_[solve.unknowns[i]] = {0, i == k ? Form(0) : Form()};
    run_block(solve);
    for (std::size_t i = 0; i < count; ++i) matrix[i][k] = field_value(solve.images[i]).form;
  }
  std::vector<WaveSum> waves = coupled_waves(matrix, rights);
  for (std::size_t i = 0; i < count; ++i) {
    Value& result = fields_[solve.unknowns[i]] = {};
    if (!waves.empty()) add_waves(result, std::move(waves[i]));
  }
}

/// Stages of states are taken at dt = 0, where each is its right side, if the block is one of a time scheme.
void Evaluation::solve_by_newton(const Solve& solve) {
  const double step = std::exchange(dt_, 0);
  for (std::size_t i = 0; i < solve.unknowns.size(); ++i) {
    const Value right = field_value(solve.rights[i]);
    fields_[solve.unknowns[i]] = {right.number, {}, right.slope};
  }
  run_block(solve);
  dt_ = step;
  for (std::size_t i = 0; i < solve.unknowns.size(); ++i) {
    const double made = field_value(solve.images[i]).number, right = field_value(solve.rights[i]).number;
    is_too_far_ = is_too_far_ || std::abs(made - right) > rounding * std::abs(right);
  }
}

/// Waves are divided by what the block makes of them. What is not perturbed is a straight line about the point.
void Evaluation::solve(const Solve& solve) {
  if (!solve.is_linear) return solve_by_newton(solve);
  if (solve.unknowns.size() > 1) return solve_coupled(solve);
  const bool is_state = varied_.contains(solve.unknowns.front());
  const double step = is_state ? std::exchange(dt_, 0) : dt_;
  fields_[solve.unknowns.front()] = {0, Form(0)};
  run_block(solve);
  const Form image = field_value(solve.images.front()).form;
  dt_ = step;
  double of_constant = 0, of_all = 0;
  std::array<double, 3> of_slopes{};
  for (const Form::Term& term : image.terms()) {
    of_constant += term.coefficient;
    of_all += std::abs(term.coefficient);
    const Offset offset = Form::offset_of(term.key);
    for (std::size_t axis = 0; axis < of_slopes.size(); ++axis) of_slopes[axis] += term.coefficient * offset[axis];
  }
  if (std::abs(of_constant) < rounding * of_all) of_constant = 0;
  const Value& right = field_value(solve.rights.front());
  Value result{right.number / of_constant, {}, right.slope};
  for (std::size_t axis = 0; axis < of_slopes.size(); ++axis) {
    result.slope[axis] /= of_constant;
    result.number -= of_slopes[axis] * result.slope[axis] / of_constant;
  }
  if (of_constant == 0 && of_constraints_) result = {0, {}, {}};
  if (!right.form.is_zero() && !image.is_zero()) add_waves(result, {{{right.form, WaveMultiplier::one()}}, image});
  fields_[solve.unknowns.front()] = std::move(result);
  fields_[solve.images.front()] = right;
}

/// Outside, what it carries keeps its value.
void Evaluation::repeat(const Repeat& repeat) {
  std::map<std::string, Value> outside, results;
  for (const Carry& carry : repeat.carries) outside[carry.state] = field_value(carry.state);
  for (int k = 0; k < repeat.count; ++k) {
    counters_[repeat.counter.name] = repeat.counter.is_backwards ? repeat.count - 1 - k : k;
    run(repeat.body);
    std::map<std::string, Value> next;
    for (const Carry& carry : repeat.carries) next[carry.state] = results[carry.result] = field_value(carry.next);
    for (auto& [state, value] : next) fields_[state] = std::move(value);
  }
  counters_.erase(repeat.counter.name);
  for (auto& [state, value] : outside) fields_[state] = std::move(value);
  for (auto& [result, value] : results) fields_[result] = std::move(value);
}

void Evaluation::run(const std::vector<Statement>& body) {
  for (const Statement& statement : body) {
    match(
        statement, [](const Fill&) {}, [](const Fold&) {}, [&](const Reduce& r) { reduce(r); },
        [](const NetworkCall&) {}, [&](const Transform& t) { transform(t); },
        [&](const Run& r) { run_kernel(kernel_of(module_, r)); }, [&](const Solve& s) { solve(s); },
        [&](const Repeat& r) { repeat(r); });
    if (is_too_far_) return;
  }
}

}  // namespace

std::optional<LinearStep> LinearStep::make(const Module& module, const std::string& step, std::string& why,
                                           bool of_constraints) {
  const Program* program = module.find_program(step);
  if (program == nullptr || program->swaps.empty()) {
    why = "the program has no states";
    return std::nullopt;
  }
  if (program->swaps.size() > most_states) {
    why = "it has too many states";
    return std::nullopt;
  }
  adjoint::Activity states;
  for (const Swap& swap : program->swaps) states.fields.insert(swap.state);
  DiagnosticSink sink;
  adjoint::Derivative tangent = adjoint::tangent(module, step, states, sink);
  if (sink.has_errors()) {
    why = "it has no tangent";
    return std::nullopt;
  }
  LinearStep result;
  Program& derived = tangent.module.programs.front();
  std::erase_if(derived.swaps, [&](const Swap& swap) { return states.fields.contains(swap.state); });
  derived.keeps.clear();
  for (const Swap& swap : program->swaps) {
    const std::string *before = tangent.field(swap.state), *behind = tangent.field(swap.next);
    result.states_.push_back(swap.state);
    result.perturbations_.push_back(before == nullptr ? "" : *before);
    result.results_.push_back(behind == nullptr ? "" : *behind);
  }
  for (const adjoint::Link& link : tangent.links) {
    if (link.kind == adjoint::Link::Kind::field) result.varied_.insert(link.primal);
  }
  result.module_ = remove_dead_code(tangent.module);
  Survey found;
  survey(result.module_, result.program().body, found);
  result.follows_flow_ = found.follows_flow;
  result.reduces_ = found.reduces;
  result.solves_ = found.solves;
  result.of_constraints_ = of_constraints;
  for (const std::string& input : interface_of(result.module_, result.program()).inputs) {
    if (!contains(result.perturbations_, input)) result.inputs_.push_back(input);
  }
  why = found.why;
  return why.empty() ? std::optional(std::move(result)) : std::nullopt;
}

std::optional<Response> LinearStep::response(const FrozenPoint& point, double dt) const {
  FrozenStages stages;
  return response(point, dt, stages);
}

std::optional<Response> LinearStep::response(const FrozenPoint& point, double dt, FrozenStages& stages) const {
  Evaluation evaluation(module_, varied_, point, dt, stages, of_constraints_);
  for (std::size_t s = 0; s < states_.size(); ++s) {
    if (!perturbations_[s].empty()) evaluation.perturb(perturbations_[s], static_cast<int>(s));
  }
  evaluation.run(program().body);
  if (evaluation.is_too_far()) return std::nullopt;
  Response response;
  for (const std::string& result : results_)
    response.rows.push_back(result.empty() ? Form() : evaluation.at(result).form);
  response.waves = evaluation.take_waves();
  const bool is_finite =
      std::ranges::all_of(response.rows, &Form::is_finite) && std::ranges::all_of(response.waves, &WaveSum::is_finite);
  return is_finite ? std::optional(std::move(response)) : std::nullopt;
}

}  // namespace dpde::stability
