// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "plot/text_plot.h"
#include "scene_output.h"
#include "support/evaluate.h"
#include "train.h"

namespace dpde::tools {

namespace {

constexpr std::size_t most_points = 2000;  // of a curve

bool all_positive(const std::vector<double>& values) {
  return std::ranges::all_of(values, [](double value) { return value > 0 || std::isnan(value); });
}

/// Against the number of updates: every batch, and the epochs at their ends.
std::vector<plot::Curve> loss_curves(const training::TrainingState& state) {
  plot::Curve batches{"batch", {}, {}}, epochs{"epoch", {}, {}}, validation{"validation", {}, {}};
  const std::size_t stride = std::max<std::size_t>(1, state.losses.size() / most_points);
  for (std::size_t k = 0; k < state.losses.size(); k += stride) {
    batches.x.push_back(static_cast<double>(k + 1));
    batches.y.push_back(state.losses[k]);
  }
  for (const training::Epoch& epoch : state.epochs) {
    epochs.x.push_back(static_cast<double>(epoch.updates));
    epochs.y.push_back(epoch.loss);
    if (!std::isfinite(epoch.validation)) continue;
    validation.x.push_back(static_cast<double>(epoch.updates));
    validation.y.push_back(epoch.validation);
  }
  return {batches, epochs, validation};
}

/// Of several trials what they are judged by.
plot::LinePanel loss_panel(const training::Trials& trials) {
  plot::LinePanel panel;
  panel.title = "loss";
  panel.x_label = "update";
  panel.y_label = "loss";
  for (std::size_t k = 0; k < trials.all().size(); ++k) {
    std::vector<plot::Curve> curves = loss_curves(trials.all()[k].trainer->state());
    if (trials.count() > 1) {
      plot::Curve judged = curves[2].x.empty() ? curves[1] : curves[2];
      judged.title = fmt::format("{}, trial {}", judged.title, k + 1);
      curves = {std::move(judged)};
    }
    for (plot::Curve& curve : curves) {
      if (!curve.x.empty()) panel.curves.push_back(std::move(curve));
    }
  }
  panel.log_y = std::ranges::all_of(panel.curves, [](const plot::Curve& curve) { return all_positive(curve.y); });
  return panel;
}

/// Losses of all trials; of one alone without its number.
void write_losses(Job& job, const training::Trials& trials) {
  const bool numbered = trials.count() > 1;
  std::string table = numbered ? "trial,iteration,loss\n" : "iteration,loss\n",
              epochs = std::string(numbered ? "trial," : "") + "epoch,iterations,steps,rate,loss,validation\n";
  for (std::size_t t = 0; t < trials.all().size(); ++t) {
    const training::TrainingState& state = trials.all()[t].trainer->state();
    const std::string trial = numbered ? fmt::format("{},", t + 1) : "";
    for (std::size_t k = 0; k < state.losses.size(); ++k) table += fmt::format("{}{},{}\n", trial, k, state.losses[k]);
    for (std::size_t e = 0; e < state.epochs.size(); ++e) {
      const training::Epoch& epoch = state.epochs[e];
      epochs += fmt::format("{}{},{},{},{},{},{}\n", trial, e + 1, epoch.updates, epoch.unroll, epoch.rate, epoch.loss,
                            std::isnan(epoch.validation) ? "" : fmt::format("{}", epoch.validation));
    }
  }
  save_text(job, "loss.csv", table);
  save_text(job, "epochs.csv", epochs);
}

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
  const plot::LinePanel panel = loss_panel(trials);
  const auto has_line = [](const plot::Curve& curve) { return curve.y.size() > 1; };
  if (std::ranges::any_of(panel.curves, has_line)) job.say(plot::text_plot(panel, plot::terminal_is_utf8(), 64, 10));
  if (job.options().out.empty()) return;
  write_losses(job, trials);
  write_unknowns(job, *trials.all()[trials.best()].trainer);
  const auto is_drawn = [](const plot::Curve& curve) {
    return std::ranges::any_of(curve.y, [](double loss) { return std::isfinite(loss) && loss > 0; });
  };
  if (std::ranges::any_of(panel.curves, is_drawn)) save_picture(job, "loss", {panel});
}

}  // namespace dpde::tools
