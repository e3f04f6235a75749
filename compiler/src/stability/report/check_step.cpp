// SPDX-License-Identifier: Apache-2.0
// What a verdict says to people.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "stability/report/ill_posed.h"
#include "stability/report/local_character.h"
#include "stability/stability_report.h"
#include "stability/step/folded_products.h"

namespace dpde::stability {

namespace {

constexpr double unseen_growth = 1e-4;  // ln of the growth over a run above the limit that is not reported

SourceRange equation_of(const model::Problem& problem, const std::string& field) {
  const model::State* state = problem.find_state(field);
  while (state != nullptr && !state->history_of.empty()) state = problem.find_state(state->history_of);
  return state == nullptr ? problem.time_origin.range : state->origin.range;
}

std::string with_force(std::string hint, const StabilityReport& verdict, bool ruins) {
  if (!verdict.place.empty()) hint += fmt::format("; coefficients were frozen as they begin at {}", verdict.place);
  return ruins ? hint + "; --force runs it all the same" : hint;
}

void report_never(driver::Session& session, const StabilityReport& verdict, bool ruins, DiagnosticSink& sink) {
  const model::Problem& problem = session.problem();
  std::string hint = "a smaller step only takes longer to fail";
  if (const std::optional<OtherScheme> other = stable_scheme(session))
    hint = fmt::format("time = {} is stable up to a step of {:.4g}", other->time, other->step);
  if (const std::vector<Downwind> cause = downwind_differences(session); !cause.empty())
    hint = downwind_text(cause.front());
  if (verdict.limiter_step > 0)
    hint += fmt::format("; up to {:.4g} the limiter makes stairs of slopes and keeps values between their neighbours'",
                        verdict.limiter_step);
  const KindRef kind = ruins ? KindRef("never-stable") : KindRef("weakly-unstable");
  sink.report(kind, equation_of(problem, verdict.field),
              {problem.scene, wave_text(verdict, problem), fmt::format("{:.9g}", verdict.growth),
               fmt::format("{:.3g}", std::ceil(verdict.hundredfold()))},
              with_force(hint, verdict, ruins));
}

/// The factor with two decimals, as 1.23; near 1 with as many as show the difference, as 1.0000012.
std::string growth_text(double growth) {
  const double excess = std::abs(growth - 1);
  const int digits = excess > 0 && excess < 0.1 ? static_cast<int>(std::ceil(-std::log10(excess))) : 0;
  return fmt::format("{:.{}g}", growth, std::min(4 + digits, 17));
}

/// `lowest`: the verdict with the lowest limit of all groups.
void report_above(driver::Session& session, const StabilityReport& verdict, const StabilityReport& lowest, bool ruins,
                  DiagnosticSink& sink) {
  const model::Problem& problem = session.problem();
  const StabilityReport& limited = lowest.limit.kind == StepLimit::Kind::limit ? lowest : verdict;
  const std::string plain = limited.parts > 1 ? std::string("a smaller courant = ... makes the parts of steps shorter")
                                              : fmt::format("--set step={} is stable", limited.largest_step);
  const std::string folding = folding_text(problem, limited), pole = pole_text(problem, verdict);
  const std::string hint = folding.empty() ? plain : folding + (limited.parts > 1 ? "" : "; " + plain + " at first");
  const KindRef kind = ruins ? KindRef("unstable-step") : KindRef("step-above-limit");
  sink.report(kind, limiting_term(problem, verdict).value_or(equation_of(problem, verdict.field)),
              {problem.scene, fmt::format("{:.6g}", verdict.step), fmt::format("{:.6g}", limited.limit.step),
               wave_text(verdict, problem), growth_text(verdict.growth)},
              with_force(pole.empty() ? hint : hint + "; " + pole, verdict, ruins));
}

}  // namespace

std::string short_waves_text(const StabilityReport& verdict) {
  if (!verdict.short_waves) return "";
  return fmt::format(
      "disturbances {:.2g} cells long grow by a factor of e in {:.4g}, in steps of any length: a shorter step does not "
      "help, what damps waves of a few cells may",
      verdict.short_waves->cells, 1 / verdict.short_waves->rate);
}

std::string advice_on_blow_up(driver::Session& session) {
  const StabilityReport verdict = verdict_of(session);
  if (const auto cause = verdict.growth_rate > 0 ? ill_posed(session) : std::nullopt)
    return "the equations are ill-posed: " + ill_posed_text(*cause);
  const double step = session.problem().step;
  if (!verdict.is_analysed() || verdict.limit.kind == StepLimit::Kind::none) return "";
  if (verdict.limit.kind == StepLimit::Kind::never) {
    const std::vector<Downwind> cause = downwind_differences(session);
    return "the scheme is unstable at every step (dpde check)" +
           (cause.empty() ? "" : ": " + downwind_text(cause.front()));
  }
  const std::string folding = folding_text(session.problem(), verdict);
  if (verdict.is_above())
    return fmt::format("the step {} is above {:.4g}, the largest stable one where the run begins{}", step,
                       verdict.limit.step, folding.empty() ? "" : ": " + folding);
  if (!folding.empty())
    return fmt::format("where the run begins steps are stable up to {:.4g}: {}", verdict.limit.step, folding);
  if (verdict.short_waves) return fmt::format("where the run begins {}", short_waves_text(verdict));
  if (session.problem().scheme.has_weights())
    return fmt::format(
        "steps are stable up to {:.4g} with weights of weno and limiters as the run begins; as these change, a smaller "
        "step than {} may be needed (--set step=...)",
        verdict.limit.step, step);
  return fmt::format(
      "where the run begins steps are stable up to {:.4g}: the equations blow up by themselves, or what "
      "they carry has become faster, and a smaller step than {} may help (--set step=...)",
      verdict.limit.step, step);
}

bool check_step(driver::Session& session, bool force, DiagnosticSink& sink, const Look& look) {
  if (force || session.problem().substeps.control) return true;
  const std::optional<StabilityReport> grown = verdict_where_it_grows(session, look);
  if (!grown || !grown->is_above()) return true;
  const StabilityReport& verdict = grown->dominant();
  const bool ruins = grown->ruins_run();
  if (verdict.limit.kind == StepLimit::Kind::never) {
    if (verdict.end_growth > 0.1) report_never(session, verdict, ruins, sink);
  } else if (verdict.end_growth > unseen_growth) {
    report_above(session, verdict, *grown, ruins, sink);
  }
  return !ruins;
}

std::function<bool(driver::Session& session, DiagnosticSink& sink)> judge_of_steps(bool force) {
  return [force](driver::Session& session, DiagnosticSink& sink) { return check_step(session, force, sink); };
}

}  // namespace dpde::stability
