// SPDX-License-Identifier: Apache-2.0
// A run as a NetCDF file with CF-style coordinates, and with all that it takes to make it again.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <set>
#include <string>

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

/// Where no unit is known every number is a ratio.
NetcdfAttributes described(const std::string& what, const std::string& unit = "");

/// Names of the dimensions of values at centres, and at faces, of each axis.
using AxisNames = std::vector<std::array<std::string, 2>>;
/// The axes, and for those along which states are staggered the places of the faces.
AxisNames add_axes(NetcdfContent& content, const driver::Session& session, const std::vector<model::Axis>& axes,
                   NetcdfNames& names);
/// The coordinate of times, in the scene's unit.
NetcdfVariable time_variable(const model::Problem& problem, const std::string& name, std::vector<double> times);
/// One number of the whole file.
NetcdfVariable parameter_variable(const model::Problem& problem, const model::Parameter& parameter);
/// Text, settings and numbers that make it again by `dpde VERB`; of a scene, or with `name` of a task.
void add_origin(NetcdfContent& content, const Job& job, const driver::Session& session, const std::string& verb = "run",
                const std::string& name = "");

/// What is told of a job that has its result in one file: in words, and as JSON. Nothing that is another number the
/// next time.
struct Told {
  std::string text;
  Json json = Json::object();
  void say(Job& job, const std::string& words) {
    text += words;
    job.say(words);
  }
};
/// Marks the content as the result of the job with this key; and what was told of it, where the file in the folder of
/// --out has such a mark.
void add_told(NetcdfContent& content, std::uint64_t key, const Told& told);
std::optional<Told> told_of_finished(const Job& job, const std::string& file, std::uint64_t key);

/// SCENE.nc in the folder of --out, and on three axes SCENE.xdmf. `with_centres`: of what lies on faces also the values
/// at the centres.
void save_netcdf(Job& job, const driver::Session& session, const Record& record, bool with_centres);

}  // namespace dpde::tools
