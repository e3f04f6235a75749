// SPDX-License-Identifier: Apache-2.0
#include "support/scene_run.h"

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "driver/inverse.h"
#include "driver/session.h"
#include "source/render.h"

namespace dpde::testing {

namespace {

/// A compiled selection with its session open.
struct Opened {
  SourceFile source;
  DiagnosticSink sink;
  std::unique_ptr<driver::Session> session;

  Opened(const std::string& text, const std::string& path, const driver::CompileOptions& options) : source(path, text) {
    auto compiled = driver::compile(source, options, sink);
    if (compiled) {
      session = driver::Session::open(source, std::make_shared<const driver::Compiled>(std::move(*compiled)), {}, sink);
    }
    report();
  }
  void report() const {
    for (const Diagnostic& d : sink.all()) {
      if (d.kind->severity == Severity::error) ADD_FAILURE() << render_text(source, d);
    }
  }
};

driver::CompileOptions options_for(const std::string& name, const Overrides& overrides, driver::Backend backend) {
  driver::CompileOptions options;
  options.selection.name = name;
  options.selection.overrides = overrides;
  options.backend = backend;
  options.verify = true;
  return options;
}

}  // namespace

SceneResult run_scene(const std::string& text, const std::string& scene, const Overrides& overrides,
                      driver::Backend backend) {
  Opened opened(text, "test.dpde", options_for(scene, overrides, backend));
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
  driver::CompileOptions options = options_for(task, overrides, driver::Backend::jit);
  options.adjoint = true;
  Opened opened(text, path, options);
  TaskResult result;
  if (!opened.session) return result;
  const auto inverse = driver::Inverse::open(*opened.session, opened.source, opened.sink);
  opened.report();
  if (!inverse) return result;
  Eigen::VectorXd gradient(inverse->size());
  result.loss = inverse->value_and_gradient(inverse->start(), gradient);
  for (const auto& part : inverse->parts()) {
    result.gradient[part.name].assign(gradient.data() + part.offset, gradient.data() + part.offset + part.size);
  }
  return result;
}

std::string read_file(const std::string& path) {
  std::ifstream in(path);
  EXPECT_TRUE(in.good()) << path;
  std::stringstream text;
  text << in.rdbuf();
  return text.str();
}

}  // namespace dpde::testing
