// SPDX-License-Identifier: Apache-2.0
// Writes states of a scene to files and pictures in the folder of --out.
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

/// Makes the folder options().out; returns false with a diagnostic on failure, true without --out.
bool prepare_out(Job& job);
/// Writes NAME.npy to the folder of --out, of shape (nz, ny, nx) without absent axes; several states get their count as
/// the first dimension.
void save_state(Job& job, const std::vector<model::Axis>& axes, const std::string& name,
                const std::vector<double>& values);
/// A file in the folder of --out, written by `write`; its exceptions become diagnostics.
void save_file(Job& job, const std::string& name, const std::function<void(const std::filesystem::path&)>& write);
/// Writes a text file to the folder of --out.
void save_text(Job& job, const std::string& name, const std::string& text);
/// Writes NAME.svg and NAME.png to the folder of --out; reports if gnuplot is missing.
void save_picture(Job& job, const std::string& name, const std::vector<plot::Panel>& panels);

/// Writes NAME.safetensors, in the precision of the network.
void save_weights(Job& job, const network::Network& network, const std::vector<double>& values);

/// Cells along each axis, for JSON.
Json json_cells(const driver::Session& session);
/// "128" or "64 x 32".
std::string cells_text(const driver::Session& session);

/// Prints its text; writes its files and pictures to the folder of --out.
void tell(Job& job, const report::Report& report);

}  // namespace dpde::tools
