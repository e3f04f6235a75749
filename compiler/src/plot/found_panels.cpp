// SPDX-License-Identifier: Apache-2.0
#include "plot/found_panels.h"

#include <fmt/format.h>

#include <algorithm>
#include <functional>

#include "driver/report/run_description.h"

namespace dpde::plot {

namespace {

/// The state that a datum is compared with: the field it comes from, or the only state; "" if unclear.
std::string state_of(const Found& found, const std::string& datum) {
  for (const model::Datum& declared : found.task().data) {
    if (declared.name == datum && !declared.field.empty()) return declared.field;
  }
  const std::vector<model::State>& states = found.session.problem().states;
  return states.size() == 1 ? states[0].name : "";
}

bool is_in_loss(const Found& found, const std::string& datum) {
  return std::ranges::any_of(found.compiled.names.losses, [&](const std::string& loss) {
    const dpde_program* const program = found.compiled.program(loss);
    return program != nullptr && std::any_of(program->fields, program->fields + program->input_count,
                                             [&](const char* input) { return datum == input; });
  });
}

/// The states at a step of the run with the unknowns `x`.
std::vector<std::vector<double>> states_at(const Found& found, const Eigen::VectorXd& x, int step) {
  std::vector<std::vector<double>> states;
  found.inverse.assign(x);
  const auto keep = [&](const Snapshot& snapshot) {
    if ((snapshot.is_last ? found.session.steps() : snapshot.step) != step) return;
    states.clear();
    for (void* base : snapshot.states) {
      states.emplace_back(found.session.workspace().cell_count());
      copy_out(found.session.workspace().layout(), base, states.back());
    }
  };
  const RunResult result = found.session.rollout().run({std::max(1, step), keep});
  if (result.blow_up || result.stopped) states.clear();
  return states;
}

void add_targets(const Found& found, const Eigen::VectorXd& x, std::vector<Panel>& panels) {
  const int step = found.session.steps_of(found.task().losses.back().when).back();
  const double time = found.session.time_of(step);
  const std::vector<std::vector<double>> states = states_at(found, x, step);
  if (states.empty()) return;
  for (const driver::DataStates& datum : found.session.data()) {
    const std::string name = state_of(found, datum.name);
    const int state = found.session.rollout().state_index(name);
    const void* target = found.session.datum_at(datum, time);
    if (state < 0 || target == nullptr || !is_in_loss(found, datum.name)) continue;
    std::vector<double> values(found.session.workspace().cell_count());
    copy_out(found.session.workspace().layout(), target, values);
    const model::Problem& problem = found.session.problem();
    const model::Placement place = driver::placement_of(found.session.problem(), name);
    const auto both = panels_of(found.session, fmt::format("{} at {}", name, time_text(problem, time)),
                                {{"target", values, place, label_of(problem, name)},
                                 {"result", states[std::size_t(state)], place, label_of(problem, name)}});
    panels.insert(panels.end(), both.begin(), both.end());
  }
}

/// A panel with a step function.
LinePanel control_panel(const Found& found, const std::string& name, const std::vector<double>& values) {
  const std::vector<double> times = intervals_of(found.session, name);
  Curve curve{name, {}, {}};
  for (std::size_t k = 0; k < values.size(); ++k) {
    curve.x.insert(curve.x.end(), {times[k], times[k + 1]});
    curve.y.insert(curve.y.end(), {values[k], values[k]});
  }
  LinePanel panel;
  panel.title = name;
  panel.x_label = label_of(found.session.problem(), "t");
  panel.y_label = label_of(found.session.problem(), name);
  panel.curves.push_back(std::move(curve));
  return panel;
}

void add_unknowns(const Found& found, const Eigen::VectorXd& x, std::vector<Panel>& panels) {
  for (const driver::Inverse::Part& part : found.inverse.parts()) {
    if (part.is_control()) panels.push_back(control_panel(found, part.name, part.of(x)));
    if (!part.is_field()) continue;
    std::vector<std::pair<std::string, std::vector<double>>> fields{{"recovered", part.of(x)}};
    const std::vector<double>& own = found.inverse.own(part);
    const bool is_constant = std::ranges::adjacent_find(own, std::not_equal_to<>()) == own.end();
    if (!is_constant) fields.insert(fields.begin(), {"the scene's own", own});
    const auto both = panels_of_field(found.session, part.name, part.name + (part.is_initial() ? " at the start" : ""),
                                      label_of(found.session.problem(), part.name), fields);
    panels.insert(panels.end(), both.begin(), both.end());
  }
}

}  // namespace

std::vector<double> intervals_of(const driver::Session& session, const std::string& control) {
  const int every = session.problem().find_control(control)->every;
  std::vector<double> times;
  for (int n = 0; n < session.steps(); n += every) times.push_back(session.time_of(n));
  times.push_back(session.end_time());
  return times;
}

std::vector<Panel> panels_of_found(const Found& found, const Eigen::VectorXd& x) {
  std::vector<Panel> panels;
  add_targets(found, x, panels);
  add_unknowns(found, x, panels);
  return panels;
}

}  // namespace dpde::plot
