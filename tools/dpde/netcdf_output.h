// SPDX-License-Identifier: Apache-2.0
// A run as a NetCDF file with CF-style coordinates, and with all that it takes to make it again.
#pragma once

#include "command.h"
#include "record.h"

namespace dpde::tools {

/// SCENE.nc in the folder of --out.
void save_netcdf(Job& job, driver::Session& session, const Record& record);

}  // namespace dpde::tools
