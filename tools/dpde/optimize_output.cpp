// SPDX-License-Identifier: Apache-2.0
#include "optimize_output.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "driver/run_description.h"
#include "found_file.h"
#include "interrupt.h"
#include "plot/scene_panels.h"
#include "plot/text_plot.h"
#include "report/losses.h"
#include "scene_output.h"
#include "stencil/build.h"

namespace dpde::tools {

namespace {

/// The state a datum is a target of: the field it comes from, or the only state; "" where neither tells.
std::string state_of(const TaskRun& run, const std::string& datum) {
  for (const model::Datum& declared : run.task().data) {
    if (declared.name == datum && !declared.field.empty()) return declared.field;
  }
  const std::vector<model::State>& states = run.session->problem().states;
  return states.size() == 1 ? states[0].name : "";
}

bool is_in_loss(const TaskRun& run, const std::string& datum) {
  const stencil::Module& module = run.compiled->stencil;
  for (const stencil::Program& program : module.programs) {
    if (std::ranges::find(run.compiled->names.losses, program.name) == run.compiled->names.losses.end()) continue;
    const std::vector<std::string> inputs = stencil::interface_of(module, program).inputs;
    if (std::find(inputs.begin(), inputs.end(), datum) != inputs.end()) return true;
  }
  return false;
}

/// The states at a step of the run from the unknowns found.
std::vector<std::vector<double>> states_at(TaskRun& run, const Eigen::VectorXd& x, int step) {
  std::vector<std::vector<double>> states;
  run.inverse->assign(x);
  const auto keep = [&](const Snapshot& snapshot) {
    if ((snapshot.is_last ? run.session->steps() : snapshot.step) != step) return;
    states.clear();
    for (void* base : snapshot.states) {
      states.emplace_back(run.session->workspace().cell_count());
      copy_out(run.session->workspace().layout(), base, states.back());
    }
  };
  const RunResult result = run.session->rollout().run({std::max(1, step), keep});
  if (result.blow_up || result.stopped) states.clear();
  return states;
}

void add_targets(TaskRun& run, const Eigen::VectorXd& x, std::vector<plot::Panel>& panels) {
  const int step = run.session->steps_of(run.task().losses.back().when).back();
  const double time = run.session->time_of(step);
  const std::vector<std::vector<double>> states = states_at(run, x, step);
  if (states.empty()) return;
  for (const driver::DataStates& datum : run.session->data()) {
    const std::string name = state_of(run, datum.name);
    const int state = run.session->rollout().state_index(name);
    const void* target = run.session->datum_at(datum, time);
    if (state < 0 || target == nullptr || !is_in_loss(run, datum.name)) continue;
    std::vector<double> values(run.session->workspace().cell_count());
    copy_out(run.session->workspace().layout(), target, values);
    const model::Problem& problem = run.session->problem();
    const model::Placement place = driver::placement_of(run.session->problem(), name);
    const auto both = plot::panels_of(*run.session, fmt::format("{} at {}", name, plot::time_text(problem, time)),
                                      {{"target", values, place, plot::label_of(problem, name)},
                                       {"result", states[std::size_t(state)], place, plot::label_of(problem, name)}});
    panels.insert(panels.end(), both.begin(), both.end());
  }
}

/// Begins of the intervals of a control, and the end of the last.
std::vector<double> instants_of(const TaskRun& run, const std::string& control) {
  const int every = run.session->problem().find_control(control)->every;
  std::vector<double> times;
  for (int n = 0; n < run.session->steps(); n += every) times.push_back(run.session->time_of(n));
  times.push_back(run.session->end_time());
  return times;
}

/// A line of steps.
plot::LinePanel control_panel(const TaskRun& run, const std::string& name, const std::vector<double>& values) {
  const std::vector<double> times = instants_of(run, name);
  plot::Curve curve{name, {}, {}};
  for (std::size_t k = 0; k < values.size(); ++k) {
    curve.x.insert(curve.x.end(), {times[k], times[k + 1]});
    curve.y.insert(curve.y.end(), {values[k], values[k]});
  }
  plot::LinePanel panel;
  panel.title = name;
  panel.x_label = plot::label_of(run.session->problem(), "t");
  panel.y_label = plot::label_of(run.session->problem(), name);
  panel.curves.push_back(std::move(curve));
  return panel;
}

void save_control(Job& job, const TaskRun& run, const std::string& name, const std::vector<double>& values) {
  const std::vector<double> times = instants_of(run, name);
  std::string table = fmt::format("from,to,{}\n", name);
  for (std::size_t k = 0; k < values.size(); ++k) table += fmt::format("{},{},{}\n", times[k], times[k + 1], values[k]);
  save_text(job, name + ".csv", table);
}

void add_unknowns(TaskRun& run, const Eigen::VectorXd& x, std::vector<plot::Panel>& panels) {
  for (const driver::Inverse::Part& part : run.inverse->parts()) {
    if (part.is_control()) panels.push_back(control_panel(run, part.name, part_of(x, part)));
    if (!part.is_field()) continue;
    const auto both =
        plot::panels_of_field(*run.session, part.name, part.name + (part.is_initial() ? " at the start" : ""),
                              plot::label_of(run.session->problem(), part.name),
                              {{"the scene's own", run.inverse->own(part)}, {"recovered", part_of(x, part)}});
    panels.insert(panels.end(), both.begin(), both.end());
  }
}

}  // namespace

void write_optimised(Job& job, TaskRun& run, const OptimiseResult& result) {
  if (result.losses.size() > 1)
    job.say(plot::text_plot(report::loss_panel(result.losses), plot::terminal_is_utf8(), 64, 10));
  if (job.options().out.empty()) return;
  save_text(job, "loss.csv", report::loss_table(result.losses));
  save_found(job, run, result.x);
  for (const driver::Inverse::Part& part : run.inverse->parts()) {
    if (part.is_control()) save_control(job, run, part.name, part_of(result.x, part));
    for (const network::Network& network : run.session->problem().networks) {
      if (part.is_network() && network.name == part.name) save_weights(job, network, part_of(result.x, part));
    }
    if (!part.is_field()) continue;
    save_state(job, run.session->axes(), part.is_initial() ? part.name + "_initial" : part.name,
               part_of(result.x, part));
  }
  const bool has_curve =
      std::ranges::any_of(result.losses, [](double loss) { return std::isfinite(loss) && loss > 0; });
  if (has_curve) save_picture(job, "loss", {report::loss_panel(result.losses)});
  if (interrupt_flag().load()) return;  // the pictures need another run
  std::vector<plot::Panel> panels;
  add_targets(run, result.x, panels);
  add_unknowns(run, result.x, panels);
  if (!panels.empty()) save_picture(job, run.task().name, panels);
}

}  // namespace dpde::tools
