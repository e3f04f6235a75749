// SPDX-License-Identifier: Apache-2.0
// Writes a run to a NetCDF file with CF-style coordinates and all settings that reproduce it.
#pragma once

#include <string>

#include "command.h"
#include "dpde/runtime/run_file.h"
#include "driver/report/run_description.h"
#include "driver/scene/session.h"

namespace dpde::tools {

/// Settings that reproduce it with `dpde VERB`, for a scene, or with `name` for a task.
driver::RunOrigin origin_of(const Job& job, const std::string& verb = "run", const std::string& name = "");
/// The same with text, settings and numbers.
NetcdfAttributes attributes_of(const Job& job, const driver::Session& session, const std::string& verb = "run",
                               const std::string& name = "");
/// Generates names that no variable of the scene has.
NetcdfNames free_names(const driver::Session& session);

/// Metadata of a run for its files. `with_centres`: fields on faces are also interpolated to centres.
RunDescription description_of(const Job& job, driver::Session& session, bool with_centres);
/// Writes SCENE.nc to the folder of --out, and on three axes SCENE.xdmf.
void save_netcdf(Job& job, const RunDescription& run, const RunRecord& record);

}  // namespace dpde::tools
