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
std::vector<Curve> loss_curves(const driver::TrainingState& state) {
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
  return {batches, epochs, validation};
}

/// Of several trials what they are judged by.
LinePanel loss_panel(const driver::Trials& trials) {
  LinePanel panel;
  panel.title = "loss";
  panel.x_label = "update";
  for (std::size_t k = 0; k < trials.all().size(); ++k) {
    std::vector<Curve> curves = loss_curves(trials.all()[k].trainer->state());
    if (trials.count() > 1) {
      Curve judged = curves[2].x.empty() ? curves[1] : curves[2];
      judged.title = fmt::format("{}, trial {}", judged.title, k + 1);
      curves = {std::move(judged)};
    }
    for (Curve& curve : curves) {
      if (!curve.x.empty()) panel.curves.push_back(std::move(curve));
    }
  }
  panel.log_y = std::ranges::all_of(panel.curves, [](const Curve& curve) { return all_positive(curve.y); });
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

/// What one test says of each trial, and of the start.
struct OneTest {
  std::vector<const driver::TrajectoryTest*> trials;
  std::size_t best = 0;
  const driver::TrajectoryTest* start = nullptr;

  const driver::TrajectoryTest& found() const { return *trials[best]; }
  bool has_trials() const { return trials.size() > 1; }
  /// Of the means over runs and times, over the trials.
  std::vector<double> means() const {
    std::vector<double> all;
    for (const driver::TrajectoryTest* trial : trials) all.push_back(driver::mean_and_spread(trial->means()).mean);
    return all;
  }
  driver::MeanAndSpread at(std::size_t time) const {
    std::vector<double> all;
    for (const driver::TrajectoryTest* trial : trials) all.push_back(trial->course()[time]);
    return driver::mean_and_spread(all);
  }
};

std::string table_of(const OneTest& test) {
  const driver::TrajectoryTest& found = test.found();
  std::string table = fmt::format("t,{0},{0}_spread,{0}_at_start,{0}_at_start_spread", found.name);
  for (std::size_t k = 0; test.has_trials() && k < test.trials.size(); ++k) table += fmt::format(",{}_of_trial_{}", found.name, k + 1);
  if (test.has_trials()) table += fmt::format(",{0}_of_trials,{0}_of_trials_spread", found.name);
  const auto of_found = spreads_of(found), of_start = spreads_of(*test.start);
  for (std::size_t k = 0; k < found.times.size(); ++k) {
    table += fmt::format("\n{},{},{},{},{}", found.times[k], of_found[k].mean, of_found[k].spread, of_start[k].mean, of_start[k].spread);
    if (!test.has_trials()) continue;
    for (const driver::TrajectoryTest* trial : test.trials) table += fmt::format(",{}", trial->course()[k]);
    table += fmt::format(",{},{}", test.at(k).mean, test.at(k).spread);
  }
  return table + "\n";
}

void write_test(Job& job, const OneTest& test) {
  if (job.options().out.empty()) return;
  const driver::TrajectoryTest& found = test.found();
  save_text(job, found.name + ".csv", table_of(test));
  LinePanel panel;
  panel.title = fmt::format("{} on {}", found.name, found.file);
  panel.x_label = "t";
  panel.y_label = found.name;
  for (std::size_t k = 0; k < test.trials.size(); ++k) {
    panel.curves.push_back({test.has_trials() ? fmt::format("trial {}", k + 1) : "learnt", found.times, test.trials[k]->course()});
  }
  panel.curves.push_back({"at the start", test.start->times, test.start->course()});
  const auto is_drawn = [](const Curve& curve) { return std::ranges::any_of(curve.y, [](double value) { return std::isfinite(value); }); };
  if (std::ranges::any_of(panel.curves, is_drawn)) save_picture(job, found.name, {panel});
}

Json report_test(Job& job, const OneTest& test) {
  const driver::MeanAndSpread learnt = driver::mean_and_spread(test.found().means()), before = driver::mean_and_spread(test.start->means());
  job.say(fmt::format("test {} = {:.6g} +- {:.2g} over {} runs of {} ({:.6g} +- {:.2g} at the start)\n", test.found().name, shown(learnt.mean), shown(learnt.spread),
                      test.found().runs.size(), test.found().file, shown(before.mean), shown(before.spread)));
  Json json = numbers_of(test.found());
  json["t"] = json_numbers(test.found().times);
  json["start"] = numbers_of(*test.start);
  if (!test.has_trials()) return json;
  const driver::MeanAndSpread over = driver::mean_and_spread(test.means());
  std::string each;
  for (const double mean : test.means()) each += fmt::format("{}{:.6g}", each.empty() ? "" : ", ", shown(mean));
  job.say(fmt::format("  trials: {}; mean {:.6g} +- {:.2g}\n", each, shown(over.mean), shown(over.spread)));
  json["trials"] = {{"mean", json_number(over.mean)}, {"spread", json_number(over.spread)}, {"each", Json::array()}};
  for (const driver::TrajectoryTest* trial : test.trials) json["trials"]["each"].push_back(numbers_of(*trial));
  return json;
}

/// Losses of all trials; of one alone without its number.
void write_losses(Job& job, const driver::Trials& trials) {
  const bool numbered = trials.count() > 1;
  std::string table = numbered ? "trial,iteration,loss\n" : "iteration,loss\n", epochs = std::string(numbered ? "trial," : "") + "epoch,iterations,steps,rate,loss,validation\n";
  for (std::size_t t = 0; t < trials.all().size(); ++t) {
    const driver::TrainingState& state = trials.all()[t].trainer->state();
    const std::string trial = numbered ? fmt::format("{},", t + 1) : "";
    for (std::size_t k = 0; k < state.losses.size(); ++k) table += fmt::format("{}{},{}\n", trial, k, state.losses[k]);
    for (std::size_t e = 0; e < state.epochs.size(); ++e) {
      const driver::Epoch& epoch = state.epochs[e];
      epochs += fmt::format("{}{},{},{},{},{},{}\n", trial, e + 1, epoch.updates, epoch.unroll, epoch.rate, epoch.loss, std::isnan(epoch.validation) ? "" : fmt::format("{}", epoch.validation));
    }
  }
  save_text(job, "loss.csv", table);
  save_text(job, "epochs.csv", epochs);
}

void write_unknowns(Job& job, const driver::Trainer& trainer) {
  const driver::Workspace workspace(*trainer.scene().compiled->problem, *trainer.scene().compiled->code, {}, 1);
  for (const driver::UnknownPart& part : trainer.parts()) {
    const auto values = trainer.best().segment(part.offset, part.size);
    const std::vector<double> numbers(values.data(), values.data() + part.size);
    if (part.kind == DPDE_UNKNOWN_COEFFICIENT) save_state(job, workspace, part.name, numbers);
    for (const network::Network& network : trainer.scene().compiled->problem->networks) {
      if (part.kind == DPDE_UNKNOWN_NETWORK && network.name == part.name) save_weights(job, network, numbers);
    }
  }
}

}  // namespace

void write_trained(Job& job, const driver::Trials& trials) {
  const LinePanel panel = loss_panel(trials);
  const auto has_line = [](const Curve& curve) { return curve.y.size() > 1; };
  if (std::ranges::any_of(panel.curves, has_line)) job.say(text_plot(panel, terminal_is_utf8(), 64, 10));
  if (job.options().out.empty()) return;
  write_losses(job, trials);
  write_unknowns(job, *trials.all()[trials.best()].trainer);
  const auto is_drawn = [](const Curve& curve) { return std::ranges::any_of(curve.y, [](double loss) { return std::isfinite(loss) && loss > 0; }); };
  if (std::ranges::any_of(panel.curves, is_drawn)) save_picture(job, "loss", {panel});
}

Json report_tests(Job& job, const TestResults& results) {
  Json tests = Json::object();
  for (std::size_t i = 0; i < results.start.size(); ++i) {
    OneTest test{{}, results.best, &results.start[i]};
    for (const std::vector<driver::TrajectoryTest>& trial : results.trials) {
      if (i < trial.size()) test.trials.push_back(&trial[i]);
    }
    if (test.trials.size() != results.trials.size()) continue;  // a file has gone: reported
    tests[test.start->name] = report_test(job, test);
    write_test(job, test);
  }
  return tests;
}

}  // namespace dpde::tools
