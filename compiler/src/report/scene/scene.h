// SPDX-License-Identifier: Apache-2.0
// Report of a scene before it runs: grid, names, order, stability, costs, and unused parts.
#pragma once

#include <memory>

#include "driver/scene/session.h"
#include "report/report.h"
#include "report/training/costs.h"
#include "stability/stability_report.h"

namespace dpde::report {

struct CheckedScene {
  const SourceFile& source;
  const driver::Compiled& compiled;          // of a scene
  std::unique_ptr<driver::Session> session;  // at the start of a run; null if its initial state cannot be computed
};
struct SceneOptions {
  GradientLimits gradient;
  stability::Look look;
  bool shows_waves = false;       // damping and delay of waves in a step
  bool measures_machine = false;  // measure again, ignoring cached values
};

/// The JSON is that of dpde check. Warnings go to `sink`. The session is freed before the machine is measured, so that
/// its fields take no memory then.
Report scene_report(CheckedScene scene, const SceneOptions& options, DiagnosticSink& sink);

}  // namespace dpde::report
