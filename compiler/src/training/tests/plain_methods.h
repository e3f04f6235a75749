// SPDX-License-Identifier: Apache-2.0
// Plain methods as baselines for a network, in addition to those named in the task (McGreivy and Hakim 2024: most
// comparisons are with a weak baseline).
#pragma once

#include <atomic>
#include <string>
#include <vector>

#include "chart/point.h"
#include "training/data/window_batches.h"
#include "training/tests/trajectory_test.h"

namespace dpde::training {

/// For each test with comparisons: each named plain scene with all methods suited to its equations. Steps are those of
/// charts (chart::entries_on): fractions of the largest stable step that hit the frames of its file; if none is known,
/// the scene's own. Omits methods that a scene with the same data has already, and the method that made the data, since
/// others on its grid would converge to it for that reason alone.
struct PlainMethods {
  std::vector<std::vector<model::Test::Baseline>> more;
  /// "plain by advect=weno5: why", for methods that are unstable at every step or do not compile.
  std::vector<std::string> left_out;
};
/// `beside`: results of the named scenes. Returns early with the methods so far if `stop` becomes true.
PlainMethods plain_methods(const TestScenes& scenes, const std::vector<std::vector<TrajectoryTest>>& beside,
                           const std::atomic<bool>* stop);
/// Adds the methods to the tests and their results. Methods that do not compile are added to `left_out`.
void add_plain_methods(TestScenes& scenes, PlainMethods& methods, const UnknownValues& values,
                       const BatchOptions& options, std::vector<std::vector<TrajectoryTest>>& beside);

/// Adds to the results of the tests: the plain methods on the Pareto front in single precision, with solves to
/// `loose_tolerance`, and with both.
void add_cheaper_versions(TestScenes& scenes, const std::vector<std::vector<TestCost>>& costs,
                          const UnknownValues& values, const BatchOptions& options,
                          std::vector<std::vector<TrajectoryTest>>& beside);
inline constexpr double loose_tolerance = 1e-3;  // typical default of flow solvers

}  // namespace dpde::training
