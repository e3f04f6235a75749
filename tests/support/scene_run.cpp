// SPDX-License-Identifier: Apache-2.0
#include "support/scene_run.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <sstream>

#include "support/opened_scene.h"

namespace dpde::testing {

SceneResult run_scene(const std::string& text, const std::string& scene, const Overrides& overrides,
                      driver::Backend backend) {
  OpenedScene opened(text, scene, {.overrides = overrides, .backend = backend});
  SceneResult result;
  if (!opened.session) return result;
  driver::Session& session = *opened.session;
  session.rollout().run();
  std::vector<Field> fields;
  fields.reserve(session.problem().states.size());
  std::vector<void*> states;
  for (size_t i = 0; i < session.problem().states.size(); ++i) {
    const std::vector<double> values = session.final_state(static_cast<int>(i));
    result.state[session.problem().states[i].name] = values;
    fields.emplace_back(session.workspace().layout(), static_cast<int>(i));
    fields.back().copy_in(values);
    states.push_back(fields.back().base());
  }
  for (const driver::ErrorNorms& error : session.errors(session.end_time(), states)) result.l2[error.field] = error.l2;
  return result;
}

TaskResult task_gradient(const std::string& text, const std::string& task, const Overrides& overrides,
                         const std::string& path) {
  OpenedScene opened(text, task, {.overrides = overrides, .adjoint = true, .path = path});
  TaskResult result;
  const auto inverse = opened.inverse();
  if (!inverse) return result;
  Eigen::VectorXd gradient(inverse->size());
  result.loss = inverse->value_and_gradient(inverse->start(), gradient);
  for (const auto& part : inverse->parts()) {
    result.gradient[part.name].assign(gradient.data() + part.offset, gradient.data() + part.offset + part.size);
  }
  return result;
}

double task_loss(const std::string& text, const std::string& task, const Overrides& overrides) {
  OpenedScene opened(text, task, {.overrides = overrides});
  const auto inverse = opened.inverse();
  return inverse ? inverse->value(inverse->start()) : std::nan("");
}

std::string read_file(const std::string& path) {
  std::ifstream in(path);
  EXPECT_TRUE(in.good()) << path;
  std::stringstream text;
  text << in.rdbuf();
  return text.str();
}

}  // namespace dpde::testing
