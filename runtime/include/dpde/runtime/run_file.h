// SPDX-License-Identifier: Apache-2.0
// The files of a run: NetCDF with CF-style coordinates, arrays of one field, a table of observables. Made from a record
// and a description that does not depend on the compiler; used by `dpde run` and by hosts.
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

/// Points along an axis and the cell of each: lower and upper bound alternate in `bounds`.
struct RunPoints {
  std::vector<double> places, bounds;
};
struct RunAxis {
  std::string name;      // x, y, z
  std::string in_words;  // name for readers: lon
  std::string unit;      // "": unknown
  bool is_periodic = false;
  RunPoints centres;
  std::optional<RunPoints> faces;  // upper faces of the cells, if states are staggered along the axis
};
struct RunField {
  std::string name, unit;
  std::array<bool, 3> on_faces{};  // along each axis
  /// For a field on faces whose values are also wanted at centres: interpolates states, one after the other.
  std::function<std::vector<double>(std::vector<double>)> at_centres = nullptr;
};
struct RunNumber {
  std::string name, unit;
  double value = 0;  // of a parameter
};
/// Further values that the pictures of a run show.
struct RunEnd {
  double time = 0;
  std::vector<std::string> states, outputs;  // outputs: those with a formula
  std::function<std::vector<double>(const std::string&)> at_end, at_start;
};
struct RunDescription {
  std::string scene;
  std::vector<RunAxis> axes;
  std::vector<RunField> fields;
  std::vector<Series> outputs;  // series that the scene records; empty: all states at begin and end
  std::vector<RunNumber> observables, params;
  std::string time_unit;
  int steps = 0;
  bool is_single = false;       // floats
  NetcdfAttributes attributes;  // settings that reproduce the run
  std::set<std::string> names;  // names in use
  /// Names and values that must agree for a run to be resumed, except parameters and states.
  std::function<std::vector<std::pair<std::string, std::string>>()> identity = nullptr;
  /// Draws the run's pictures in that folder and returns the names of their files; empty if the maker of the
  /// description cannot draw.
  std::function<std::vector<std::string>(const std::filesystem::path&, const RunRecord&, const RunEnd&)> draw = nullptr;
};

/// Generates names that no variable of the user has.
class NetcdfNames {
 public:
  explicit NetcdfNames(std::set<std::string> taken) : taken_(std::move(taken)) {}
  std::string free(std::string name);

 private:
  std::set<std::string> taken_;
};

/// Attributes of a variable; an empty unit is written as dimensionless.
NetcdfAttributes described(const std::string& what, const std::string& unit = "");
/// Names of the dimensions of values at centres, and at faces, of each axis.
using AxisNames = std::vector<std::array<std::string, 2>>;
AxisNames add_axes(NetcdfContent& content, const std::vector<RunAxis>& axes, NetcdfNames& names);
NetcdfVariable time_variable(const std::string& name, const std::string& unit, std::vector<double> times);
/// A variable with one number for the whole file.
NetcdfVariable parameter_variable(const RunNumber& parameter);

/// Writes all series, with the observables at the times of the first one. @throws Error(machine), leaving no file.
void write_run(const std::filesystem::path& path, const RunDescription& run, const RunRecord& record);
/// XDMF text for ParaView, of a run on three axes in the NetCDF file of that name.
std::string xdmf_of(const std::string& file, const RunDescription& run, const RunRecord& record);
/// Writes all states of a field as .npy. @throws Error(machine), leaving no file.
void write_states(const std::filesystem::path& path, const RunDescription& run, const RunRecord& record,
                  const Series& series, const std::string& field);
/// Writes one state of a field as .npy. @throws as write_states()
void write_state(const std::filesystem::path& path, const RunDescription& run, const std::vector<double>& values);
/// Steps, times and observables as comma-separated values.
std::string table_of(const Series& series);

}  // namespace dpde
