// SPDX-License-Identifier: Apache-2.0
#include "stability/frozen/zero_step.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "dpde/runtime/error.h"
#include "driver/scene/workspace.h"
#include "model/analyse/placement.h"
#include "model/analyse/solves.h"
#include "stability/equations.h"
#include "stability/report/verdict_cache.h"
#include "stability/step_capabilities.h"
#include "stencil/walk.h"

namespace dpde::stability {

namespace {

/// Sets dt to 0 and restores it in the destructor, also after an exception.
class WithoutStep {
 public:
  explicit WithoutStep(Workspace& workspace) : workspace_(workspace), dt_(workspace.params().at("dt")) {
    workspace_.set_param("dt", 0);
  }
  ~WithoutStep() { workspace_.set_param("dt", dt_); }
  WithoutStep(const WithoutStep&) = delete;
  WithoutStep& operator=(const WithoutStep&) = delete;

 private:
  Workspace& workspace_;
  double dt_;
};

using Fields = std::map<std::string, std::vector<double>>;

/// Fields that are not finite are left out, as with a right-hand side divided by dt; all fields are left out if an
/// operator is not finite.
Fields after_step_in(Workspace& workspace, const dpde_program& step, const std::vector<std::string>& fields, double t,
                     const Workspace::Bound& bound) {
  Fields result;
  try {
    const WithoutStep without_step(workspace);
    workspace.execute(step, t, bound);
    for (const std::string& field : fields) result[field] = workspace.dense(field);
  } catch (const Error&) {
    result.clear();
  }
  workspace.release(step);
  const auto is_finite = [](double value) { return std::isfinite(value); };
  std::erase_if(result, [&](const auto& entry) { return !std::ranges::all_of(entry.second, is_finite); });
  return result;
}

Fields on_own_grid(driver::Session& session, const std::vector<std::string>& fields, double t) {
  Workspace::Bound bound;
  for (int s = 0; s < session.rollout().state_count(); ++s)
    bound[session.rollout().state_name(s)] = session.rollout().initial(s).base();
  return after_step_in(session.workspace(), *session.compiled().program(session.compiled().step_name()), fields, t,
                       bound);
}

/// A workspace on `grid` with the session's parameters and cell means of its fields.
Workspace coarse_workspace(driver::Session& session, const CoarseGrid& grid) {
  const model::Problem& problem = session.problem();
  Workspace result = driver::make_workspace(problem, *session.compiled().code, grid.cells());
  const auto& own_params = session.workspace().params();
  for (const model::Parameter& param : problem.params) {  // spacings and cell counts stay those of the grid
    if (const auto own = own_params.find(param.name); own != own_params.end())
      result.set_param(param.name, own->second);
  }
  for (const auto& [name, control] : session.workspace().controls())
    result.set_control(name, control.every, control.values);
  for (auto& [name, weights] : result.weights()) {
    if (const auto own = session.workspace().weights().find(name); own != session.workspace().weights().end())
      weights = own->second;
  }
  const std::size_t count = session.workspace().cell_count();
  const model::Placements placements(problem);
  for (const model::Coefficient& coefficient : problem.coefficients) {
    const std::vector<double> all = session.workspace().dense(coefficient.name);
    std::vector<double> restricted;
    for (std::size_t first = 0; first < all.size(); first += count) {
      const std::span<const double> values = std::span(all).subspan(first, count);
      const std::vector<double> next = grid.restricted(values, coefficient.placement);
      restricted.insert(restricted.end(), next.begin(), next.end());
    }
    result.set_dense(coefficient.name, restricted);
  }
  for (int s = 0; s < session.rollout().state_count(); ++s) {
    const std::string& name = session.rollout().state_name(s);
    result.set_dense(name, grid.restricted(session.initial(s), placements.of(name)));
  }
  return result;
}

bool has_masks(const model::Problem& problem) {
  return std::ranges::any_of(problem.coefficients, &model::Coefficient::is_mask) ||
         std::ranges::any_of(problem.states, [](const model::State& state) { return state.held.has_value(); });
}

/// Whether all reductions give the same result on cell means.
bool reduces_to_means(const std::vector<stencil::Statement>& body, int rank, bool is_staggered) {
  const auto is_other = [&](const stencil::Reduce& reduce) {
    const bool is_of_all = std::ranges::count(reduce.over, true) == rank;
    return reduce.kind != Reduction::mean || (!is_of_all && is_staggered);
  };
  return find_kind<stencil::Reduce>(body, is_other, Blocks::passes) == nullptr;
}

}  // namespace

Fields after_step_of_no_length(driver::Session& session, const std::vector<std::string>& fields, double t,
                               const CoarseGrid& grid) {
  constexpr std::size_t most_values = std::size_t{1} << 22;  // cached values
  const std::string key =
      fmt::format("{} at {} on {}\n{}", fmt::join(fields, " "), t, grid.text(), key_of_fields(session));
  driver::Session::Findings& known = session.findings();
  if (const auto found = known.find(key); found != known.end()) return found->second;
  Fields result;
  if (grid.is_own()) {
    result = on_own_grid(session, fields, t);
  } else {
    Workspace coarse = coarse_workspace(session, grid);
    result = after_step_in(coarse, *session.compiled().program(session.compiled().step_name()), fields, t, {});
  }
  const auto size_of = [](const Fields& found) {
    std::size_t values = 0;
    for (const auto& [field, of_cells] : found) values += of_cells.size();
    return values;
  };
  std::size_t values = size_of(result);
  if (values > most_values) return result;
  for (const auto& [other, kept] : known) values += size_of(kept);
  if (values > most_values) known.clear();
  return known.emplace(key, std::move(result)).first->second;
}

CoarseGrid grid_of_solutions(const driver::Session& session) {
  const CoarseGrid own = CoarseGrid::own(session.axes());
  const model::Problem& problem = session.problem();
  if (!problem.program.empty() || has_masks(problem)) return own;
  const bool are_constraints = model::are_constraints(problem),
             is_staggered = model::Placements(problem).is_staggered();
  if (are_constraints ? has_events_in_each_step(problem) : is_staggered) return own;
  const stencil::Module& module = session.compiled().stencil;
  const std::vector<stencil::Statement>& body = module.find_program(session.compiled().step_name())->body;
  StepCapabilities found;
  survey(module, body, found);
  const int rank = static_cast<int>(session.axes().size());
  return found.solves && reduces_to_means(body, rank, is_staggered) ? CoarseGrid(session.axes()) : own;
}

}  // namespace dpde::stability
