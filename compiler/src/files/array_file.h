// SPDX-License-Identifier: Apache-2.0
// Reads fields from .npy and NetCDF files, which must fit the grid.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "dpde/runtime/netcdf.h"
#include "model/model.h"
#include "source/diagnostic.h"

namespace dpde::files {

/// What to read. From a .nc file: `variable` ("": its only field) at `times` (empty: its last state). From a .npy file:
/// all of it; several times are along a leading axis.
struct ArrayFile {
  std::string file, variable;
  std::vector<double> times;
  /// For a last state: its name, and the times of the states it is compared with. Another time causes a warning.
  std::string name = {};
  std::vector<double> compared_at = {};
  /// Required unit; another unit in a .nc file's `units` is an error. "": unknown.
  std::string unit = {};
};

/// The states one after the other, without ghost cells, x fastest. Reports cannot-read, bad-array-file, wrong-shape,
/// data-without-time, data-not-finite and, for values too large for `real`, not-in-precision at `where`.
std::optional<std::vector<double>> load_array(const ArrayFile& from, const SourceFile& source,
                                              const std::vector<model::Axis>& axes, Precision real, SourceRange where,
                                              DiagnosticSink& sink);
/// The same for a source of a formula or field.
std::optional<std::vector<double>> load_array(const model::Source& from, const std::string& unit,
                                              const SourceFile& source, const std::vector<model::Axis>& axes,
                                              Precision real, DiagnosticSink& sink);

/// Why the file's coordinates along `dimension` differ from those of `axis`; "" if they agree or the file has none.
std::string axis_mismatch(const NetcdfReader& file, const model::Axis& axis, const std::string& dimension);

}  // namespace dpde::files
