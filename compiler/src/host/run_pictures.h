// SPDX-License-Identifier: Apache-2.0
// Pictures of a run for hosts, as those of `dpde run`.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "dpde/runtime/run_file.h"
#include "driver/scene/session.h"

namespace dpde::host {

/// For RunDescription::draw. Draws nothing without gnuplot.
std::function<std::vector<std::string>(const std::filesystem::path&, const RunRecord&, const RunEnd&)> drawing(
    std::shared_ptr<const driver::Compiled> compiled, std::vector<model::Axis> axes);

}  // namespace dpde::host
