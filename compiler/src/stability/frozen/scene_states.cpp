// SPDX-License-Identifier: Apache-2.0
#include "stability/frozen/scene_states.h"

#include <algorithm>
#include <cmath>

#include "stability/frozen/consistent_start.h"
#include "stability/frozen/zero_step.h"
#include "stability/report/known_networks.h"
#include "stability/step/whole_fields.h"
#include "stencil/build.h"
#include "support/contains.h"

namespace dpde::stability {

namespace {

constexpr double fewest_moments = 3, most_moments = 17;  // both ends and the middle are among them
constexpr double values_kept = 4e6;                      // stored values of all moments

/// Whether the scene's step may depend on time.
bool may_vary_in_time(const driver::Session& session) {
  const driver::Compiled& compiled = session.compiled();
  const model::Problem& problem = session.problem();
  const auto interface = stencil::interface_of(compiled.stencil, *compiled.stencil.find_program(compiled.step_name()));
  return contains(interface.params, std::string("t")) || !problem.controls.empty() ||
         std::ranges::any_of(problem.coefficients, &model::Coefficient::is_control);
}

SceneStates::Moment moment_at(driver::Session& session, const std::vector<std::string>& set,
                              const std::set<std::string>& networks, const CoarseGrid* whole, double t) {
  SceneStates::Moment result{t, values_of_networks(session, networks, t), {}};
  for (const std::string& name : set) result.set[name] = session.initial(session.engine().state_index(name));
  if (whole != nullptr) result.whole = whole_fields(session, t, *whole);
  return result;
}

}  // namespace

double time_within(const driver::Session& session, double part) {
  const model::Problem& problem = session.problem();
  return problem.t_begin + std::max(1.0, part * session.steps()) * problem.step;
}

SceneStates::SceneStates(driver::Session& session, const LinearStep& linear)
    : grid_of_whole_(grid_of_solutions(session)) {
  std::vector<std::string> set;
  const std::set<std::string>& networks = linear.known_networks();
  for (const std::string& name : linear.inputs()) {
    if (stencil::is_coordinate(name) || networks.contains(name)) continue;
    const int state = session.engine().state_index(name);
    if (state >= 0 && is_set_by_steps(session.problem(), name))
      set.push_back(name);
    else
      fixed_[name] = state < 0 ? session.workspace().dense(name) : session.initial(state);
  }
  const CoarseGrid* const whole = linear.solves() || linear.reduces() ? &grid_of_whole_ : nullptr;
  moments_.push_back(moment_at(session, set, networks, whole, session.problem().t_begin));
  const std::size_t fields = moments_.front().set.size() + moments_.front().whole.size();
  if (fields == 0 || !may_vary_in_time(session)) return;
  const double values = static_cast<double>(session.workspace().cell_count()) * static_cast<double>(fields);
  const double halves = std::floor(0.5 * std::clamp(values_kept / values, fewest_moments, most_moments));
  std::vector<Moment> moments;
  for (double k = 0; k <= 2 * halves; ++k) {
    const double t = time_within(session, k / (2 * halves));
    const ConsistentStart start(session, t);
    moments.push_back(moment_at(session, set, networks, whole, t));
  }
  const Moment& first = moments.front();
  const bool are_alike =
      std::ranges::all_of(moments, [&](const Moment& m) { return m.set == first.set && m.whole == first.whole; });
  if (!are_alike) moments_ = std::move(moments);
}

const SceneStates::Moment& SceneStates::nearest(double t) const {
  return *std::ranges::min_element(moments_, {}, [t](const Moment& m) { return std::abs(m.time - t); });
}

}  // namespace dpde::stability
