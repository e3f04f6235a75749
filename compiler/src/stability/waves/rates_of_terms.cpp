// SPDX-License-Identifier: Apache-2.0
#include "stability/waves/rates_of_terms.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "model/build.h"
#include "stability/allowed_growth.h"
#include "stability/eigenvalues/eigenvalues.h"
#include "stability/equations.h"
#include "stability/waves/step_of_rates.h"

namespace dpde::stability {

namespace {

constexpr double told = 1e-6;               // ln |g| that is surely no rounding
constexpr double rounding_of_a_sum = 1e-9;  // of the sum of all terms: rounding
constexpr double any_factor = 0.5;          // a factor that constant folding does not remove

std::string factor_of(std::size_t term) { return "factor of term " + std::to_string(term); }

/// The problem with each term multiplied by a factor of its own.
model::Problem with_factors(model::Problem problem, const std::vector<RateTerm>& terms) {
  for (model::State& state : problem.states) state.rhs = state.rhs ? std::optional(model::number(0)) : std::nullopt;
  for (std::size_t i = 0; i < terms.size(); ++i) {
    const std::string name = factor_of(i);
    problem.params.push_back({name, any_factor, true});
    std::optional<model::Expr>& rhs = std::ranges::find(problem.states, terms[i].state, &model::State::name)->rhs;
    const model::Expr part = model::binary(BinaryOp::multiply, model::param(name), terms[i].value);
    rhs = model::binary(BinaryOp::add, *rhs, part);
  }
  return problem;
}

/// Groups of term numbers with at most one term per state. A row depends on its own state's right-hand side only, so
/// one response gives the rows of a whole group.
std::vector<std::vector<std::size_t>> one_of_each_state(const std::vector<RateTerm>& terms) {
  std::map<std::string, std::size_t> seen;
  std::vector<std::vector<std::size_t>> result;
  for (std::size_t i = 0; i < terms.size(); ++i) {
    const std::size_t number = seen[terms[i].state]++;
    if (number == result.size()) result.emplace_back();
    result[number].push_back(i);
  }
  return result;
}

/// The row of each term alone; nullopt if one cannot be made.
std::optional<std::vector<LinearForm>> parts_of(const LinearStep& euler, const FrozenPoint& point,
                                                const std::vector<RateTerm>& terms,
                                                const std::vector<std::size_t>& row_of) {
  std::vector<LinearForm> result(terms.size());
  FrozenPoint without = point;
  for (std::size_t i = 0; i < terms.size(); ++i) without.params[factor_of(i)] = 0;
  for (const std::vector<std::size_t>& some : one_of_each_state(terms)) {
    FrozenPoint with_some = without;
    for (const std::size_t i : some) with_some.params[factor_of(i)] = 1;
    std::optional<LinearisedStep> rates = generator_of(euler, with_some);
    if (!rates || !rates->waves.empty()) return std::nullopt;
    for (const std::size_t i : some) result[i] = std::move(rates->rows[row_of[i]]);
  }
  return result;
}

double size_of(const LinearForm& form) {
  double sum = 0;
  for (const LinearForm::Term& term : form.terms()) sum += std::abs(term.coefficient);
  return sum;
}

/// Whether each row that has terms is the sum of their parts.
bool are_sums_of(const std::vector<LinearForm>& parts, const std::vector<std::size_t>& row_of,
                 const std::vector<LinearForm>& rows) {
  std::map<std::size_t, LinearForm> left;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    LinearForm& rest = left.try_emplace(row_of[i], rows[row_of[i]]).first->second;
    rest = rest.plus(parts[i].times(-1));
  }
  return std::ranges::all_of(
      left, [&](const auto& entry) { return size_of(entry.second) <= rounding_of_a_sum * size_of(rows[entry.first]); });
}

}  // namespace

std::vector<RateTerm> rate_terms(const model::Problem& problem, const StateGroup& group) {
  std::vector<RateTerm> result;
  for (const model::State& state : problem.states) {
    if (!state.rhs || !state.history_of.empty() || !is_in(group, state.name)) continue;
    if (is<model::Field>(*state.rhs)) continue;
    const auto first = std::ssize(result);
    for (const auto& [term, is_negative] : model::terms_of(*state.rhs)) {
      const SourceRange range = term->origin.range;
      auto part = std::find_if(result.begin() + first, result.end(),
                               [&](const RateTerm& other) { return other.range == range; });
      if (part == result.end()) part = result.insert(part, {state.name, range, model::number(0)});
      part->value = model::binary(is_negative ? BinaryOp::subtract : BinaryOp::add, part->value, term);
    }
  }
  return result;
}

std::optional<RatesOfTerms> RatesOfTerms::make(const model::Problem& problem, const StabilityReport& verdict,
                                               const std::vector<RateTerm>& terms) {
  const Equations equations(problem, verdict.group);
  RatesOfTerms result;
  result.step_of_rates_ = equations.step_of_rates();
  if (!result.step_of_rates_.is_known() || equations.without_events() != nullptr) return std::nullopt;
  const std::optional<LinearStep> linear = linear_step(problem, verdict.group);
  const auto step = linear ? linear->response(verdict.worst, verdict.limit.step) : std::nullopt;
  std::optional<LinearisedStep> rates = step ? equations.rates_at(verdict.worst) : std::nullopt;
  if (!rates) return std::nullopt;
  result.rank_ = static_cast<int>(problem.axes.size());
  const Amplification g(*step, result.rank_), of_all(*rates, result.rank_);
  const std::vector<StepOfRates::Place> places = equations.places_in(*linear);
  if (!result.step_of_rates_.makes(g, of_all, places, verdict.limit.step)) return std::nullopt;
  for (const RateTerm& term : terms) {
    const auto row = std::ranges::find(linear->states(), term.state) - linear->states().begin();
    result.row_of_.push_back(places[static_cast<std::size_t>(row)].row);
  }
  const std::optional<LinearStep> euler = linear_step(with_factors(by_euler(problem), terms), verdict.group);
  std::optional<std::vector<LinearForm>> parts =
      euler ? parts_of(*euler, verdict.worst, terms, result.row_of_) : std::nullopt;
  if (!parts || !are_sums_of(*parts, result.row_of_, rates->rows)) return std::nullopt;
  result.parts_ = std::move(*parts);
  result.rows_ = std::move(rates->rows);
  result.wave_ = verdict.limit.wave;
  result.are_spectral_ = equations.are_spectral();
  result.of_wave_ = of_all.at(result.wave_);
  result.scales_ = scales_of(result.of_wave_.cwiseAbs());
  for (std::size_t row = 0; row < result.rows_.size(); ++row)
    result.reaches_.push_back(result.reach_of(result.rows_[row], row));
  return result;
}

/// Weights a and b at opposite offsets have the real part (a + b) cos(angle).
RatesOfTerms::Reach RatesOfTerms::reach_of(const LinearForm& row, std::size_t state) const {
  std::map<stencil::Offset, double> own;
  Reach reach;
  for (const LinearForm::Term& term : row.terms()) {
    const auto component = static_cast<std::size_t>(LinearForm::component_of(term.key));
    const double size = std::abs(term.coefficient) * scales_[static_cast<Eigen::Index>(component)] /
                        scales_[static_cast<Eigen::Index>(state)];
    reach.size += size;
    stencil::Offset offset = LinearForm::offset_of(term.key);
    if (component != state) {
      reach.right += size;
      continue;
    }
    if (offset < stencil::Offset{}) {
      for (int& cells : offset) cells = -cells;
    }
    own[offset] += term.coefficient;
  }
  for (const auto& [offset, sum] : own) reach.right += offset == stencil::Offset{} ? sum : std::abs(sum);
  return reach;
}

bool RatesOfTerms::surely_grows_without(std::size_t term, double step) const {
  const std::size_t row = row_of_[term];
  const LinearForm without = rows_[row].plus(parts_[term].times(-1));
  Reach reach = reach_of(without, row);
  for (std::size_t other = 0; other < rows_.size(); ++other) {
    if (other == row) continue;
    reach.right = std::max(reach.right, reaches_[other].right);
    reach.size = std::max(reach.size, reaches_[other].size);
  }
  LinearisedStep only{std::vector<LinearForm>(rows_.size())};
  only.rows[row] = parts_[term];
  const Eigen::VectorXcd rates = eigenvalues(Eigen::MatrixXcd(of_wave_ - Amplification(only, rank_).at(wave_)));
  const Eigen::VectorXcd factors = step_of_rates_.factors(step * rates);
  const AllowedGrowth most{std::max(0.0, reach.right), are_spectral_};
  const double decay = std::max(most.slowest_decay(), no_growth * reach.size);
  const auto others = std::ranges::count_if(rates, [&](const std::complex<double>& r) { return r.real() > -decay; });
  const double beyond = std::log(factors.cwiseAbs().maxCoeff()) - most.rate_of(wave_, rates.real().maxCoeff()) * step;
  return std::max(beyond, growth_behind(static_cast<std::size_t>(others), factors)) > told;
}

}  // namespace dpde::stability
