// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "scene_output.h"
#include "support/evaluate.h"
#include "text_plot.h"
#include "train.h"

namespace dpde::tools {

namespace {

constexpr std::size_t most_points = 2000;  // of a curve

bool all_positive(const std::vector<double>& values) {
  return std::ranges::all_of(values, [](double value) { return value > 0 || std::isnan(value); });
}

/// Against the number of updates: every batch, and the epochs at their ends.
LinePanel loss_panel(const driver::Trainer& trainer) {
  const driver::TrainingState& state = trainer.state();
  LinePanel panel;
  panel.title = "loss";
  panel.x_label = "update";
  Curve batches{"batch", {}, {}}, epochs{"epoch", {}, {}}, validation{"validation", {}, {}};
  const std::size_t stride = std::max<std::size_t>(1, state.losses.size() / most_points);
  for (std::size_t k = 0; k < state.losses.size(); k += stride) {
    batches.x.push_back(static_cast<double>(k + 1));
    batches.y.push_back(state.losses[k]);
  }
  for (const driver::Epoch& epoch : state.epochs) {
    epochs.x.push_back(static_cast<double>(epoch.updates));
    epochs.y.push_back(epoch.loss);
    if (!std::isfinite(epoch.validation)) continue;
    validation.x.push_back(static_cast<double>(epoch.updates));
    validation.y.push_back(epoch.validation);
  }
  panel.log_y = all_positive(batches.y) && all_positive(validation.y);
  for (Curve& curve : std::vector{batches, epochs, validation}) {
    if (!curve.x.empty()) panel.curves.push_back(std::move(curve));
  }
  return panel;
}

Json numbers_of(const driver::TrajectoryTest& test) {
  const driver::MeanAndSpread whole = driver::mean_and_spread(test.means());
  return {{"mean", json_number(whole.mean)}, {"spread", json_number(whole.spread)}, {"runs", json_numbers(test.means())}, {"course", json_numbers(test.course())}};
}

/// Mean and spread over the runs at each time.
std::vector<driver::MeanAndSpread> spreads_of(const driver::TrajectoryTest& test) {
  std::vector<driver::MeanAndSpread> all;
  for (std::size_t k = 0; k < test.times.size(); ++k) {
    std::vector<double> values;
    for (const std::vector<double>& run : test.runs) values.push_back(run[k]);
    all.push_back(driver::mean_and_spread(values));
  }
  return all;
}

void write_test(Job& job, const driver::TrajectoryTest& found, const driver::TrajectoryTest& start) {
  if (job.options().out.empty()) return;
  const auto of_found = spreads_of(found), of_start = spreads_of(start);
  std::string table = fmt::format("t,{0},{0}_spread,{0}_at_start,{0}_at_start_spread\n", found.name);
  for (std::size_t k = 0; k < found.times.size(); ++k) {
    table += fmt::format("{},{},{},{},{}\n", found.times[k], of_found[k].mean, of_found[k].spread, of_start[k].mean, of_start[k].spread);
  }
  save_text(job, found.name + ".csv", table);
  LinePanel panel;
  panel.title = fmt::format("{} on {}", found.name, found.file);
  panel.x_label = "t";
  panel.y_label = found.name;
  panel.curves = {{"learnt", found.times, found.course()}, {"at the start", start.times, start.course()}};
  std::vector<double> all = found.course();
  for (const double value : start.course()) all.push_back(value);
  if (std::ranges::any_of(all, [](double value) { return std::isfinite(value); })) save_picture(job, found.name, {panel});
}

}  // namespace

void write_trained(Job& job, const driver::Trainer& trainer) {
  const driver::TrainingState& state = trainer.state();
  if (state.losses.size() > 1) job.say(text_plot(loss_panel(trainer), terminal_is_utf8(), 64, 10));
  if (job.options().out.empty()) return;
  std::string table = "iteration,loss\n", epochs = "epoch,iterations,steps,rate,loss,validation\n";
  for (std::size_t k = 0; k < state.losses.size(); ++k) table += fmt::format("{},{}\n", k, state.losses[k]);
  for (std::size_t e = 0; e < state.epochs.size(); ++e) {
    const driver::Epoch& epoch = state.epochs[e];
    epochs += fmt::format("{},{},{},{},{},{}\n", e + 1, epoch.updates, epoch.unroll, epoch.rate, epoch.loss, std::isnan(epoch.validation) ? "" : fmt::format("{}", epoch.validation));
  }
  save_text(job, "loss.csv", table);
  save_text(job, "epochs.csv", epochs);
  const driver::Workspace workspace(*trainer.scene().compiled->problem, *trainer.scene().compiled->code, {}, 1);
  for (const driver::UnknownPart& part : trainer.parts()) {
    const auto values = trainer.best().segment(part.offset, part.size);
    const std::vector<double> numbers(values.data(), values.data() + part.size);
    if (part.kind == DPDE_UNKNOWN_COEFFICIENT) save_state(job, workspace, part.name, numbers);
    for (const network::Network& network : trainer.scene().compiled->problem->networks) {
      if (part.kind == DPDE_UNKNOWN_NETWORK && network.name == part.name) save_weights(job, network, numbers);
    }
  }
  if (std::ranges::any_of(state.losses, [](double loss) { return std::isfinite(loss) && loss > 0; })) save_picture(job, "loss", {loss_panel(trainer)});
}

Json report_tests(Job& job, const std::vector<driver::TrajectoryTest>& found, const std::vector<driver::TrajectoryTest>& start) {
  Json tests = Json::object();
  for (std::size_t i = 0; i < found.size() && i < start.size(); ++i) {
    const driver::MeanAndSpread learnt = driver::mean_and_spread(found[i].means()), before = driver::mean_and_spread(start[i].means());
    job.say(fmt::format("test {} = {:.6g} +- {:.2g} over {} runs of {} ({:.6g} +- {:.2g} at the start)\n", found[i].name, shown(learnt.mean), shown(learnt.spread),
                        found[i].runs.size(), found[i].file, shown(before.mean), shown(before.spread)));
    Json test = numbers_of(found[i]);
    test["t"] = json_numbers(found[i].times);
    test["start"] = numbers_of(start[i]);
    tests[found[i].name] = std::move(test);
    write_test(job, found[i], start[i]);
  }
  return tests;
}

}  // namespace dpde::tools
