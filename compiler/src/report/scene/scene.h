// SPDX-License-Identifier: Apache-2.0
// What is said of a scene before it runs: its grid and names, order, stability, costs, and what it does not use.
#pragma once

#include <memory>

#include "driver/scene/session.h"
#include "report/report.h"
#include "report/training/costs.h"
#include "stability/stability_report.h"

namespace dpde::report {

struct CheckedScene {
  const SourceFile& source;
  const driver::Compiled& compiled;          // a scene
  std::unique_ptr<driver::Session> session;  // as a run would begin; null where its initial state cannot be made
};
struct SceneOptions {
  GradientLimits gradient;
  stability::Look look;
  bool shows_waves = false;       // how a step damps and delays waves
  bool measures_machine = false;  // again
};

/// The JSON is that of dpde check. Warnings go to `sink`. The session ends before the machine is measured, so that its
/// fields do not lie beside what that takes.
Report scene_report(CheckedScene scene, const SceneOptions& options, DiagnosticSink& sink);

}  // namespace dpde::report
