// SPDX-License-Identifier: Apache-2.0
#include "optimize_output.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "found_file.h"
#include "interrupt.h"
#include "plot/found_panels.h"
#include "plot/text_plot.h"
#include "report/training/losses.h"
#include "scene_output.h"

namespace dpde::tools {

namespace {

void save_control(Job& job, const TaskRun& run, const std::string& name, const std::vector<double>& values) {
  const std::vector<double> times = plot::intervals_of(*run.session, name);
  std::string table = fmt::format("from,to,{}\n", name);
  for (std::size_t k = 0; k < values.size(); ++k) table += fmt::format("{},{},{}\n", times[k], times[k + 1], values[k]);
  save_text(job, name + ".csv", table);
}

}  // namespace

void write_optimised(Job& job, TaskRun& run, const OptimiseResult& result) {
  if (result.losses.size() > 1)
    job.say(plot::text_plot(report::loss_panel(result.losses), plot::terminal_is_utf8(), 64, 10));
  if (job.options().out.empty()) return;
  save_text(job, "loss.csv", report::loss_table(result.losses));
  save_found(job, run, result.x);
  for (const driver::Inverse::Part& part : run.inverse->parts()) {
    if (part.is_control()) save_control(job, run, part.name, part.of(result.x));
    for (const network::Network& network : run.session->problem().networks) {
      if (part.is_network() && network.name == part.name) save_weights(job, network, part.of(result.x));
    }
    if (!part.is_field()) continue;
    save_state(job, run.session->axes(), part.is_initial() ? part.name + "_initial" : part.name, part.of(result.x));
  }
  const bool has_curve =
      std::ranges::any_of(result.losses, [](double loss) { return std::isfinite(loss) && loss > 0; });
  if (has_curve) save_picture(job, "loss", {report::loss_panel(result.losses)});
  if (interrupt_flag().load()) return;  // the pictures need another run
  const std::vector<plot::Panel> panels = plot::panels_of_found({*run.session, *run.inverse, *run.compiled}, result.x);
  if (!panels.empty()) save_picture(job, run.task().name, panels);
}

}  // namespace dpde::tools
