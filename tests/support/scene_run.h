// SPDX-License-Identifier: Apache-2.0
// Runs scenes and tasks from text through the whole compiler, as the command does.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "driver/compile/pipeline.h"

namespace dpde::testing {

using Overrides = std::map<std::string, std::string>;

struct SceneResult {
  std::map<std::string, double> l2;                  // error against the scene's exact solution
  std::map<std::string, std::vector<double>> state;  // at the end, x fastest
};

/// Runs a scene to its end; any error diagnostic fails the running test.
SceneResult run_scene(const std::string& text, const std::string& scene, const Overrides& overrides = {},
                      driver::Backend backend = driver::Backend::jit);

struct TaskResult {
  double loss = 0;
  std::map<std::string, std::vector<double>> gradient;  // by unknown: states x fastest, parameters one value
};

/// Loss and gradient of a task at its initial values. `path`: folder of its data files.
TaskResult task_gradient(const std::string& text, const std::string& task, const Overrides& overrides = {},
                         const std::string& path = "test.dpde");

/// Only the loss; no derivative is derived or compiled.
double task_loss(const std::string& text, const std::string& task, const Overrides& overrides = {});

/// The text of a file; fails the running test if there is none.
std::string read_file(const std::string& path);

}  // namespace dpde::testing
