// SPDX-License-Identifier: Apache-2.0
// Statements that are no kernels: reductions, transforms, solves, repeats.
#include <algorithm>
#include <cmath>
#include <utility>

#include "stability/frozen/frozen_evaluation.h"
#include "stability/waves/coupled_waves.h"
#include "stencil/analyse/symbol.h"
#include "stencil/build.h"
#include "support/assert.h"
#include "support/match.h"
#include "support/maths/evaluate.h"

namespace dpde::stability {

using namespace stencil;

namespace {

constexpr double sum_rounding = 1e-12;  // of sums of weights

bool reads_neighbours(const LinearForm& image) {
  return std::ranges::any_of(image.terms(), [](const LinearForm::Term& term) {
    return term.coefficient != 0 && LinearForm::offset_of(term.key) != Offset{};
  });
}

Value divided(const Value& right, const LinearForm& image) {
  double by = 0;
  for (const LinearForm::Term& term : image.terms()) by += term.coefficient;
  Value result{right.number / by, {}, right.slope};
  for (double& slope : result.slope) slope /= by;
  return result;
}

}  // namespace

/// Means and sums of perturbations act only on waves that are constant along their axes. The derivative of max and min
/// acts on one cell and is left out. Unperturbed results are those of the whole grid, if known.
void Evaluation::reduce(const Reduce& reduce) {
  const Value field = field_value(reduce.field);
  const bool is_of_all = reduce.over == std::array<bool, max_rank>{};
  WaveMultiplier by = WaveMultiplier::one();
  double cells = 1;
  for (std::size_t axis = 0; axis < by.means.size(); ++axis) {
    by.means[axis] = is_of_all || reduce.over[axis];
    if (by.means[axis]) cells *= numbers_.point().cells[axis];
  }
  const double factor = reduce.kind == Reduction::sum ? cells : 1;
  const auto known = numbers_.point().whole.find(reduce.result);
  Value result{field.number * factor};
  if (known != numbers_.point().whole.end()) result = {known->second.value, {}, known->second.slope};
  const bool is_linear = reduce.kind == Reduction::sum || reduce.kind == Reduction::mean;
  if (is_linear && !field.form.is_zero()) add_waves(result.form, {{{field.form.times(factor), by}}, {}});
  set(reduce.result, std::move(result));
}

double Evaluation::number_of(const Expr& e) const {
  const auto no = [](const auto&) -> double { unreachable("a multiplier of what is no number"); };
  return match(
      e->kind, [](const Literal& l) { return l.value; }, [&](const Param& p) { return numbers_.parameter(p.name); },
      [&](const Local& l) { return no(l); }, [&](const Access& a) { return no(a); },
      [&](const Interp& i) { return no(i); }, [&](const Inside& i) { return no(i); },
      [&](const Neg& n) { return -number_of(n.operand); },
      [&](const Binary& b) { return evaluate_binary(b.op, number_of(b.left), number_of(b.right)); },
      [&](const Call& c) {
        return evaluate_call_of(c.fn, c.arguments, [&](const Expr& argument) { return number_of(argument); });
      },
      [&](const Select& s) { return number_of(number_of(s.condition) != 0 ? s.yes : s.no); });
}

/// The symbol in angles: spacings are part of the coefficients.
std::vector<NumberMonomial> Evaluation::numbers_of(const Expr& symbol) const {
  std::vector<NumberMonomial> numbers;
  for (const Monomial& monomial : kernels_.polynomial(symbol)) {
    double coefficient = number_of(monomial.coefficient);
    for (std::size_t axis = 0; axis < monomial.powers.size(); ++axis) {
      if (monomial.powers[axis] > 0) coefficient /= std::pow(numbers_.spacing(axis), monomial.powers[axis]);
    }
    numbers.push_back({coefficient, monomial.powers, monomial.vanishes});
  }
  return numbers;
}

/// Unperturbed fields are taken as linear about the point, states with dt = 0 as in kernels.
void Evaluation::transform(const Transform& transform) {
  const bool is_state = varied_.contains(transform.result);
  const double step = is_state ? numbers_.set_step(0) : numbers_.step();
  Value result;
  WaveSum waves;
  std::array<WaveSum, 3> slopes;
  bool solves = false;
  for (const Transform::Term& term : transform.terms) {
    const WaveMultiplier by = multiplier_of(term);
    solves = solves || by.solves();
    const Value& field = field_value(term.field);
    const double of_constant = by.of_constant();
    const std::array<double, 3> of_slopes = by.of_slopes();
    result.number += of_constant == 0 ? 0 : of_constant * field.number;
    for (std::size_t axis = 0; axis < of_slopes.size(); ++axis) {
      if (field.slope[axis] == 0 && std::isfinite(of_constant)) continue;
      result.number += of_slopes[axis] * field.slope[axis];
      result.slope[axis] += of_constant * field.slope[axis];
    }
    add_waves_of(term, by, result, waves, slopes);
  }
  numbers_.set_step(step);
  if (rates_.contains(transform.result)) {
    result = {0, std::move(result.form)};
  } else if (solves) {
    result = solved(transform.result, "");
  }
  if (!waves.terms.empty()) add_waves(result.form, std::move(waves));
  const FrozenKernels::Field& made = kernels_.fields()[static_cast<std::size_t>(kernels_.field(transform.result))];
  for (std::size_t axis = 0; axis < slopes.size(); ++axis) {
    const bool counts = made.waves[axis] && !slopes[axis].terms.empty();
    if (counts) add_waves(result.slopes_of_form[axis], std::move(slopes[axis]));
  }
  set(transform.result, std::move(result));
}

WaveMultiplier Evaluation::multiplier_of(const Transform::Term& term) const {
  WaveMultiplier by{term.by.function, {}, numbers_of(term.by.factor), term.by.within_two_thirds};
  if (term.by.function) by.argument = numbers_of(term.by.argument);
  return by;
}

/// Of a product whose coefficients are straight lines, and of how they change in what it gives. A multiplier that
/// varies with dt is a part of a step, in which coefficients are frozen: with dt = 0 it has none of it.
void Evaluation::add_waves_of(const Transform::Term& term, const WaveMultiplier& by, Value& result, WaveSum& waves,
                              std::array<WaveSum, 3>& slopes) {
  const auto add = [&](const LinearForm& form, const WaveMultiplier& multiplier) {
    if (multiplier.is_constant()) {
      result.form = result.form.plus(form.times(multiplier.of_constant()));
    } else if (!form.is_zero()) {
      waves.terms.push_back({form, multiplier});
    }
  };
  const Value& field = field_value(term.field);
  add(field.form, by);
  for (std::size_t axis = 0; axis < slopes.size(); ++axis) {
    const LinearForm& slope = field.slopes_of_form[axis];
    if (slope.is_zero()) continue;
    const double step = numbers_.set_step(0);
    const WaveMultiplier at_rest = multiplier_of(term);
    numbers_.set_step(step);
    for (const WaveMultiplier& part : by.derivatives(axis, at_rest.argument)) add(slope, part);
    if (!at_rest.is_zero()) slopes[axis].terms.push_back({slope, at_rest});
  }
}

void Evaluation::add_waves(LinearForm& to, WaveSum waves) {
  to = to.plus(LinearForm(most_states + static_cast<int>(waves_.size())));
  waves_.push_back(std::move(waves));
  is_too_far_ = is_too_far_ || most_states + waves_.size() >= most_components;
}

/// The solution at the initial state, which all stages have here.
Value Evaluation::solved(const std::string& field, const std::string& unknown) const {
  auto known = numbers_.point().whole.find(field);
  if (known == numbers_.point().whole.end()) known = numbers_.point().whole.find(unknown);
  return known == numbers_.point().whole.end() ? Value{unknown_value}
                                               : Value{known->second.value, {}, known->second.slope};
}

/// Runs a block of a solve; it contains no stage of the states.
void Evaluation::run_block(const Solve& solve) {
  for (const Statement& statement : solve.body) {
    match(
        statement, ignored<Fill>,
        [&](const Run& run) {
          const FrozenKernels::Kernel& kernel = kernels_.kernel(run.kernel);
          std::vector<Value> values = stored_values(kernel);
          for (std::size_t i = 0; i < values.size(); ++i) set(kernel.stores[i].field, std::move(values[i]));
        },
        [](const OneOf<Fold, Reduce, NetworkCall, Transform, Solve, Repeat> auto&) {
          unreachable("a statement that step_capabilities.h refuses in the block of a solve");
        });
  }
}

/// Unperturbed solutions have their known values; perturbations are 0 there.
void Evaluation::solve_coupled(const Solve& solve) {
  const std::size_t count = solve.unknowns.size();
  std::vector<std::vector<LinearForm>> matrix(count, std::vector<LinearForm>(count));
  std::vector<LinearForm> rights;
  for (const std::string& right : solve.rights) rights.push_back(field_value(right).form);
  for (std::size_t k = 0; k < count; ++k) {
    for (std::size_t i = 0; i < count; ++i) set(solve.unknowns[i], {0, i == k ? LinearForm(0) : LinearForm()});
    run_block(solve);
    for (std::size_t i = 0; i < count; ++i) matrix[i][k] = field_value(solve.images[i]).form;
  }
  std::vector<WaveSum> waves = coupled_waves(matrix, rights);
  for (std::size_t i = 0; i < count; ++i) {
    Value result;
    if (!rates_.contains(solve.unknowns[i])) result = solved(solve.unknowns[i], solve.written.field);
    if (!waves.empty()) add_waves(result.form, std::move(waves[i]));
    set(solve.unknowns[i], std::move(result));
  }
}

/// Stages of states are computed at dt = 0. In a block of a time scheme each is then its right-hand side.
void Evaluation::solve_by_newton(const Solve& solve) {
  const double step = numbers_.set_step(0);
  for (std::size_t i = 0; i < solve.unknowns.size(); ++i) {
    const Value right = field_value(solve.rights[i]);
    set(solve.unknowns[i], {right.number, {}, right.slope});
  }
  run_block(solve);
  numbers_.set_step(step);
  for (std::size_t i = 0; i < solve.unknowns.size(); ++i) {
    const double made = field_value(solve.images[i]).number, right = field_value(solve.rights[i]).number;
    is_too_far_ = is_too_far_ || std::abs(made - right) > sum_rounding * std::abs(right);
  }
}

/// Waves are divided by the symbol of the block. The unperturbed solution is linear about the point: computed from the
/// right-hand side if the block reads no neighbours, else the known solution.
void Evaluation::solve(const Solve& solve) {
  if (!solve.is_linear) return solve_by_newton(solve);
  if (solve.unknowns.size() > 1) return solve_coupled(solve);
  const bool is_state = varied_.contains(solve.unknowns.front());
  const double step = is_state ? numbers_.set_step(0) : numbers_.step();
  set(solve.unknowns.front(), {0, LinearForm(0)});
  run_block(solve);
  const LinearForm image = field_value(solve.images.front()).form;
  numbers_.set_step(step);
  const Value right = field_value(solve.rights.front());
  Value result;
  if (!rates_.contains(solve.unknowns.front())) {
    if (!reads_neighbours(image)) {
      result = divided(right, image);
    } else if (!of_constraints_) {
      result = solved(solve.unknowns.front(), solve.written.field);
    }
  }
  if (!right.form.is_zero() && !image.is_zero()) add_waves(result.form, {{{right.form, WaveMultiplier::one()}}, image});
  set(solve.unknowns.front(), std::move(result));
  set(solve.images.front(), right);
}

/// Fields that the loop carries keep their values outside of it.
void Evaluation::repeat(const Repeat& repeat) {
  std::map<std::string, Value> outside, results;
  for (const LoopCarried& carry : repeat.carries) outside[carry.state] = field_value(carry.state);
  for (int k = 0; k < repeat.count; ++k) {
    numbers_.count(repeat.counter.name, repeat.counter.is_backwards ? repeat.count - 1 - k : k);
    run(repeat.body);
    std::map<std::string, Value> next;
    for (const LoopCarried& carry : repeat.carries) next[carry.state] = results[carry.result] = field_value(carry.next);
    for (auto& [state, value] : next) set(state, std::move(value));
  }
  numbers_.forget(repeat.counter.name);
  for (auto& [state, value] : outside) set(state, std::move(value));
  for (auto& [result, value] : results) set(result, std::move(value));
}

/// Networks that remain here read perturbed fields.
void Evaluation::run(const std::vector<Statement>& body) {
  for (const Statement& statement : body) {
    match(
        statement, ignored<Fill, Fold>, [&](const Reduce& r) { reduce(r); },
        [&](const NetworkCall&) { is_too_far_ = true; }, [&](const Transform& t) { transform(t); },
        [&](const Run& r) { run_kernel(kernels_.kernel(r.kernel)); }, [&](const Solve& s) { solve(s); },
        [&](const Repeat& r) { repeat(r); });
    if (is_too_far_) return;
  }
}

}  // namespace dpde::stability
