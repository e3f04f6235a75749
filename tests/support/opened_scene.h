// SPDX-License-Identifier: Apache-2.0
// A compiled scene or task of a text, with an open session.
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
  std::string path = "test.dpde";  // folder of relative data files
};

/// Any error diagnostic fails the running test; then there is no session.
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
