// SPDX-License-Identifier: Apache-2.0
// Losses, gradients and Hessian products. A product runs states and rates forward through the tangent of the step, and
// the adjoint of that tangent back. Seeded with the rate of the loss, the adjoint of the states gives the Hessian's
// product; seeded with the squares of the residuals' rates, the adjoint of the rates gives that of the Gauss-Newton
// matrix.
#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "dpde/runtime/engine.h"
#include "dpde/runtime/error.h"
#include "dpde/runtime/links.h"
#include "dpde/runtime/unsolved.h"

namespace dpde {

double Engine::loss() {
  Rollout& rollout = objective();
  begin(rollout);
  const double loss = rollout.loss();
  was_stopped_ = rollout.was_stopped();
  return loss;
}

namespace {

/// The minimiser x of |A x - b| has dx = A^+ (db - dA x) + A^+ A^+^T dA^T (b - A x) (G. H. Golub and V. Pereyra, SIAM
/// J. Numer. Anal. 10 (1973), 413). Adjoints of solves have the first term only. The second vanishes if b is in the
/// range of A, and if A is symmetric with the constants as its null space.
[[noreturn]] void refuse_least_squares(const SolveNote& note) {
  Unsolved error(
      {.text =
           fmt::format("solve for {}: the operator is singular and not symmetric, and {:.3g} of a right side is out "
                       "of its reach: what is solved in the sense of least squares has no gradient",
                       note.unknown, note.out_of_reach.of_least_squares),
       .method = note.method,
       .residual = note.out_of_reach.of_least_squares,
       .advice = [unknown = note.unknown] {
         return fmt::format("take what cannot be reached off the right side, or give {} a value at a wall", unknown);
       }});
  error.set_solve_for(note.unknown);
  throw error;
}

/// Let A(k) be singular for a single k0. For k near it, A(k) x = b has a solution of size (the part of b outside of the
/// range)/(k - k0).
[[noreturn]] void refuse_isolated(const SolveNote& note, const std::string& value) {
  Unsolved error({.text = fmt::format("solve for {}: the operator is singular for this {}, and need not be for others; "
                                      "{:.3g} of a right side is out of its reach: there is no derivative by {}",
                                      note.unknown, value, note.out_of_reach.part, value),
                  .method = note.method,
                  .residual = note.out_of_reach.part,
                  .advice = [value] {
                    return fmt::format("take what cannot be reached off the right side, or another {}", value);
                  }});
  error.set_solve_for(note.unknown);
  throw error;
}

}  // namespace

void Engine::refuse_without_derivative(const Rollout& rollout) const {
  const auto is_unknown = [this](std::string_view name) {
    const std::span sought(scene_.sought, static_cast<std::size_t>(scene_.sought_count));
    return std::ranges::any_of(sought, [&](const char* one) { return name == one; }) ||
           std::ranges::any_of(unknowns_, [&](const Unknown& one) { return !one.is_network() && one.name == name; });
  };
  const SolveNote* note = rollout.without_derivative(is_unknown);
  if (note == nullptr) return;
  if (note->out_of_reach.of_least_squares > 0) refuse_least_squares(*note);
  refuse_isolated(*note, *std::ranges::find_if(note->out_of_reach.made_of, is_unknown));
}

double Engine::gradient(std::span<double> to) {
  if (const std::optional<Unsolved> jump = options_.trusts_signs ? std::nullopt : jump_in_run()) throw Unsolved(*jump);
  Rollout& rollout = objective();
  begin(rollout);
  last_gradient_ = &rollout.gradient();
  refuse_without_derivative(rollout);
  was_stopped_ = last_gradient_->stopped;
  if (was_stopped_) return std::numeric_limits<double>::quiet_NaN();
  copy_bars(rollout, false, to);
  add_through_formulas(rollout, false, scene_.initial_adjoint, scene_.coefficient_adjoint, to);
  return last_gradient_->loss;
}

/// Name of the rate of a value in the tangents, which all use the same; "" if nothing depends on it.
std::string_view Engine::rate_of(int32_t kind, std::string_view name) const {
  const auto rate = [&](const dpde_program* tangent) {
    return tangent == nullptr ? std::string_view() : rate_in(*tangent, kind, name);
  };
  for (const dpde_program* tangent :
       {scene_.second.tangent, scene_.coefficient_second.tangent, scene_.initial_second.tangent}) {
    if (!rate(tangent).empty()) return rate(tangent);
  }
  for (int32_t i = 0; i < scene_.loss_count; ++i) {
    if (!rate(scene_.losses[i].full.tangent).empty()) return rate(scene_.losses[i].full.tangent);
  }
  return "";
}

/// The state or coefficient with this rate; "" for other names.
std::string_view Engine::value_of_rate(std::string_view rate) const {
  for (const State& state : states_) {
    if (rate_of(DPDE_LINK_FIELD, state.name) == rate) return state.name;
  }
  for (const auto& [name, field] : given_) {
    if (rate_of(DPDE_LINK_FIELD, name) == rate) return name;
  }
  return "";
}

/// For an initial state or a coefficient.
bool Engine::comes_from_formula(std::string_view field) const {
  if (const int s = state_index(field); s >= 0) {
    const State& state = states_[static_cast<std::size_t>(s)];
    return !state.is_given && !state.is_unknown && state.start == DPDE_START_SCENE;
  }
  const auto coefficient = given_.find(field);
  return coefficient != given_.end() && !coefficient->second.is_given && !coefficient->second.is_unknown;
}

const Engine::Unknown* Engine::find_unknown(int32_t kind, std::string_view name) const {
  const auto found =
      std::ranges::find_if(unknowns_, [&](const Unknown& u) { return u.kind == kind && u.name == name; });
  return found == unknowns_.end() ? nullptr : &*found;
}

/// Copies the last gradient of `rollout` by the unknowns, or by their rates.
void Engine::copy_bars(const Rollout& rollout, bool of_rates, std::span<double> to) const {
  for (const Unknown& unknown : unknowns_) {
    const std::string& variable = of_rates ? unknown.rate : unknown.name;
    const std::span<double> values = unknown.part_of(to);
    if (unknown.is_network() && of_rates) {
      rollout.copy_rate_bar(unknown.name, values);  // rates of weights have no name
    } else if (variable.empty()) {
      std::ranges::fill(values, 0.0);  // nothing depends on its rate
    } else if (unknown.is_field()) {
      rollout.copy_field_bar(variable, values);
    } else {
      rollout.copy_param_bar(variable, values);
    }
  }
}

/// Adds the gradient by unknown parameters and weights in the formulas of initial states and coefficients: adjoints of
/// the formulas' programs, seeded with the last gradient of `rollout`. `of_rates`: only contributions of the rates,
/// since Gauss-Newton omits the formulas' own second derivatives, too.
void Engine::add_through_formulas(const Rollout& rollout, bool of_rates, const dpde_program* initial,
                                  const dpde_program* coefficients, std::span<double> to) {
  const auto counts = [&](std::string_view name) {
    const std::string_view value = value_of_rate(name);
    return value.empty() ? !of_rates && comes_from_formula(name) : comes_from_formula(value);
  };
  for (const dpde_program* adjoint : {coefficients, initial}) {
    if (adjoint == nullptr) continue;
    bool is_used = false;  // if all values are given the formula was not computed, so the adjoint could not read it
    for (const dpde_link& link : links_of(*adjoint)) {
      if (!is_seed_of_field(*adjoint, link)) continue;
      Field& seed = workspace_->field(adjoint->fields[link.derived]);
      seed.fill(0);
      if (!counts(link.primal)) continue;
      is_used = true;
      const FieldView found = rollout.bar_of(link.primal);
      if (found.base != nullptr) copy_interior(seed.layout(), seed.base(), found);
    }
    if (!is_used) continue;
    const Executor& done = workspace_->execute(*adjoint);
    for (const Unknown& unknown : unknowns_) {
      const std::span<double> part = unknown.part_of(to);
      const auto is_it = [&](const dpde_network* network) { return unknown.name == network->name; };
      if (unknown.is_network() && std::any_of(adjoint->networks, adjoint->networks + adjoint->network_count, is_it)) {
        const Workspace::Weights& own = workspace_->weights().find(unknown.name)->second;
        const std::vector<double>& bars = of_rates ? own.rate_bars : own.bars;
        for (std::size_t i = 0; i < bars.size(); ++i) part[i] += bars[i];
      }
      if (unknown.kind != DPDE_UNKNOWN_PARAM) continue;
      const int sum = find_derived(*adjoint, DPDE_LINK_PARAM, of_rates ? unknown.rate : unknown.name);
      if (sum >= 0) part[0] += done.sums()[static_cast<std::size_t>(sum)];
    }
  }
}

/// Makes `rollout` use the substeps of the loss at the present values.
void Engine::follow_objective(Rollout& rollout) {
  if (scene_.trial == nullptr) return;
  loss();
  rollout.follow(&objective().record());
}

void Engine::end_at_rest(bool ends_at_rest) { objective().end_at_rest(ends_at_rest); }

void Engine::hold_steps(bool hold) {
  if (scene_.trial == nullptr) return;
  if (hold) held_ = objective().record();
  objective().follow(hold ? &held_ : nullptr);
}

/// Setup with the tangent of the step, and the rates of the unknown fields.
RolloutSetup Engine::tangent_setup() {
  for (int32_t c = 0; c < scene_.sought_count; ++c) {
    const std::string_view rate = rate_of(DPDE_LINK_FIELD, scene_.sought[c]);
    if (!rate.empty()) workspace_->make_like(rate, scene_.sought[c]);
  }
  RolloutSetup both = setup();
  both.trial = nullptr;
  both.follows = scene_.trial != nullptr;
  if (scene_.second.tangent == nullptr) return both;  // no unknown affects the step
  both.step = scene_.second.tangent;
  for (const State& state : states_) {
    const std::string_view rate = scene_.steady > 0 ? rate_of(DPDE_LINK_FIELD, state.name) : "";
    if (!rate.empty()) both.rates.emplace_back(rate);
  }
  return both;
}

std::string Engine::why_no_products(Curvature curvature) const {
  if (scene_.no_second != nullptr) return scene_.no_second;
  for (int32_t i = 0; i < scene_.loss_count; ++i) {
    const dpde_loss& loss = scene_.losses[i];
    if (loss.of_averages)
      return fmt::format("loss {} of task {} is made of averages over its states: it has no second derivatives here",
                         i + 1, scene_.task);
    if (curvature == Curvature::gauss_newton && loss.full.tangent != nullptr && loss.gauss_newton.tangent == nullptr)
      return fmt::format("loss {} of task {} is not a sum of squares: it has no Gauss-Newton matrix", i + 1,
                         scene_.task);
  }
  return "";
}

Rollout& Engine::products(Curvature curvature) {
  objective();  // throws if there is no task
  if (const std::string why = why_no_products(curvature); !why.empty()) throw Error(ErrorKind::input, why);
  std::optional<Rollout>& rollout = curvature == Curvature::full ? full_ : gauss_newton_;
  if (rollout) return *rollout;
  RolloutSetup both = tangent_setup();
  both.adjoint = scene_.second.adjoint;
  for (int32_t c = 0; c < scene_.sought_count; ++c) {
    both.sought.emplace_back(scene_.sought[c]);
    const std::string_view rate = rate_of(DPDE_LINK_FIELD, scene_.sought[c]);
    if (!rate.empty()) both.sought.emplace_back(rate);
  }
  for (int32_t i = 0; i < scene_.loss_count; ++i) {
    const dpde_loss& loss = scene_.losses[i];
    const dpde_second& programs = curvature == Curvature::full ? loss.full : loss.gauss_newton;
    if (programs.tangent == nullptr) continue;  // no unknown affects the loss
    LossTerm& term = both.losses.emplace_back(loss_term(loss, *programs.tangent));
    term.adjoint = programs.adjoint;
    term.sum = rate_in(*programs.tangent, DPDE_LINK_SUM, loss.loss->sums[0]);
  }
  return open(rollout, std::move(both));
}

/// Sets the rates of parameters and controls, then of fields with formulas, then of unknown fields.
void Engine::set_direction(Rollout& rollout, Values direction) {
  const std::span<const double> all = direction;
  update_formulas();  // tangents may read fields of formulas
  for (const Unknown& unknown : unknowns_) {
    const std::span<const double> rates = unknown.part_of(all);
    if (unknown.is_network()) std::ranges::copy(rates, workspace_->weights().find(unknown.name)->second.rates.begin());
    if (unknown.rate.empty()) continue;
    if (unknown.kind == DPDE_UNKNOWN_PARAM) {
      workspace_->set_param(unknown.rate, rates[0]);
      rollout.set_param(unknown.rate, rates[0]);
    } else if (unknown.kind == DPDE_UNKNOWN_CONTROL) {
      const int every = workspace_->controls().find(unknown.name)->second.every;
      workspace_->set_control(unknown.rate, every, rates);
      rollout.set_control(unknown.rate, every, rates);
    }
  }
  const auto copy_rates = [&](const std::string& name, const Unknown* unknown, std::string_view rate, void* to) {
    const dpde_layout& layout = workspace_->layout();
    if (unknown != nullptr) return copy_in(layout, to, unknown->part_of(all));
    if (!comes_from_formula(name)) return fill_all(layout, to, 0);
    const Field& rates = workspace_->field(rate);
    if (rates.base() != to) copy_all(layout, to, rates.base());
  };
  run_tangents_of_formulas();
  for (const State& state : states_) {
    const std::string_view rate = rate_of(DPDE_LINK_FIELD, state.name);
    const int to = rate.empty() ? -1 : rollout.state_index(rate);
    if (to >= 0)
      copy_rates(state.name, find_unknown(DPDE_UNKNOWN_INITIAL, state.name), rate, rollout.initial(to).base());
  }
  for (int32_t c = 0; c < scene_.sought_count; ++c) {
    const std::string_view rate = rate_of(DPDE_LINK_FIELD, scene_.sought[c]);
    if (rate.empty()) continue;
    const Unknown* unknown = find_unknown(DPDE_UNKNOWN_COEFFICIENT, scene_.sought[c]);
    if (unknown != nullptr) {
      workspace_->set_dense(rate, unknown->part_of(all));
    } else {
      copy_rates(scene_.sought[c], nullptr, rate, workspace_->field(rate).base());
    }
  }
}

/// Runs until steady start from the steady state; the rates are solved for there.
void Engine::begin_tangent(Rollout& rollout) {
  begin(rollout);
  if (scene_.steady == 0 || scene_.second.tangent == nullptr) return;
  Rollout& from = primary();
  const RunResult run = from.run();
  if (run.stopped || run.blow_up) return;
  if (!run.steady->is_reached) throw not_steady(*run.steady, scene_.steady);
  for (std::size_t s = 0; s < states_.size(); ++s) {
    const int to = rollout.state_index(states_[s].name);
    if (to >= 0) copy_all(workspace_->layout(), rollout.initial(to).base(), from.final_states()[s]);
  }
}

/// The tangents also compute the formulas' own fields: these go to unused memory, so that given values stay.
void Engine::run_tangents_of_formulas() {
  for (const dpde_program* tangent : {scene_.coefficient_second.tangent, scene_.initial_second.tangent}) {
    if (tangent == nullptr) continue;
    Workspace::Bound bound;
    std::size_t left_out = 0;
    for (int f = tangent->input_count; f < tangent->field_count; ++f) {
      const std::string_view name = tangent->fields[f];
      if (!given_.contains(name)) continue;
      bound[name] = unused(left_out++);
    }
    workspace_->execute(*tangent, t_begin(), bound);
  }
}

void Engine::product(Values direction, std::span<double> to, Curvature curvature) {
  Rollout& rollout = products(curvature);
  follow_objective(rollout);
  set_direction(rollout, direction);
  begin_tangent(rollout);
  was_stopped_ = rollout.gradient().stopped;
  refuse_without_derivative(rollout);
  if (was_stopped_) {
    std::ranges::fill(to, std::numeric_limits<double>::quiet_NaN());
    return;
  }
  const bool of_rates = curvature == Curvature::gauss_newton;
  copy_bars(rollout, of_rates, to);
  add_through_formulas(rollout, of_rates, scene_.initial_second.adjoint, scene_.coefficient_second.adjoint, to);
}

void Engine::release_products() {
  for (std::optional<Rollout>* rollout : {&full_, &gauss_newton_, &tangent_}) rollout->reset();
}

double Engine::rate_along(Values direction) {
  objective();
  if (!tangent_) {
    RolloutSetup forward = tangent_setup();
    averaged_.clear();
    for (int32_t i = 0; i < scene_.loss_count; ++i) {
      const dpde_loss& loss = scene_.losses[i];
      if (loss.full.tangent == nullptr || loss.of_averages) continue;  // no unknown affects the loss; or handled below
      if (loss.average != nullptr) averaged_.push_back({forward.losses.size(), loss.average, loss.weight});
      LossTerm& term = forward.losses.emplace_back(loss_term(loss, *loss.full.tangent));
      term.adjoint = nullptr;
      term.average.clear();
      term.sum = rate_in(*loss.full.tangent, DPDE_LINK_SUM, loss.loss->sums[0]);
    }
    open(tangent_, std::move(forward));
  }
  const double by_params = weigh_averages(direction);
  follow_objective(*tangent_);
  set_direction(*tangent_, direction);
  begin_tangent(*tangent_);
  return tangent_->loss() + by_params;
}

/// Sets the weights of averages in tangent_ to d loss / d average; returns the rate of the losses of averages through
/// their own parameters.
double Engine::weigh_averages(Values direction) {
  const bool has_averages = std::any_of(scene_.losses, scene_.losses + scene_.loss_count,
                                        [](const dpde_loss& loss) { return loss.of_averages != 0; });
  if (!has_averages) return 0;
  loss();
  double by_params = 0;
  std::map<std::string, double> bars;
  for (const auto& [name, bar] : objective().derivatives_of_averages()) {
    bars[name] += bar;
    const Unknown* unknown = find_unknown(DPDE_UNKNOWN_PARAM, name);
    if (unknown != nullptr) by_params += bar * unknown->part_of(std::span<const double>(direction))[0];
  }
  for (const Averaged& one : averaged_) tangent_->set_weight(one.term, one.weight * bars[one.average]);
  return by_params;
}

}  // namespace dpde
