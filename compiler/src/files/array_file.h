// SPDX-License-Identifier: Apache-2.0
// Fields from .npy and NetCDF files that must fit the grid.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "dpde/runtime/netcdf.h"
#include "model/model.h"
#include "source/diagnostic.h"

namespace dpde::files {

/// What to read. Of a .nc file: `variable` ("": its only field) at `times` (none: its last state). Of a .npy file: all
/// of it, one state after the other along a leading axis when there are several times.
struct ArrayFile {
  std::string file, variable;
  std::vector<double> times;
  /// Of a last state: what it is called, and the times of the states that it is compared with. Another time is a
  /// warning.
  std::string name = {};
  std::vector<double> compared_at = {};
  /// What the values are in where they go; of a .nc file whose `units` are another one that is an error. "": not known.
  std::string unit = {};
};

/// The states one after the other, each dense and x fastest. Reports cannot-read, bad-array-file, wrong-shape,
/// data-without-time, data-not-finite and, of values too large for `real`, not-in-precision at `where`.
std::optional<std::vector<double>> load_array(const ArrayFile& from, const SourceFile& source,
                                              const std::vector<model::Axis>& axes, Precision real, SourceRange where,
                                              DiagnosticSink& sink);
/// The same for a formula's place.
std::optional<std::vector<double>> load_array(const model::Source& from, const std::string& unit,
                                              const SourceFile& source, const std::vector<model::Axis>& axes,
                                              Precision real, DiagnosticSink& sink);

/// Why the coordinates that a file has along `dimension` are not those of `axis`; "" when they are, or when it has
/// none.
std::string axis_mismatch(const NetcdfReader& file, const model::Axis& axis, const std::string& dimension);

}  // namespace dpde::files
