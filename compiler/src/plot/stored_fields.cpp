// SPDX-License-Identifier: Apache-2.0
#include "plot/stored_fields.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "dpde/runtime/error.h"
#include "dpde/runtime/netcdf.h"
#include "dpde/runtime/npy.h"
#include "files/files.h"
#include "model/boundary/metric.h"

namespace dpde::plot {

namespace {

using Fields = std::vector<StoredField>;

/// The fields of a NetCDF file: variables on one to three axes and optionally time.
class NetcdfFields {
 public:
  NetcdfFields(const NetcdfReader& file, bool all_states) : file_(file), all_states_(all_states) {}

  std::vector<std::string> names() const {
    std::vector<std::string> names;
    for (const NetcdfReader::Variable& variable : file_.variables()) {
      if (is_field(variable)) names.push_back(variable.name);
    }
    return names;
  }

  StoredField field(const std::string& name) const {
    const NetcdfReader::Variable& variable = *file_.find(name);
    StoredField field{name, {}, {}, {}, unit_of(name), has_time(variable) ? unit_of(variable.dimensions[0]) : ""};
    const std::string coordinates = file_.text("", "dpde_coordinates").value_or("");
    if (!coordinates.empty()) field.system = model::system_of(coordinates);
    for (std::size_t d = variable.shape.size(); d-- > (has_time(variable) ? 1u : 0u);) {
      field.axes.push_back(axis(variable.dimensions[d], variable.shape[d]));
    }
    if (!has_time(variable)) {
      field.states.push_back(file_.read(variable));
      return field;
    }
    const std::int64_t count = variable.shape[0];
    const std::vector<double> times = places(variable.dimensions[0], count);
    for (std::int64_t k = all_states_ ? 0 : count - 1; k < count; ++k) {
      field.states.push_back(file_.read(variable, k));
      field.times.push_back(times[static_cast<std::size_t>(k)]);
    }
    return field;
  }

 private:
  std::string unit_of(const std::string& variable) const { return file_.text(variable, "units").value_or(""); }
  bool is_time(const std::string& dimension) const {
    return dimension.starts_with("time") || file_.text(dimension, "axis") == "T";
  }
  bool has_time(const NetcdfReader::Variable& variable) const { return is_time(variable.dimensions.front()); }
  bool is_field(const NetcdfReader::Variable& variable) const {
    if (variable.dimensions.empty() || file_.find(variable.dimensions.back()) == &variable) return false;
    const std::size_t axes = variable.dimensions.size() - (has_time(variable) ? 1 : 0);
    const bool is_bounds = std::any_of(file_.variables().begin(), file_.variables().end(), [&](const auto& other) {
      return file_.text(other.name, "bounds") == variable.name;
    });
    const auto is_empty = [](std::int64_t length) { return length == 0; };
    return axes >= 1 && axes <= 3 && !is_bounds && std::none_of(variable.shape.begin(), variable.shape.end(), is_empty);
  }

  /// Coordinates of a dimension, or 0, 1, 2, ... if there are none.
  std::vector<double> places(const std::string& dimension, std::int64_t length) const {
    const NetcdfReader::Variable* coordinate = file_.find(dimension);
    if (coordinate != nullptr && coordinate->shape == std::vector<std::int64_t>{length}) return file_.read(*coordinate);
    std::vector<double> numbers;
    for (std::int64_t i = 0; i < length; ++i) numbers.push_back(static_cast<double>(i));
    return numbers;
  }
  /// Name of an axis: the attribute dpde_axis if there is one; x for x_faces whose attribute axis is X; else the
  /// dimension.
  std::string name_of(const std::string& dimension) const {
    if (const std::optional<std::string> called = file_.text(dimension, "dpde_axis")) return *called;
    const std::string letter = file_.text(dimension, "axis").value_or("");
    const bool is_staggered =
        letter.size() == 1 && dimension.starts_with(std::string(1, char(letter[0] - 'X' + 'x')) + "_");
    return is_staggered ? dimension.substr(0, 1) : dimension;
  }
  StoredAxis axis(const std::string& dimension, std::int64_t length) const {
    const std::vector<double> centres = places(dimension, length);
    const double half = length > 1 ? (centres.back() - centres.front()) / static_cast<double>(length - 1) / 2 : 0.5;
    StoredAxis axis{name_of(dimension), centres.front() - half, centres.back() + half, length, {}, unit_of(dimension)};
    axis.grid = grid_of(dimension);
    if (are_uniform(centres)) return axis;
    axis.faces = faces_between(dimension, centres);
    axis.low = axis.faces.front();
    axis.high = axis.faces.back();
    return axis;
  }
  /// For x_faces with the attribute axis X: the ends of x.
  std::optional<std::pair<double, double>> grid_of(const std::string& dimension) const {
    const std::string letter = file_.text(dimension, "axis").value_or("");
    const std::string cells = letter.size() == 1 ? std::string(1, char(letter[0] - 'X' + 'x')) : "";
    const NetcdfReader::Variable* bounds = file_.find(file_.text(cells, "bounds").value_or(""));
    if (cells == dimension || bounds == nullptr) return std::nullopt;
    const auto [low, high] = std::ranges::minmax(file_.read(*bounds));
    return std::pair(low, high);
  }
  static bool are_uniform(const std::vector<double>& centres) {
    const double step =
        centres.size() > 1 ? (centres.back() - centres.front()) / static_cast<double>(centres.size() - 1) : 1;
    for (std::size_t i = 0; i < centres.size(); ++i) {
      if (std::abs(centres[i] - centres[0] - static_cast<double>(i) * step) > 1e-3 * std::abs(step)) return false;
    }
    return true;
  }
  /// Faces from the bounds variable, else midway between centres.
  std::vector<double> faces_between(const std::string& dimension, const std::vector<double>& centres) const {
    const auto count = static_cast<std::int64_t>(centres.size());
    const NetcdfReader::Variable* bounds = file_.find(file_.text(dimension, "bounds").value_or(""));
    const std::vector<double> both = bounds != nullptr && bounds->shape == std::vector<std::int64_t>{count, 2}
                                         ? file_.read(*bounds)
                                         : std::vector<double>{};
    std::vector<double> faces{both.empty() ? centres[0] - (centres[1] - centres[0]) / 2 : both[0]};
    for (std::size_t i = 0; i < centres.size(); ++i) {
      const double midway = i + 1 < centres.size() ? (centres[i] + centres[i + 1]) / 2 : 2 * centres[i] - faces.back();
      faces.push_back(both.empty() ? midway : both[2 * i + 1]);
    }
    return faces;
  }

  const NetcdfReader& file_;
  bool all_states_;
};

std::optional<Fields> from_netcdf(const NetcdfReader& file, const std::string& path, const std::string& field,
                                  bool all_states, DiagnosticSink& sink) {
  const NetcdfFields reader(file, all_states);
  const std::vector<std::string> names = reader.names();
  const bool is_there = std::find(names.begin(), names.end(), field) != names.end();
  if (names.empty() || (!field.empty() && !is_there)) {
    const std::string held =
        names.empty() ? "it holds no field" : fmt::format("it holds the fields {}", fmt::join(names, ", "));
    sink.report("bad-array-file", {},
                {path, field.empty() ? held : fmt::format("it has no field {}; {}", field, held)});
    return std::nullopt;
  }
  Fields fields;
  if (!field.empty()) fields.push_back(reader.field(field));
  for (const std::string& name : names) {
    const NetcdfReader::Variable &variable = *file.find(name), &first = *file.find(names[0]);
    if (field.empty() && variable.shape == first.shape) fields.push_back(reader.field(name));
  }
  return fields;
}

std::optional<Fields> from_npy(const std::string& bytes, const std::string& path, const std::string& name,
                               DiagnosticSink& sink) {
  NpyArray array = parse_npy(bytes, path);
  if (array.shape.empty() || array.shape.size() > 3 || array.values.empty()) {
    sink.report("bad-array-file", {},
                {path, fmt::format("it has {} axes and {} values; 1 to 3 axes can be drawn", array.shape.size(),
                                   array.values.size())});
    return std::nullopt;
  }
  StoredField field{name, {}, {}, {std::move(array.values)}};
  const std::size_t rank = array.shape.size();
  constexpr const char* labels[] = {"cell along x", "cell along y", "cell along z"};
  for (std::size_t a = 0; a < rank; ++a) {
    const std::int64_t cells = array.shape[rank - 1 - a];
    field.axes.push_back({rank == 1 ? "cell" : labels[a], 0, static_cast<double>(cells), cells});
  }
  return Fields{std::move(field)};
}

}  // namespace

std::optional<Fields> load_fields(const std::string& path, const std::string& field, bool all_states,
                                  DiagnosticSink& sink) {
  std::optional<std::string> bytes = files::read_file(path, {}, sink);
  if (!bytes) return std::nullopt;
  try {
    if (!path.ends_with(".nc")) return from_npy(*bytes, path, std::filesystem::path(path).stem().string(), sink);
    const NetcdfReader file(std::move(*bytes), path);
    return from_netcdf(file, path, field, all_states, sink);
  } catch (const Error& error) {
    sink.report("bad-array-file", {}, {path, error.what()});
    return std::nullopt;
  }
}

}  // namespace dpde::plot
