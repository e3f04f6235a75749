// SPDX-License-Identifier: Apache-2.0
// The files of a run: NetCDF with CF-style coordinates, arrays of one field, a table of observables. What `dpde run`
// and hosts write is made here of a record and of a description that knows no compiler.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "dpde/runtime/netcdf.h"
#include "dpde/runtime/run_record.h"

namespace dpde {

/// Points along an axis, and what each stands for: its lower and upper bound in turn.
struct RunPoints {
  std::vector<double> places, bounds;
};
struct RunAxis {
  std::string name;      // x, y, z
  std::string in_words;  // what readers call it: lon
  std::string unit;      // "": none is known
  bool is_periodic = false;
  RunPoints centres;
  std::optional<RunPoints> faces;  // the upper ones of the cells, where states are staggered along it
};
struct RunField {
  std::string name, unit;
  std::array<bool, 3> on_faces{};  // along each axis
  /// Of what lies on faces, where it is wanted at the centres too: states there of states, one after the other.
  std::function<std::vector<double>(std::vector<double>)> at_centres = nullptr;
};
struct RunNumber {
  std::string name, unit;
  double value = 0;  // of a parameter
};
/// What the pictures of a run show beside its record.
struct RunEnd {
  double time = 0;
  std::vector<std::string> states, outputs;  // outputs: those with a formula
  std::function<std::vector<double>(const std::string&)> at_end, at_start;
};
struct RunDescription {
  std::string scene;
  std::vector<RunAxis> axes;
  std::vector<RunField> fields;
  std::vector<Series> outputs;  // what the scene says is recorded; none: all states at begin and end
  std::vector<RunNumber> observables, params;
  std::string time_unit;
  int steps = 0;
  bool is_single = false;       // floats
  NetcdfAttributes attributes;  // what it takes to make the run again
  std::set<std::string> names;  // that are taken
  /// What has to be the same for a run to go on, by name, but for parameters and states.
  std::function<std::vector<std::pair<std::string, std::string>>()> identity = nullptr;
  /// Draws the run's pictures in that folder, where whoever describes it can draw: the names of their files.
  /// @throws Error(machine)
  std::function<std::vector<std::string>(const std::filesystem::path&, const RunRecord&, const RunEnd&)> draw = nullptr;
};

/// Names no variable of the user has.
class NetcdfNames {
 public:
  explicit NetcdfNames(std::set<std::string> taken) : taken_(std::move(taken)) {}
  std::string free(std::string name);

 private:
  std::set<std::string> taken_;
};

/// Where no unit is known every number is a ratio.
NetcdfAttributes described(const std::string& what, const std::string& unit = "");
/// Names of the dimensions of values at centres, and at faces, of each axis.
using AxisNames = std::vector<std::array<std::string, 2>>;
AxisNames add_axes(NetcdfContent& content, const std::vector<RunAxis>& axes, NetcdfNames& names);
NetcdfVariable time_variable(const std::string& name, const std::string& unit, std::vector<double> times);
/// One number of the whole file.
NetcdfVariable parameter_variable(const RunNumber& parameter);

/// All series, with the observables at the times of the first one. @throws Error(machine), of which no file is left.
void write_run(const std::filesystem::path& path, const RunDescription& run, const RunRecord& record);
/// For ParaView, of a run on three axes in the NetCDF file of that name.
std::string xdmf_of(const std::string& file, const RunDescription& run, const RunRecord& record);
/// All states of a field as .npy. @throws Error(machine), of which no file is left.
void write_states(const std::filesystem::path& path, const RunDescription& run, const RunRecord& record,
                  const Series& series, const std::string& field);
/// One state of a field as .npy. @throws as write_states()
void write_state(const std::filesystem::path& path, const RunDescription& run, const std::vector<double>& values);
/// Steps, times and observables, with commas between.
std::string table_of(const Series& series);

}  // namespace dpde
