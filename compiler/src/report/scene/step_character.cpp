// SPDX-License-Identifier: Apache-2.0
#include "report/scene/step_character.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "model/boundary/metric.h"

namespace dpde::report {

namespace {

using stability::CellNumber;

/// Whether the field is advected by Fourier series, not differences.
bool takes_series(const model::Scheme& scheme, const std::string& field) {
  const auto own = scheme.transports.find(field);
  const model::Transport& transport = own == scheme.transports.end() ? scheme.transport : own->second;
  return model::is_spectral(transport) || scheme.derivative_order == model::spectral;
}

const char* name_of(const CellNumber& cell) { return cell.is_reynolds ? "Reynolds" : "Peclet"; }

}  // namespace

StepCharacter character_of(driver::Session& session, double step) {
  return {stability::cell_numbers(session), stability::positivity_of(session, step)};
}

void warn_of_cell_numbers(const driver::Session& session, const StepCharacter& character, DiagnosticSink& sink) {
  const model::Problem& problem = session.problem();
  std::vector<CellNumber> cells = character.cells;
  std::ranges::stable_sort(cells, std::ranges::greater{}, &CellNumber::number);
  for (const CellNumber& cell : cells) {
    if (!cell.rings) continue;
    const model::State* state = problem.find_state(cell.field);
    const model::Axis& axis = problem.axes[static_cast<std::size_t>(cell.axis)];
    const double cells = std::ceil(1.01 * axis.cells * cell.number / 2);  // finer grids resolve extrema better
    sink.report("cell-number", state == nullptr ? SourceRange{} : state->origin.range,
                {name_of(cell), cell.field, fmt::format("{:.4g}", cell.number),
                 model::name_of_axis(problem, static_cast<std::size_t>(cell.axis)),
                 takes_series(problem.scheme, cell.field) ? "Fourier series" : "central differences"},
                fmt::format("--set cells.{}={:.0f} brings it below 2; --set advect=upwind3 damps the oscillations",
                            axis.name, cells));
  }
}

Json json_of(const driver::Session& session, const StepCharacter& character) {
  Json rows = Json::array();
  for (const CellNumber& cell : character.cells) {
    rows.push_back({{"field", cell.field},
                    {"axis", session.axes()[static_cast<std::size_t>(cell.axis)].name},
                    {"kind", cell.is_reynolds ? "reynolds" : "peclet"},
                    {"number", json_number(cell.number)},
                    {"speed", cell.speed},
                    {"diffusion", cell.diffusion},
                    {"rings", cell.rings},
                    {"place", cell.place.empty() ? Json(nullptr) : Json(cell.place)}});
  }
  const stability::Positivity& found = character.positivity;
  Json monotone = nullptr;
  if (found.why.empty()) monotone = {{"kept", found.is_kept}, {"max_step", json_number(found.largest_step)}};
  return {{"monotone", std::move(monotone)}, {"cell_numbers", std::move(rows)}};
}

std::string text_of(const driver::Session& session, const StepCharacter& character) {
  std::string text;
  for (const CellNumber& cell : character.cells) {
    if (!std::isfinite(cell.number)) continue;
    text += fmt::format("cell {} number of {} along {}: {:.4g}{}\n", name_of(cell), cell.field,
                        session.axes()[static_cast<std::size_t>(cell.axis)].name, cell.number,
                        cell.place.empty() ? "" : ", largest at " + cell.place);
  }
  const stability::Positivity& found = character.positivity;
  if (!found.why.empty()) return text;
  // At walls the weights differ and are not analysed.
  const bool has_walls =
      std::ranges::any_of(session.axes(), [](const model::Axis& axis) { return axis.topology == Topology::bounded; });
  text += fmt::format("monotone{}: {}", has_walls ? " away from walls" : "", found.is_kept ? "yes" : "no");
  if (found.largest_step == 0) return text + ": some weights of short steps are negative, so new extrema may appear\n";
  if (std::isinf(found.largest_step)) return text + ", at every step\n";
  return text + fmt::format(", up to a step of {:.6g} no weight of the frozen step is negative\n", found.largest_step);
}

Json json_of(const driver::Session& session, const std::vector<stability::Wave>& waves, double step) {
  Json rows = Json::array();
  for (const stability::Wave& wave : waves) {
    rows.push_back({{"axis", session.axes()[static_cast<std::size_t>(wave.axis)].name},
                    {"cells", wave.cells},
                    {"growth_per_step", json_number(wave.growth)},
                    {"exact_growth_per_step", json_number(wave.exact_growth)},
                    {"growth_per_time", json_number(std::pow(wave.growth, 1 / step))},
                    {"phase_speed", std::isnan(wave.phase) ? Json(nullptr) : Json(wave.phase)}});
  }
  return rows;
}

std::string text_of(const driver::Session& session, const std::vector<stability::Wave>& waves, double step) {
  std::string text =
      "waves: cells a wavelength, growth in a step by the scheme and exactly, in a unit of time by the "
      "scheme, phase speed over the exact one\n";
  for (const stability::Wave& wave : waves) {
    text += fmt::format("  {} {:>4}  {:<14.10g} {:<14.10g} {:<12.6g} {}\n",
                        session.axes()[static_cast<std::size_t>(wave.axis)].name, wave.cells, wave.growth,
                        wave.exact_growth, std::pow(wave.growth, 1 / step),
                        std::isnan(wave.phase) ? "-" : fmt::format("{:.10g}", wave.phase));
  }
  return text;
}

}  // namespace dpde::report
