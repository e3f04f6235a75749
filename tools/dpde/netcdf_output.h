// SPDX-License-Identifier: Apache-2.0
// A run as a NetCDF file with CF-style coordinates, and with all that it takes to make it again.
#pragma once

#include <string>

#include "command.h"
#include "dpde/runtime/run_file.h"
#include "driver/report/run_description.h"
#include "driver/scene/session.h"

namespace dpde::tools {

/// What makes it again by `dpde VERB`; of a scene, or with `name` of a task.
driver::RunOrigin origin_of(const Job& job, const std::string& verb = "run", const std::string& name = "");
/// That with text, settings and numbers.
NetcdfAttributes attributes_of(const Job& job, const driver::Session& session, const std::string& verb = "run",
                               const std::string& name = "");
/// Names that no variable of the scene has.
NetcdfNames free_names(const driver::Session& session);

/// What the files of a run say of it. `with_centres`: of what lies on faces also the values at the centres.
RunDescription description_of(const Job& job, driver::Session& session, bool with_centres);
/// SCENE.nc in the folder of --out, and on three axes SCENE.xdmf.
void save_netcdf(Job& job, const RunDescription& run, const RunRecord& record);

}  // namespace dpde::tools
