// SPDX-License-Identifier: Apache-2.0
// Writes a gradient with its certificate to files.
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

/// Writes TASK_gradient.json, with `result`, and TASK_gradient.nc, with the fields, the settings that reproduce them
/// and the certificate, to the folder of --out.
void save_gradient(Job& job, const driver::Session& session, std::vector<GradientField> fields, const Json& result);

}  // namespace dpde::tools
