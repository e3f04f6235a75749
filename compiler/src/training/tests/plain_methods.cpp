// SPDX-License-Identifier: Apache-2.0
#include "training/tests/plain_methods.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "analysis/certificate/comparison.h"
#include "chart/common_steps.h"
#include "chart/sweep.h"
#include "model/analyse/solves.h"
#include "model/print/print_model.h"
#include "training/tests/beside.h"

namespace dpde::training {

namespace {

constexpr double alike = 1e-9;  // relative difference of steps that are equal except for rounding

struct Known {
  std::string on;
  model::Scheme scheme;
  double step;

  bool is(const Known& other) const {
    return on == other.on && scheme == other.scheme && std::abs(step - other.step) <= alike * step;
  }
};

/// The scheme without its block's name, for comparison.
Known known_as(const std::string& on, model::Scheme scheme, double step) {
  scheme.name.clear();
  return {on, std::move(scheme), step};
}

void leave_out(const model::Test::Baseline& beside, const std::string& why, PlainMethods& methods) {
  std::string text = fmt::format("{}: {}", title_of(beside), why);
  if (std::ranges::find(methods.left_out, text) == methods.left_out.end()) methods.left_out.push_back(std::move(text));
}

class Finder {
 public:
  Finder(const TestScenes& scenes, const std::atomic<bool>* stop, PlainMethods& found)
      : scenes_(scenes), stop_(stop), found_(found) {}

  std::vector<model::Test::Baseline> more_for(const model::Test& test, const std::vector<TrajectoryTest>& results) {
    std::vector<std::pair<model::Test::Baseline, const model::Problem*>> plain;
    std::vector<Known> known;
    for (std::size_t s = 0; s < test.beside.size(); ++s) {
      if (results[s].has_network) continue;
      const model::Problem& scene = *scenes_.beside->scene(test.beside[s]).compiled->problem;
      known.push_back(known_as(test.beside[s].on, scene.scheme, scene.step));
      if (!results[s].made_data) plain.emplace_back(test.beside[s], &scene);
    }
    std::vector<model::Test::Baseline> more;
    for (const auto& [beside, problem] : plain) {
      for (const chart::Entry& entry : entries_of(beside, *problem)) {
        model::Test::Baseline next{beside.scene, beside.on, beside.origin, entry.variant.method};
        next.method.insert(entry.variant.resolution.begin(), entry.variant.resolution.end());
        const bool has_step = entry.variant.resolution.contains("step");
        const double step = has_step ? std::stod(entry.variant.resolution.at("step")) : problem->step;
        const Known method = known_as(beside.on, model::with_settings(problem->scheme, entry.variant.method), step);
        if (std::ranges::any_of(known, [&](const Known& other) { return method.is(other); })) continue;
        known.push_back(method);
        if (has_step && std::abs(step - problem->step) <= alike * step) next.method.erase("step");
        more.push_back(std::move(next));
      }
    }
    return more;
  }

 private:
  const std::vector<chart::Entry>& entries_of(const model::Test::Baseline& beside, const model::Problem& problem) {
    const auto [there, is_new] = entries_.try_emplace({beside.scene, beside.on});
    if (is_new) there->second = with_steps(beside, problem);
    return there->second;
  }

  /// The methods with their steps; omits methods without a stable step.
  std::vector<chart::Entry> with_steps(const model::Test::Baseline& beside, const model::Problem& problem) {
    chart::PointOptions options;
    options.compile = options_beside(*scenes_.own.compiled, beside.scene);
    options.compile.selection.name = beside.scene;
    options.compile.selection.beside.clear();
    options.compile.without_task = true;
    options.common_steps = std::gcd(scenes_.beside->scene(beside).trajectories.every, chart::common_steps(problem));
    std::vector<chart::Entry> entries = chart::entries_on(problem, {}, {});
    std::erase_if(entries, [&](chart::Entry& entry) {
      chart::Point point;
      if (stop_ != nullptr && stop_->load()) return true;
      if (!chart::choose_step(scenes_.source, options, problem, entry, point)) {
        leave_out({beside.scene, beside.on, beside.origin, entry.variant.method}, point.failure, found_);
        return true;
      }
      if (!(point.largest_step > 0)) entry.variant.resolution.clear();
      return false;
    });
    return entries;
  }

  const TestScenes& scenes_;
  const std::atomic<bool>* stop_;
  PlainMethods& found_;
  std::map<std::pair<std::string, std::string>, std::vector<chart::Entry>> entries_;  // by scene and file
};

}  // namespace

PlainMethods plain_methods(const TestScenes& scenes, const std::vector<std::vector<TrajectoryTest>>& beside,
                           const std::atomic<bool>* stop) {
  PlainMethods found;
  Finder finder(scenes, stop, found);
  for (std::size_t i = 0; i < scenes.tests.size(); ++i) {
    found.more.emplace_back();
    if (is_compared(scenes.tests[i])) found.more.back() = finder.more_for(scenes.tests[i], beside[i]);
  }
  return found;
}

void add_plain_methods(TestScenes& scenes, PlainMethods& methods, const UnknownValues& values,
                       const BatchOptions& options, std::vector<std::vector<TrajectoryTest>>& beside) {
  for (std::size_t i = 0; i < methods.more.size(); ++i) {
    for (const model::Test::Baseline& more : methods.more[i]) {
      if (options.stop != nullptr && options.stop->load()) return;
      DiagnosticSink why;
      if (scenes.add(i, more, why))
        beside[i].push_back(test_beside(scenes, i, more, values, options));
      else
        leave_out(more, why.all().front().message, methods);
    }
  }
}

namespace {

/// Settings that make a method cheaper.
std::vector<std::map<std::string, std::string>> cheaper_settings(const model::Problem& problem) {
  std::vector<std::map<std::string, std::string>> all;
  const bool is_double = problem.scheme.real == Precision::f64;
  if (is_double) all.push_back({{"real", "f32"}});
  SolveBy loose = problem.scheme.solve;
  if (model::solves_of(problem).empty() || loose.tolerance >= loose_tolerance) return all;
  loose.tolerance = loose_tolerance;
  all.push_back({{"solve", model::print(loose)}});
  if (is_double) all.push_back({{"real", "f32"}, {"solve", model::print(loose)}});
  return all;
}

/// Indices of the plain scenes on the Pareto front of cost and error.
std::vector<std::size_t> front_of(const std::vector<TrajectoryTest>& beside, const std::vector<TestCost>& costs) {
  std::vector<analysis::CostAndError> plain;
  for (std::size_t s = 0; s < beside.size(); ++s) {
    if (!beside[s].has_network && !beside[s].made_data)
      plain.push_back({std::to_string(s), costs[s + 1].least(), mean_and_spread(beside[s].errors()).mean});
  }
  std::vector<std::size_t> front;
  for (const analysis::CostAndError& best : analysis::best_of(plain)) front.push_back(std::stoul(best.scene));
  return front;
}

}  // namespace

void add_cheaper_versions(TestScenes& scenes, const std::vector<std::vector<TestCost>>& costs,
                          const UnknownValues& values, const BatchOptions& options,
                          std::vector<std::vector<TrajectoryTest>>& beside) {
  for (std::size_t i = 0; i < scenes.tests.size(); ++i) {
    if (!is_compared(scenes.tests[i])) continue;
    for (const std::size_t s : front_of(beside[i], costs[i])) {
      const model::Test::Baseline strict = scenes.tests[i].beside[s];
      for (const auto& settings : cheaper_settings(*scenes.beside->scene(strict).compiled->problem)) {
        model::Test::Baseline cheaper = strict;
        for (const auto& [key, value] : settings) cheaper.method[key] = value;
        DiagnosticSink silent;
        if (!scenes.add(i, cheaper, silent)) continue;
        beside[i].push_back(test_beside(scenes, i, cheaper, values, options));
        if (beside[i].back().runs != beside[i][s].runs) continue;
        beside[i].pop_back();  // the tolerance had no effect on its solves
        scenes.tests[i].beside.pop_back();
      }
    }
  }
}

}  // namespace dpde::training
