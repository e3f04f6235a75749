// SPDX-License-Identifier: Apache-2.0
// States of a scene as files and pictures, in the folder of --out.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "command.h"
#include "driver/scene/session.h"
#include "plot/picture.h"
#include "report/report.h"

namespace dpde::tools {

/// Makes options().out; false and a diagnostic when it cannot. Without --out there are no files: true.
bool prepare_out(Job& job);
/// NAME.npy in the folder of --out, of shape (nz, ny, nx) without the axes that are not there; where there are more
/// values than cells, with their number in front.
void save_state(Job& job, const std::vector<model::Axis>& axes, const std::string& name,
                const std::vector<double>& values);
/// A file in the folder of --out that `write` writes, throwing what is told.
void save_file(Job& job, const std::string& name, const std::function<void(const std::filesystem::path&)>& write);
/// A text file in the folder of --out.
void save_text(Job& job, const std::string& name, const std::string& text);
/// NAME.svg and NAME.png in the folder of --out; says so when there is no gnuplot.
void save_picture(Job& job, const std::string& name, const std::vector<plot::Panel>& panels);

/// NAME.safetensors, in the precision that the network computes with.
void save_weights(Job& job, const network::Network& network, const std::vector<double>& values);

/// Cells an axis, for JSON.
Json json_cells(const driver::Session& session);
/// "128" or "64 x 32".
std::string cells_text(const driver::Session& session);

/// Says its words; its files and pictures go to the folder of --out.
void tell(Job& job, const report::Report& report);

}  // namespace dpde::tools
