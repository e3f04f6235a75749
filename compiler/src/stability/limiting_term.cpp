// SPDX-License-Identifier: Apache-2.0
// What of a problem makes its limit: the same analysis of problems with less, or another, in them.
#include <algorithm>
#include <cmath>
#include <limits>

#include "model/build.h"
#include "stability/eigenvalues.h"
#include "stability/equations.h"
#include "stability/frozen_points.h"
#include "stability/step_of_rates.h"
#include "stability/verdict.h"
#include "support/contains.h"

namespace dpde::stability {

namespace {

/// The terms that come from this part of the text, or those that do not.
model::Expr sum_of(const std::vector<model::Term>& terms, const SourceRange& part, bool is_of_part) {
  model::Expr sum = model::number(0);
  for (const auto& [term, is_negative] : terms) {
    if ((term->origin.range == part) != is_of_part) continue;
    sum = model::binary(is_negative ? BinaryOp::subtract : BinaryOp::add, sum, term);
  }
  return sum;
}

std::optional<FrozenAnalysis> analysis_of(const model::Problem& problem, const LinearStep& linear,
                                          const FrozenPoint& point, double step) {
  const Equations equations(problem, linear.group());
  return FrozenAnalysis::make(linear, point, static_cast<int>(problem.axes.size()), step, &equations);
}

/// Infinite where there is none, 0 where every step is unstable.
double number_of(const StepLimit& limit) {
  return limit.kind == StepLimit::Kind::limit  ? limit.step
         : limit.kind == StepLimit::Kind::none ? std::numeric_limits<double>::infinity()
                                               : 0;
}

double limit_of(const model::Problem& problem, const LinearStep& linear, const FrozenPoint& point, double step) {
  const auto analysis = analysis_of(problem, linear, point, step);
  return analysis ? number_of(analysis->limit()) : 0;
}

/// Whether the wave that grew first beyond the limit still does, by far more than the equations may let it: of most
/// terms this one look says that all depends on others.
bool still_grows(const Verdict& verdict, double factor, double step) {
  constexpr double surely = 0.1;
  return std::log(factor) > surely + 4 * verdict.growth_rate * step + verdict.growth_by_events;
}

bool still_grows(const model::Problem& problem, const LinearStep& linear, const Verdict& verdict, double step) {
  const std::optional<Response> response = linear.response(verdict.worst, step);
  if (!response) return false;
  const Amplification g(*response, static_cast<int>(problem.axes.size()));
  return still_grows(verdict, g.spectral_radius(verdict.limit.wave), step);
}

/// The same without lowering a problem of many equations for each of their terms: rates are sums over terms, and what
/// one has of that wave is found from a problem without others.
class RatesOfTerms {
 public:
  RatesOfTerms(const model::Problem& problem, const Verdict& verdict) : problem_(by_euler(problem)), verdict_(verdict) {
    const Equations equations(problem, verdict.group);
    const std::vector<double> polynomial = equations.stability_polynomial();
    if (polynomial.empty() || equations.without_events() != nullptr) return;
    const std::optional<LinearStep> linear = linear_step(problem, verdict.group);
    const auto step = linear ? linear->response(verdict.worst, verdict.limit.step) : std::nullopt;
    const std::optional<Response> rates = step ? equations.rates_at(verdict.worst) : std::nullopt;
    if (!rates) return;
    const Amplification g(*step, rank()), of_all(*rates, rank());
    if (!is_step_of_rates(g, of_all, polynomial, verdict.limit.step)) return;
    polynomial_ = polynomial;
    all_ = of_all.at(verdict.limit.wave);
    for (model::State& state : problem_.states) state.rhs = state.rhs ? std::optional(model::number(0)) : std::nullopt;
  }

  /// Whether it does without this part of the right side of a state; false where that is not known so.
  bool still_grow_without(std::size_t state, const model::Expr& part, double step) const {
    if (polynomial_.empty()) return false;
    model::Problem alone = problem_;
    alone.states[state].rhs = part;
    const std::optional<LinearStep> euler = linear_step(alone, verdict_.group);
    const std::optional<Response> rates = euler ? generator_of(*euler, verdict_.worst) : std::nullopt;
    if (!rates) return false;
    const Eigen::MatrixXcd others = all_ - Amplification(*rates, rank()).at(verdict_.limit.wave);
    const double factor = polynomial_of(polynomial_, step * eigenvalues(others)).cwiseAbs().maxCoeff();
    return still_grows(verdict_, factor, step);
  }

 private:
  int rank() const { return static_cast<int>(problem_.axes.size()); }

  model::Problem problem_;  // without any terms
  const Verdict& verdict_;
  std::vector<double> polynomial_;  // empty: steps are none of rates
  Eigen::MatrixXcd all_;
};

/// 0 where it is below `least`: most terms change nothing, which one look tells. It is compared with others only.
double limit_above(double least, const model::Problem& problem, const LinearStep& linear, const FrozenPoint& point,
                   double step) {
  constexpr double precision = 1e-2;
  const auto analysis = analysis_of(problem, linear, point, step);
  if (!analysis || !analysis->is_stable(least)) return 0;
  return number_of(analysis->limit(std::numeric_limits<double>::infinity(), precision));
}

}  // namespace

std::optional<SourceRange> limiting_term(const model::Problem& problem, const Verdict& verdict) {
  if (!verdict.is_analysed() || verdict.limit.kind != StepLimit::Kind::limit || verdict.is_of_walls ||
      verdict.is_of_means || verdict.is_of_networks || !problem.program.empty())
    return std::nullopt;
  std::optional<SourceRange> best;
  double largest = verdict.limit.step * 1.25;
  const RatesOfTerms rates(problem, verdict);
  for (std::size_t s = 0; s < problem.states.size(); ++s) {
    const std::optional<model::Expr>& rate = problem.states[s].rhs;
    const bool is_other =
        !rate || !problem.states[s].history_of.empty() || !is_in(verdict.group, problem.states[s].name);
    if (is_other || std::holds_alternative<model::Field>((*rate)->kind)) continue;
    const std::vector<model::Term> terms = model::terms_of(*rate);
    std::vector<SourceRange> tried;
    for (const model::Term& term : terms) {
      const SourceRange range = term.value->origin.range;
      if (!range.is_known() || std::ranges::find(tried, range) != tried.end()) continue;
      tried.push_back(range);
      if (rates.still_grow_without(s, sum_of(terms, range, true), largest)) continue;
      model::Problem without = problem;
      without.states[s].rhs = sum_of(terms, range, false);
      const std::optional<LinearStep> linear = linear_step(without, verdict.group);
      if (!linear || still_grows(without, *linear, verdict, largest)) continue;
      const double limit = limit_above(largest, without, *linear, verdict.worst, verdict.step);
      if (!(limit > largest)) continue;
      largest = limit;
      best = range;
    }
  }
  return best;
}

std::optional<OtherScheme> stable_scheme(driver::Session& session, const Verdict& verdict) {
  const model::Problem& problem = session.problem();
  if (!problem.program.empty()) return std::nullopt;
  constexpr std::pair<model::TimeScheme, const char*> others[] = {{model::TimeScheme::ssp_rk3, "ssp_rk3"},
                                                                  {model::TimeScheme::rk4, "rk4"}};
  for (const auto& [time, name] : others) {
    model::Problem other = problem;
    std::erase_if(other.states, [](const model::State& s) { return !s.history_of.empty(); });
    other.scheme.time = time;
    const std::vector<LinearStep> groups = linear_steps(other);
    double limit = groups.empty() ? 0 : std::numeric_limits<double>::infinity();
    for (const LinearStep& linear : groups) {
      if (contains(linear.states(), verdict.field))  // most fail there
        limit = std::min(limit, limit_of(other, linear, verdict.worst, verdict.step));
      for (const ScenePoint& point : frozen_points(session, linear)) {
        if (limit == 0) break;
        limit = std::min(limit, limit_of(other, linear, point.point, verdict.step));
      }
    }
    if (limit > 0 && std::isfinite(limit)) return OtherScheme{name, limit};
  }
  return std::nullopt;
}

}  // namespace dpde::stability
