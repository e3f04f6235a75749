// SPDX-License-Identifier: Apache-2.0
// The plain methods that a network is measured by: not only the ones that a person named (McGreivy and Hakim 2024: most
// comparisons are with a weak baseline).
#pragma once

#include <atomic>
#include <string>
#include <vector>

#include "chart/point.h"
#include "training/data/window_batches.h"
#include "training/tests/trajectory_test.h"

namespace dpde::training {

/// By test, of those that are compared: beside each plain scene that is named it by the methods that suit its
/// equations, with the steps that charts give these (chart::entries_on): parts of the largest stable one, the frames of
/// its file at their ends; where none is known, its own. What a scene with the same data has already is left out, and
/// what made the data, which other methods on its grid would come near for that alone.
struct PlainMethods {
  std::vector<std::vector<model::Test::Baseline>> more;
  /// "plain by advect=weno5: why", of those that are unstable at every step, or do not compile.
  std::vector<std::string> left_out;
};
/// `beside`: the results of the scenes that are named. Ends early, with what it has, where `stop` becomes true.
PlainMethods plain_methods(const TestScenes& scenes, const std::vector<std::vector<TrajectoryTest>>& beside,
                           const std::atomic<bool>* stop);
/// To the tests and behind their results. What does not compile goes to what is left out.
void add_plain_methods(TestScenes& scenes, PlainMethods& methods, const UnknownValues& values,
                       const BatchOptions& options, std::vector<std::vector<TrajectoryTest>>& beside);

/// Behind the results of the tests: the plain methods that are the best for their time in single precision, with solves
/// to `loose_tolerance` only, and both.
void add_cheaper_versions(TestScenes& scenes, const std::vector<std::vector<TestCost>>& costs,
                          const UnknownValues& values, const BatchOptions& options,
                          std::vector<std::vector<TrajectoryTest>>& beside);
inline constexpr double loose_tolerance = 1e-3;  // what flow solvers of the field have by default

}  // namespace dpde::training
