// SPDX-License-Identifier: Apache-2.0
// A scene or a task of a text, compiled, with its session open.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "driver/scene/inverse.h"
#include "driver/scene/session.h"
#include "support/scene_run.h"

namespace dpde::testing {

struct OpenWith {
  Overrides overrides = {};
  driver::Backend backend = driver::Backend::jit;
  bool adjoint = false, tangent = false;
  driver::SessionOptions session = {};
  std::string path = "test.dpde";  // data files are looked for beside it
};

/// Any diagnostic of error severity fails the running test; the session is none then.
class OpenedScene {
 public:
  OpenedScene(const std::string& text, const std::string& name, const OpenWith& with = {});

  /// The task as an inverse problem.
  std::unique_ptr<driver::Inverse> inverse();
  /// The states of a snapshot, x fastest.
  std::vector<std::vector<double>> states_of(const Snapshot& snapshot) const;

  SourceFile source;
  DiagnosticSink sink;
  std::unique_ptr<driver::Session> session;

 private:
  void report() const;
};

}  // namespace dpde::testing
