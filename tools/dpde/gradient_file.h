// SPDX-License-Identifier: Apache-2.0
// A gradient with its certificate, as files.
#pragma once

#include <string>
#include <vector>

#include "command.h"
#include "driver/scene/session.h"

namespace dpde::tools {

struct GradientField {
  std::string name;  // of the unknown
  std::vector<double> values;
};

/// TASK_gradient.json, `result`, and TASK_gradient.nc, the fields with what it takes to make them again and the
/// certificate, in the folder of --out.
void save_gradient(Job& job, const driver::Session& session, std::vector<GradientField> fields, const Json& result);

}  // namespace dpde::tools
