// SPDX-License-Identifier: Apache-2.0
// What of a problem makes its limit: the same analysis of problems with less, or another, in them.
#include <algorithm>
#include <cmath>
#include <limits>

#include "dpde/runtime/error.h"
#include "model/build.h"
#include "stability/equations.h"
#include "stability/examination.h"
#include "stability/stability_report.h"
#include "stability/waves/rates_of_terms.h"

namespace dpde::stability {

namespace {

model::Problem problem_without(model::Problem problem, const RateTerm& left_out) {
  std::optional<model::Expr>& rhs = std::ranges::find(problem.states, left_out.state, &model::State::name)->rhs;
  model::Expr sum = model::number(0);
  for (const auto& [term, is_negative] : model::terms_of(*rhs)) {
    if (term->origin.range == left_out.range) continue;
    sum = model::binary(is_negative ? BinaryOp::subtract : BinaryOp::add, sum, term);
  }
  rhs = sum;
  return problem;
}

std::optional<FrozenAnalysis> analysis_of(const model::Problem& problem, const LinearStep& linear,
                                          const FrozenPoint& point, double step) {
  const Equations equations(problem, linear.group());
  return FrozenAnalysis::make(linear, point, static_cast<int>(problem.axes.size()), step, &equations);
}

/// The limit as a number: infinite if there is none, 0 if every step is unstable.
double number_of(const StepLimit& limit) {
  return limit.kind == StepLimit::Kind::limit  ? limit.step
         : limit.kind == StepLimit::Kind::none ? std::numeric_limits<double>::infinity()
                                               : 0;
}

/// Whether the wave that limits the step still grows, far more than the equations allow. For most terms this one check
/// shows that other terms set the limit.
bool still_grows(const model::Problem& problem, const LinearStep& linear, const StabilityReport& verdict, double step) {
  const std::optional<LinearisedStep> response = linear.response(verdict.worst, step);
  if (!response) return false;
  const Amplification g(*response, static_cast<int>(problem.axes.size()));
  constexpr double surely = 0.1;
  const double grown = std::log(g.spectral_radius(verdict.limit.wave));
  return grown > surely + 4 * verdict.growth_rate * step + verdict.growth_by_events;
}

/// The limit, or 0 if it is below `least`, which one check shows: most terms do not change the limit. Limits are only
/// compared with one another.
double limit_above(double least, const model::Problem& problem, const LinearStep& linear, const FrozenPoint& point,
                   double step) {
  constexpr double precision = 1e-2;
  const auto analysis = analysis_of(problem, linear, point, step);
  if (!analysis || !analysis->is_stable(least)) return 0;
  return number_of(analysis->limit(std::numeric_limits<double>::infinity(), precision));
}

}  // namespace

std::optional<SourceRange> limiting_term(const model::Problem& problem, const StabilityReport& verdict) {
  if (!verdict.is_analysed() || verdict.limit.kind != StepLimit::Kind::limit || verdict.is_of_walls ||
      verdict.is_of_means || verdict.is_of_networks || !problem.program.empty())
    return std::nullopt;
  std::optional<SourceRange> best;
  double largest = verdict.limit.step * 1.25;
  const std::vector<RateTerm> terms = rate_terms(problem, verdict.group);
  const std::optional<RatesOfTerms> rates = RatesOfTerms::make(problem, verdict, terms);
  for (std::size_t i = 0; i < terms.size(); ++i) {
    if (!terms[i].range.is_known() || (rates && rates->surely_grows_without(i, largest))) continue;
    const model::Problem without = problem_without(problem, terms[i]);
    const std::optional<LinearStep> linear = linear_step(without, verdict.group);
    if (!linear || still_grows(without, *linear, verdict, largest)) continue;
    const double limit = limit_above(largest, without, *linear, verdict.worst, verdict.step);
    if (!(limit > largest)) continue;
    largest = limit;
    best = terms[i].range;
  }
  return best;
}

std::optional<OtherScheme> stable_scheme(driver::Session& session) {
  const model::Problem& problem = session.problem();
  if (!problem.program.empty()) return std::nullopt;
  for (const char* const name : {"ssp_rk3", "rk4"}) {
    model::Problem other = problem;
    std::erase_if(other.states, [](const model::State& s) { return !s.history_of.empty(); });
    other.scheme.time = model::time_method(name);
    try {
      if (const std::optional<double> limit = limit_by_other_scheme(session, other)) return OtherScheme{name, *limit};
    } catch (const NoSolution&) {  // without this term a solve fails: the term is not reported
    }
  }
  return std::nullopt;
}

}  // namespace dpde::stability
