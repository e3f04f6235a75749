// SPDX-License-Identifier: Apache-2.0
#include "character_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "model/metric.h"
#include "stability/local_character.h"

namespace dpde::tools {

namespace {

using stability::CellNumber;

const char* name_of(const CellNumber& cell) { return cell.is_reynolds ? "Reynolds" : "Peclet"; }

void warn(Job& job, const driver::Session& session, const CellNumber& cell) {
  const model::Problem& problem = session.problem();
  const model::State* state = problem.find_state(cell.field);
  const model::Axis& axis = problem.axes[static_cast<std::size_t>(cell.axis)];
  const double cells = std::ceil(1.01 * axis.cells * cell.number / 2);  // finer grids come closer to extrema
  job.sink().report(
      "cell-number", state == nullptr ? SourceRange{} : state->origin.range,
      {name_of(cell), cell.field, fmt::format("{:.4g}", cell.number),
       model::name_of_axis(problem, static_cast<std::size_t>(cell.axis))},
      fmt::format("--set cells.{}={:.0f} brings it below 2; --set advect=upwind3 damps what rings", axis.name, cells));
}

std::string report_cell_numbers(Job& job, driver::Session& session, Json& result) {
  Json rows = Json::array();
  std::string text;
  for (const CellNumber& cell : stability::cell_numbers(session)) {
    const std::string& axis = session.axes()[static_cast<std::size_t>(cell.axis)].name;
    rows.push_back({{"field", cell.field},
                    {"axis", axis},
                    {"kind", cell.is_reynolds ? "reynolds" : "peclet"},
                    {"number", json_number(cell.number)},
                    {"speed", cell.speed},
                    {"diffusion", cell.diffusion},
                    {"rings", cell.rings},
                    {"place", cell.place.empty() ? Json(nullptr) : Json(cell.place)}});
    if (cell.rings) warn(job, session, cell);
    if (!std::isfinite(cell.number)) continue;
    text += fmt::format("cell {} number of {} along {}: {:.4g}{}\n", name_of(cell), cell.field, axis, cell.number,
                        cell.place.empty() ? "" : ", largest at " + cell.place);
  }
  result["cell_numbers"] = std::move(rows);
  return text;
}

std::string report_positivity(driver::Session& session, double step, Json& result) {
  const stability::Positivity found = stability::positivity_of(session, step);
  if (!found.why.empty()) {
    result["monotone"] = nullptr;
    return "";
  }
  result["monotone"] = {{"kept", found.is_kept}, {"max_step", json_number(found.largest_step)}};
  // At walls weights are others, which are not looked at.
  const bool has_walls =
      std::ranges::any_of(session.axes(), [](const model::Axis& axis) { return axis.topology == Topology::bounded; });
  std::string text = fmt::format("monotone{}: {}", has_walls ? " away from walls" : "", found.is_kept ? "yes" : "no");
  if (found.largest_step == 0) return text + ": some weights of short steps are negative, so new extrema may appear\n";
  if (std::isinf(found.largest_step)) return text + ", at every step\n";
  return text + fmt::format(", up to a step of {:.6g} no weight of the frozen step is negative\n", found.largest_step);
}

}  // namespace

std::string report_character(Job& job, driver::Session& session, const stability::Verdict& verdict, Json& result) {
  result["cell_numbers"] = result["monotone"] = nullptr;
  if (!verdict.is_analysed()) return "";
  std::string text = report_cell_numbers(job, session, result);
  return text + report_positivity(session, verdict.step, result);
}

std::string report_waves(const driver::Session& session, const stability::Verdict& verdict, Json& result) {
  Json rows = Json::array();
  std::string text =
      "waves: cells a wavelength, growth in a step by the scheme and exactly, in a unit of time by the "
      "scheme, phase speed over the exact one\n";
  if (!verdict.is_analysed()) return "waves: not analysed, " + verdict.why + "\n";
  for (const stability::Wave& wave : stability::waves_of(session, verdict.worst, verdict.step, verdict.group)) {
    const std::string& axis = session.axes()[static_cast<std::size_t>(wave.axis)].name;
    const double in_time = std::pow(wave.growth, 1 / verdict.step);
    rows.push_back({{"axis", axis},
                    {"cells", wave.cells},
                    {"growth_per_step", json_number(wave.growth)},
                    {"exact_growth_per_step", json_number(wave.exact_growth)},
                    {"growth_per_time", json_number(in_time)},
                    {"phase_speed", std::isnan(wave.phase) ? Json(nullptr) : Json(wave.phase)}});
    text += fmt::format("  {} {:>4}  {:<14.10g} {:<14.10g} {:<12.6g} {}\n", axis, wave.cells, wave.growth,
                        wave.exact_growth, in_time, std::isnan(wave.phase) ? "-" : fmt::format("{:.10g}", wave.phase));
  }
  result["waves"] = std::move(rows);
  return text;
}

}  // namespace dpde::tools
