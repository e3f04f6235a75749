// SPDX-License-Identifier: Apache-2.0
#include "training/tests/test_conditions.h"

#include <algorithm>
#include <cmath>
#include <span>

namespace dpde::training {

namespace {

using files::Trajectories;

double rms(std::span<const double> values) {
  double squares = 0;
  for (const double value : values) squares += value * value;
  return std::sqrt(squares / static_cast<double>(values.size()));
}

std::vector<std::string> shared_states(const Trajectories& a, const Trajectories& b) {
  std::vector<std::string> shared;
  for (const std::string& state : a.states) {
    if (std::ranges::find(b.states, state) != b.states.end()) shared.push_back(state);
  }
  return shared;
}

/// Compares the parameters that both files have: runs that start from the same state of rest may still differ.
bool has_same_params(const Trajectories& learnt, int r, const Trajectories& on, int run) {
  for (std::size_t p = 0; p < on.params.size(); ++p) {
    const auto known = std::ranges::find(learnt.params, on.params[p]);
    if (known == learnt.params.end()) continue;
    const auto q = static_cast<std::size_t>(known - learnt.params.begin());
    if (on.runs[static_cast<std::size_t>(run)].params[p] != learnt.runs[static_cast<std::size_t>(r)].params[q])
      return false;
  }
  return true;
}

bool is_frame_of(const Trajectories& learnt, const Trajectories& on, int run, const std::vector<std::string>& states) {
  for (int r = 0; r < static_cast<int>(learnt.runs.size()); ++r) {
    if (!has_same_params(learnt, r, on, run)) continue;
    for (int frame = 0; frame < learnt.frame_count(); ++frame) {
      const auto is_same = [&](const std::string& state) {
        return std::ranges::equal(on.frames(run, state, 0), learnt.frames(r, state, frame));
      };
      if (std::ranges::all_of(states, is_same)) return true;
    }
  }
  return false;
}

/// Adds values outside the range of `all`, except for rounding of numbers in files.
void add_outside(const std::string& what, const std::vector<double>& all, const std::vector<double>& of_runs,
                 TestConditions& conditions) {
  constexpr double rounding = 1e-6;
  TestConditions::Outside found{what, *std::ranges::min_element(all), *std::ranges::max_element(all)};
  const double margin = rounding * std::max(std::abs(found.low), std::abs(found.high));
  for (std::size_t run = 0; run < of_runs.size(); ++run) {
    if (of_runs[run] < found.low - margin || of_runs[run] > found.high + margin)
      found.runs[static_cast<int>(run)] = of_runs[run];
  }
  if (!found.runs.empty()) conditions.outside.push_back(std::move(found));
}

/// Values of a parameter for each run.
std::vector<double> values_of(const Trajectories& on, const std::string& param) {
  const auto at = static_cast<std::size_t>(std::ranges::find(on.params, param) - on.params.begin());
  std::vector<double> values;
  for (const Trajectories::Run& run : on.runs) values.push_back(run.params[at]);
  return values;
}

/// Compares parameters that have a range, and the first states.
void compare_runs(const Trajectories& learnt, const Trajectories& on, TestConditions& conditions) {
  const std::vector<std::string> states = shared_states(on, learnt);
  const int runs = static_cast<int>(on.runs.size());
  for (int run = 0; run < runs && !states.empty() && !conditions.is_training_file; ++run) {
    if (is_frame_of(learnt, on, run, states)) conditions.known_runs.push_back(run);
  }
  for (const std::string& param : on.params) {
    const bool is_known = std::ranges::find(learnt.params, param) != learnt.params.end();
    const bool only_counts = on.counted.contains(param) && learnt.counted.contains(param);
    if (is_known && !only_counts) add_outside(param, values_of(learnt, param), values_of(on, param), conditions);
  }
  for (const std::string& state : states) {
    std::vector<double> all, first;
    for (int run = 0; run < static_cast<int>(learnt.runs.size()); ++run) {
      for (int frame = 0; frame < learnt.frame_count(); ++frame) all.push_back(rms(learnt.frames(run, state, frame)));
    }
    for (int run = 0; run < runs; ++run) first.push_back(rms(on.frames(run, state, 0)));
    add_outside("rms of " + state, all, first, conditions);
  }
}

}  // namespace

TestConditions conditions_of(const Trajectories* learnt, const Trajectories& on) {
  TestConditions conditions;
  conditions.own_errors = on.own_errors;
  conditions.knows_training = learnt != nullptr;
  if (learnt == nullptr) return conditions;
  conditions.is_training_file = std::ranges::find_first_of(on.hashes, learnt->hashes) != on.hashes.end();
  compare_runs(*learnt, on, conditions);
  return conditions;
}

}  // namespace dpde::training
