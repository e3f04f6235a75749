// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "plot/text_plot.h"
#include "report/training/losses.h"
#include "scene_output.h"
#include "train.h"

namespace dpde::tools {

namespace {

void write_unknowns(Job& job, const training::Trainer& trainer) {
  const std::vector<model::Axis>& axes = trainer.scene().compiled->problem->axes;
  for (const training::UnknownPart& part : trainer.parts()) {
    const auto values = trainer.best().segment(part.offset, part.size);
    const std::vector<double> numbers(values.data(), values.data() + part.size);
    if (part.kind == DPDE_UNKNOWN_COEFFICIENT) save_state(job, axes, part.name, numbers);
    for (const network::Network& network : trainer.scene().compiled->problem->networks) {
      if (part.kind == DPDE_UNKNOWN_NETWORK && network.name == part.name) save_weights(job, network, numbers);
    }
  }
}

}  // namespace

void write_trained(Job& job, const training::Trials& trials) {
  const plot::LinePanel panel = report::loss_panel(trials);
  const auto has_line = [](const plot::Curve& curve) { return curve.y.size() > 1; };
  if (std::ranges::any_of(panel.curves, has_line)) job.say(plot::text_plot(panel, plot::terminal_is_utf8(), 64, 10));
  if (job.options().out.empty()) return;
  save_text(job, "loss.csv", report::loss_table(trials));
  save_text(job, "epochs.csv", report::epoch_table(trials));
  write_unknowns(job, *trials.all()[trials.best()].trainer);
  const auto is_drawn = [](const plot::Curve& curve) {
    return std::ranges::any_of(curve.y, [](double loss) { return std::isfinite(loss) && loss > 0; });
  };
  if (std::ranges::any_of(panel.curves, is_drawn)) save_picture(job, "loss", {panel});
}

}  // namespace dpde::tools
