// SPDX-License-Identifier: Apache-2.0
// A run as a NetCDF file with CF-style coordinates, and with all that it takes to make it again.
#pragma once

#include <array>
#include <set>

#include "command.h"
#include "dpde/runtime/netcdf.h"
#include "record.h"

namespace dpde::tools {

/// Names no variable of the user has.
class NetcdfNames {
 public:
  explicit NetcdfNames(const driver::Session& session);
  std::string free(std::string name);

 private:
  std::set<std::string> taken_;
};

/// The language has no units: every number is a ratio.
NetcdfAttributes described(const std::string& what);

/// Names of the dimensions of values at centres, and at faces, of each axis.
using AxisNames = std::vector<std::array<std::string, 2>>;
/// The axes, and for those along which states are staggered the places of the faces.
AxisNames add_axes(NetcdfContent& content, const driver::Session& session, const std::vector<model::Axis>& axes, NetcdfNames& names);
/// Text, settings and numbers that make the scene again.
void add_origin(NetcdfContent& content, const Job& job, const driver::Session& session);

/// SCENE.nc in the folder of --out.
void save_netcdf(Job& job, driver::Session& session, const Record& record);

}  // namespace dpde::tools
