// SPDX-License-Identifier: Apache-2.0
// The pictures that hosts draw of a run: those of `dpde run`.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "dpde/runtime/run_file.h"
#include "driver/scene/session.h"

namespace dpde::host {

/// For RunDescription::draw. Without gnuplot nothing is drawn.
std::function<std::vector<std::string>(const std::filesystem::path&, const RunRecord&, const RunEnd&)> drawing(
    std::shared_ptr<const driver::Compiled> compiled, std::vector<model::Axis> axes);

}  // namespace dpde::host
