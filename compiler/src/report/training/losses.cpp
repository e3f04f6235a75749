// SPDX-License-Identifier: Apache-2.0
#include "report/training/losses.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace dpde::report {

namespace {

constexpr std::size_t most_points = 2000;  // of a curve

bool all_positive(const std::vector<double>& values) {
  return std::ranges::all_of(values, [](double value) { return value > 0 || std::isnan(value); });
}

/// Curves against the number of updates: every batch, and epochs at their ends.
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

}  // namespace

plot::LinePanel loss_panel(const std::vector<double>& losses) {
  plot::LinePanel panel;
  panel.title = "loss";
  panel.x_label = "iteration";
  panel.y_label = "loss";
  plot::Curve curve{"loss", {}, losses};
  for (std::size_t k = 0; k < losses.size(); ++k) curve.x.push_back(static_cast<double>(k));
  panel.log_y = std::ranges::all_of(losses, [](double loss) { return loss > 0; });
  panel.curves.push_back(std::move(curve));
  return panel;
}

std::string loss_table(const std::vector<double>& losses) {
  std::string table = "iteration,loss\n";
  for (std::size_t k = 0; k < losses.size(); ++k) table += fmt::format("{},{}\n", k, losses[k]);
  return table;
}

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

std::string loss_table(const training::Trials& trials) {
  const bool numbered = trials.count() > 1;
  std::string table = numbered ? "trial,iteration,loss\n" : "iteration,loss\n";
  for (std::size_t t = 0; t < trials.all().size(); ++t) {
    const std::vector<double>& losses = trials.all()[t].trainer->state().losses;
    const std::string trial = numbered ? fmt::format("{},", t + 1) : "";
    for (std::size_t k = 0; k < losses.size(); ++k) table += fmt::format("{}{},{}\n", trial, k, losses[k]);
  }
  return table;
}

std::string epoch_table(const training::Trials& trials) {
  const bool numbered = trials.count() > 1;
  std::string table = std::string(numbered ? "trial," : "") + "epoch,iterations,steps,rate,loss,validation\n";
  for (std::size_t t = 0; t < trials.all().size(); ++t) {
    const std::string trial = numbered ? fmt::format("{},", t + 1) : "";
    const std::vector<training::Epoch>& epochs = trials.all()[t].trainer->state().epochs;
    for (std::size_t e = 0; e < epochs.size(); ++e) {
      const training::Epoch& epoch = epochs[e];
      table += fmt::format("{}{},{},{},{},{},{}\n", trial, e + 1, epoch.updates, epoch.unroll, epoch.rate, epoch.loss,
                           std::isnan(epoch.validation) ? "" : fmt::format("{}", epoch.validation));
    }
  }
  return table;
}

}  // namespace dpde::report
