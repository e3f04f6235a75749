// SPDX-License-Identifier: Apache-2.0
#include "report/scene/verdict.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>

#include "model/boundary/metric.h"
#include "stability/equations.h"
#include "stability/step/folded_products.h"
#include "stability/waves/wall_spectrum.h"

namespace dpde::report {

namespace {

using stability::StabilityReport;
using stability::StepLimit;

std::string written_text(const SourceRange& range, const SourceFile& source) {
  return std::string(
      source.text().substr(static_cast<std::size_t>(range.begin), static_cast<std::size_t>(range.end - range.begin)));
}

const char* kind_name(StepLimit::Kind kind) {
  switch (kind) {
    case StepLimit::Kind::limit: return "limit";
    case StepLimit::Kind::none: return "none";
    case StepLimit::Kind::never: return "never";
  }
  return "";
}

using Term = std::optional<SourceRange>;

Json verdict_json(const model::Problem& problem, const StabilityReport& verdict, const Term& term,
                  const SourceFile& source) {
  Json result = {{"max_step", nullptr}, {"max_courant", nullptr}, {"mode", nullptr}, {"exact", false}};
  if (!verdict.is_analysed()) {
    result["why"] = verdict.why;
    return result;
  }
  const StepLimit& limit = verdict.limit;
  result["kind"] = kind_name(limit.kind);
  if (limit.kind == StepLimit::Kind::limit) result["max_step"] = limit.step;
  if (limit.kind == StepLimit::Kind::never) result["max_step"] = 0;
  if (verdict.courant) result["max_courant"] = *verdict.courant;
  if (limit.kind != StepLimit::Kind::none && !verdict.is_of_walls && !verdict.is_of_means && !verdict.is_of_networks) {
    const stability::Angles& first = limit.kind == StepLimit::Kind::limit ? limit.wave : verdict.wave;
    result["mode"] = Json::array();  // wave numbers, radians per unit of length
    for (std::size_t a = 0; a < problem.axes.size(); ++a)
      result["mode"].push_back(first[a] / problem.axes[a].spacing());
  }
  result["exact"] = verdict.is_exact;
  result["step"] = verdict.step;
  result["stable"] = !verdict.is_above();
  result["weak"] = limit.is_weak();
  result["limiter_step"] = verdict.limiter_step > 0 ? Json(verdict.limiter_step) : Json(nullptr);
  result["growth_per_step"] = json_number(verdict.growth);
  result["steps_to_hundredfold"] = json_number(verdict.hundredfold());
  result["growth_rate"] = json_number(verdict.growth_rate);
  result["growth_by_events"] = json_number(verdict.growth_by_events);
  if (verdict.short_waves)
    result["short_waves"] = {{"growth_rate", verdict.short_waves->rate}, {"cells", verdict.short_waves->cells}};
  result["field"] = verdict.field;
  result["walls"] = verdict.is_of_walls;
  if (verdict.leaves_out_folding()) result["left_out"] = Json::array({"what products fold back"});
  result["places"] = verdict.places;
  result["wall_places"] = verdict.places_between_walls;
  result["own_grid"] = verdict.is_of_grid;
  if (!verdict.solution_cells.empty()) result["solution_cells"] = verdict.solution_cells;
  result["networks"] = verdict.is_of_networks;
  result["place"] = verdict.place.empty() ? Json(nullptr) : Json(verdict.place);
  result["term"] = nullptr;
  if (term) {
    const LineColumn at = source.locate(term->begin);
    result["term"] = {{"text", written_text(*term, source)}, {"line", at.line}, {"column", at.column}};
  }
  return result;
}

/// Text about a wave that grows at every step.
std::string growth_text(const stability::StabilityReport& verdict) {
  if (!std::isfinite(verdict.hundredfold())) return "grows, by too little in a step of this length to be told";
  return fmt::format("grows by a factor of {:.9g} a step, a hundredfold in {:.3g} steps", verdict.growth,
                     std::ceil(verdict.hundredfold()));
}

/// Formats a line of a verdict; empty text gives no line.
std::string line_of(const std::string& text) { return text.empty() ? "" : "  " + text + "\n"; }

/// Text about growth that does not depend on the step.
std::string own_growth_text(const model::Problem& problem, const StabilityReport& verdict) {
  std::string text;
  if (verdict.growth_rate > 0)
    text += fmt::format("  the equations themselves let waves grow, at most by a factor of e in {:.4g}\n",
                        1 / verdict.growth_rate);
  constexpr double least_shown = 5e-4;  // visible with four digits
  if (verdict.growth_by_events > least_shown)
    text += fmt::format("  what ends each step multiplies waves by up to {:.4g}, however short the step is\n",
                        std::exp(verdict.growth_by_events));
  if (stability::has_rare_events(problem)) text += "  events that only some steps have are not in it\n";
  return text;
}

/// Coefficients are frozen at the start, which is valid if states keep their size. If the equations amplify states by
/// more than a factor of e, the limit may be different later.
bool grows_to_other_states(const model::Problem& problem, const StabilityReport& verdict) {
  return !verdict.is_exact && verdict.growth_rate * problem.step * problem.steps > 1;
}

std::string no_limit_text(const model::Problem& problem, const StabilityReport& verdict) {
  if (verdict.is_exact) return "no step is too large for it\n";
  const std::string text = "no step was found that is too large for it as it begins\n";
  if (!grows_to_other_states(problem, verdict)) return text;
  return text +
         "  what its states grow to may have a limit, which was not looked for: begin with such a state to see it\n";
}

/// The limit, and what grows beyond it.
std::string limit_text(const model::Problem& problem, const StabilityReport& verdict, const Term& term,
                       const SourceFile& source) {
  if (!verdict.is_analysed()) return fmt::format("stability: not analysed, {}\n", verdict.why);
  stability::StabilityReport first = verdict;
  if (verdict.limit.kind == StepLimit::Kind::limit) first.wave = verdict.limit.wave;
  const std::string wave = stability::wave_text(first, problem);
  std::string text = "stability: ";
  switch (verdict.limit.kind) {
    case StepLimit::Kind::none: text += no_limit_text(problem, verdict); break;
    case StepLimit::Kind::never:
      text +=
          fmt::format("unstable at every step{}: {} {}\n",
                      verdict.limit.is_weak() && verdict.growth < 1.01 ? ", weakly" : "", wave, growth_text(verdict));
      if (verdict.limiter_step > 0)
        text +=
            fmt::format("  that is of slopes: up to a step of {:.6g} the limiter makes stairs of them, and no more\n",
                        verdict.limiter_step);
      break;
    case StepLimit::Kind::limit: {
      text += fmt::format("stable up to a step of {:.6g}", verdict.limit.step);
      if (verdict.courant) text += fmt::format(" (Courant number {:.4g})", *verdict.courant);
      text += fmt::format(", the scene's{} is {:.3g} times that\n", verdict.parts > 1 ? " part of a step" : "",
                          verdict.step / verdict.limit.step);
      text += fmt::format("  beyond it {} grows first", wave);
      if (term) text += fmt::format(", by {} (line {})", written_text(*term, source), source.locate(term->begin).line);
      text += "\n";
      text += line_of(stability::pole_text(problem, verdict));
      break;
    }
  }
  for (const stability::StabilityReport& other : verdict.worse)
    text += fmt::format("  at the scene's step {} of {} grows faster, by a factor of {:.6g} a step\n",
                        stability::wave_text(other, problem), other.field, other.growth);
  return text;
}

/// What else is known of growth.
std::string growth_details(const model::Problem& problem, const StabilityReport& verdict) {
  if (!verdict.is_analysed()) return "";
  std::string text = line_of(stability::short_waves_text(verdict)) + line_of(stability::folding_text(problem, verdict));
  if (verdict.leaves_out_folding())
    text += "  what products fold back was not looked at on so many cells; --all-cells does, and may take minutes\n";
  if (!verdict.solution_cells.empty())
    text += fmt::format("  what it solves for was found on {} cells, from means of the scene's\n",
                        fmt::join(verdict.solution_cells, " x "));
  const std::size_t states = verdict.group.empty() ? problem.states.size() : verdict.group.size();
  if (verdict.places_between_walls > 0)
    text += fmt::format("  walls: eigenvalues on {} cells, frozen at {} of {} places\n",
                        fmt::join(stability::cells_between_walls(problem.axes, states), " x "),
                        verdict.places_between_walls, verdict.places);
  return text;
}

/// Whether the limit is exact, and what was looked at.
std::string basis_text(const model::Problem& problem, const StabilityReport& verdict) {
  if (!verdict.is_analysed()) return "";
  std::string text;
  if (verdict.is_of_networks)
    return text + "  an estimate: all is frozen as it begins, on a few cells with the networks\n";
  if (verdict.is_of_grid && verdict.is_exact)
    text += "  exact: what the step does to all disturbances of the scene's own cells was looked at\n";
  if (verdict.is_of_grid && !verdict.is_exact)
    text += "  an estimate: what the step does to all disturbances of the scene's own cells at some moments\n";
  else if (verdict.is_of_runs())
    text += fmt::format("  an estimate: the step as the run begins was repeated on the scene's own grid{}\n",
                        verdict.place.empty() ? "" : ", waves are worst at " + verdict.place);
  else if (!verdict.is_exact)
    text += fmt::format("  an estimate: coefficients are frozen as they begin{}\n",
                        verdict.place.empty() ? "" : ", worst at " + verdict.place);
  if (problem.scheme.has_weights())
    text += "  so are the weights of weno and limiters: some runs blow up below it (dpde stability measures)\n";
  return text;
}

}  // namespace

Report verdict_report(const model::Problem& problem, const StabilityReport& verdict, const SourceFile& source) {
  const Term term = stability::limiting_term(problem, verdict);
  Report report;
  report.say(limit_text(problem, verdict, term, source));
  // Growth that a run shows is worth a line.
  const std::string own_growth = verdict.is_analysed() ? own_growth_text(problem, verdict) : "";
  if (verdict.growth_rate * problem.step * problem.steps > 1)
    report.say(own_growth);
  else
    report.add_detail(own_growth);
  report.add_detail(growth_details(problem, verdict));
  report.say(basis_text(problem, verdict));
  report.json = verdict_json(problem, verdict, term, source);
  return report;
}

}  // namespace dpde::report
