// SPDX-License-Identifier: Apache-2.0
#include "files/array_file.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <iterator>

#include "dpde/runtime/error.h"
#include "dpde/runtime/netcdf.h"
#include "dpde/runtime/npy.h"
#include "files/files.h"
#include "support/maths/evaluate.h"
#include "support/names/units.h"

namespace dpde::files {

namespace {

using Shape = std::vector<std::int64_t>;
using Values = std::optional<std::vector<double>>;

std::string shape_text(const Shape& shape) {
  return shape.size() == 1 ? fmt::format("({},)", shape[0]) : fmt::format("({})", fmt::join(shape, ", "));
}

Shape shape_of(const std::vector<model::Axis>& axes) {
  Shape shape;
  for (const model::Axis& axis : axes) shape.insert(shape.begin(), axis.cells);
  return shape;
}

bool all_fit(const std::string& file, const std::vector<double>& values, Precision real, SourceRange where,
             DiagnosticSink& sink) {
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (std::isfinite(rounded(values[i], real))) continue;
    const std::string value = fmt::format("{}", shown(values[i])), index = fmt::format("{}", i);
    if (std::isfinite(values[i])) {
      sink.report("not-in-precision", where, {file, value, index, std::string(name_of(real))}, "real = f64 can");
    } else {
      sink.report("data-not-finite", where, {file, value, index});
    }
    return false;
  }
  return true;
}

/// Reads a unit in dpde's syntax, or that of CF and UDUNITS: "kg m-2 s-1".
std::optional<Unit> read_unit_of_file(const std::string& told) {
  const auto ours = read_unit(told);
  if (told.empty() || std::holds_alternative<Unit>(ours))
    return told.empty() ? std::nullopt : std::optional(std::get<Unit>(ours));
  std::string text;
  for (std::size_t i = 0; i < told.size(); ++i) {
    const char c = told[i];
    const bool is_power = (std::isdigit(static_cast<unsigned char>(c)) != 0 || c == '-') && i > 0 &&
                          std::isalpha(static_cast<unsigned char>(told[i - 1])) != 0;
    if (is_power) text += '^';
    text += c == ' ' || c == '.' ? '*' : c;
  }
  const auto theirs = read_unit(text);
  return std::holds_alternative<Unit>(theirs) ? std::optional(std::get<Unit>(theirs)) : std::nullopt;
}

bool is_celsius(const std::string& told) {
  return told == "degC" || told == "celsius" || told == "Celsius" || told == "degree_Celsius" ||
         told == "degrees_Celsius" || told == "deg_C";
}

/// The states of one variable of a NetCDF file.
class NetcdfField {
 public:
  NetcdfField(const NetcdfReader& file, const std::string& path, const ArrayFile& from,
              const std::vector<model::Axis>& axes, SourceRange where, DiagnosticSink& sink)
      : file_(file), path_(path), from_(from), axes_(axes), where_(where), sink_(sink) {}

  Values read() {
    const NetcdfReader::Variable* variable = find();
    if (variable == nullptr || !fits(*variable) || !has_unit(*variable)) return std::nullopt;
    if (variable->shape.size() == axes_.size()) {
      if (!from_.times.empty()) return no_time(from_.times[0], "it holds no times");
      return file_.read(*variable);
    }
    return read_times(*variable);
  }

 private:
  Values fail(const std::string& reason, const std::string& hint = "") {
    sink_.report("bad-array-file", where_, {path_, reason}, hint);
    return std::nullopt;
  }
  Values no_time(double t, const std::string& hint) {
    sink_.report("data-without-time", where_, {path_, fmt::format("{}", t)}, hint);
    return std::nullopt;
  }

  /// Whether the variable is a coordinate, or the bounds of one.
  bool describes_axes(const NetcdfReader::Variable& variable) const {
    if (variable.dimensions.size() == 1 && variable.dimensions[0] == variable.name) return true;
    return std::any_of(file_.variables().begin(), file_.variables().end(),
                       [&](const auto& other) { return file_.text(other.name, "bounds") == variable.name; });
  }
  bool is_time(const std::string& dimension) const {
    return dimension.starts_with("time") || file_.text(dimension, "axis") == "T";
  }
  bool is_field(const NetcdfReader::Variable& variable) const {
    const std::size_t rank = variable.shape.size();
    if (rank != axes_.size() && rank != axes_.size() + 1) return false;
    return !describes_axes(variable) && !is_time(variable.dimensions.back());
  }

  /// Returns nullptr after a diagnostic.
  const NetcdfReader::Variable* find() {
    std::vector<std::string> fields;
    for (const NetcdfReader::Variable& variable : file_.variables()) {
      if (is_field(variable)) fields.push_back(variable.name);
    }
    if (from_.variable.empty() && fields.size() == 1) return file_.find(fields[0]);
    const NetcdfReader::Variable* named = from_.variable.empty() ? nullptr : file_.find(from_.variable);
    if (named != nullptr) return named;
    const std::string held = fields.empty() ? "it holds no field on " + std::to_string(axes_.size()) + " axes"
                                            : fmt::format("it holds the fields {}", fmt::join(fields, ", "));
    if (from_.variable.empty()) {
      fail(held, fields.empty() ? "" : fmt::format("write load(\"{}\", {})", from_.file, fields[0]));
    } else {
      const std::string near = nearest_name(from_.variable, fields);
      fail(fmt::format("it has no variable {}; {}", from_.variable, held),
           near.empty() ? "" : "did you mean " + near + "?");
    }
    return nullptr;
  }

  /// Checks the shape, and the coordinates if the file has them.
  bool fits(const NetcdfReader::Variable& variable) {
    const Shape wanted = shape_of(axes_);
    const std::size_t rank = variable.shape.size();
    const Shape own(variable.shape.end() - static_cast<std::ptrdiff_t>(std::min(rank, wanted.size())),
                    variable.shape.end());
    if (own != wanted || rank > wanted.size() + 1) {
      sink_.report("wrong-shape", where_, {path_, shape_text(variable.shape), "the grid", shape_text(wanted)});
      return false;
    }
    for (std::size_t a = 0; a < axes_.size(); ++a) {
      if (!axis_fits(axes_[a], variable.dimensions[rank - 1 - a])) return false;
    }
    return true;
  }
  bool axis_fits(const model::Axis& axis, const std::string& dimension) {
    const std::string why = axis_mismatch(file_, axis, dimension);
    if (!why.empty()) fail(why);
    return why.empty();
  }

  /// Units that are missing or not understood are accepted.
  bool has_unit(const NetcdfReader::Variable& variable) {
    const std::string told = file_.text(variable.name, "units").value_or("");
    const auto own = read_unit_of_file(told);
    const auto wanted = read_unit(from_.unit);
    const std::string what = fmt::format("{} in {}", variable.name, path_);
    if (is_celsius(told) && from_.unit == "K") {
      sink_.report("units-differ", where_, {"K", what, told}, "add 273.15 to what the file holds");
      return false;
    }
    if (from_.unit.empty() || !own || !std::holds_alternative<Unit>(wanted)) return true;
    const Unit& unit = std::get<Unit>(wanted);
    if (own->is_same_as(unit)) return true;
    if (own->has_dimension_of(unit))
      sink_.report("units-of-other-scale", where_, {from_.unit, what, told},
                   fmt::format("1 {} is {:.6g} {}: convert the file", told, own->scale() / unit.scale(), from_.unit));
    else
      sink_.report("units-differ", where_, {from_.unit, what, told}, "load another variable");
    return false;
  }

  void tell_time(const std::vector<double>& times) {
    const double own = times.back();
    for (const double t : from_.compared_at) {
      if (!(std::abs(t - own) > 1e-6 * std::max(std::abs(t), std::abs(own - times.front())))) continue;
      sink_.report("data-of-other-time", where_, {from_.name, fmt::format("{:.10g}", own), fmt::format("{:.10g}", t)},
                   fmt::format("write at t = {:.10g} after the data, if the file holds that state", t));
      return;
    }
  }

  Values read_times(const NetcdfReader::Variable& variable) {
    const std::int64_t count = variable.shape[0];
    if (count == 0) return fail(fmt::format("{} holds no state", variable.name));
    const NetcdfReader::Variable* coordinate = file_.find(variable.dimensions[0]);
    if (from_.times.empty()) {
      if (coordinate != nullptr && coordinate->shape == Shape{count}) tell_time(file_.read(*coordinate));
      return file_.read(variable, count - 1);
    }
    if (coordinate == nullptr || coordinate->shape != Shape{count})
      return no_time(from_.times[0], "it does not say at which times");
    const std::vector<double> times = file_.read(*coordinate);
    std::vector<double> all;
    for (const double t : from_.times) {
      const auto closer = [&](double a, double b) { return std::abs(a - t) < std::abs(b - t); };
      const auto nearest = std::min_element(times.begin(), times.end(), closer);
      const double scale = std::max(std::abs(t), std::abs(times.back() - times.front()));
      if (!(std::abs(*nearest - t) <= 1e-6 * scale)) return no_time(t, fmt::format("the nearest is t = {}", *nearest));
      const std::vector<double> state = file_.read(variable, nearest - times.begin());
      all.insert(all.end(), state.begin(), state.end());
    }
    return all;
  }

  const NetcdfReader& file_;
  const std::string& path_;
  const ArrayFile& from_;
  const std::vector<model::Axis>& axes_;
  SourceRange where_;
  DiagnosticSink& sink_;
};

/// Removes axes of length one: NumPy and users write a number as a field of one cell or as a scalar.
Shape without_ones(const Shape& shape) {
  Shape result;
  std::ranges::copy_if(shape, std::back_inserter(result), [](std::int64_t size) { return size != 1; });
  return result;
}

Values from_npy(const std::string& bytes, const std::string& path, const ArrayFile& from,
                const std::vector<model::Axis>& axes, SourceRange where, DiagnosticSink& sink) {
  Shape wanted = shape_of(axes);
  const bool has_times = from.times.size() > 1;
  if (has_times) wanted.insert(wanted.begin(), static_cast<std::int64_t>(from.times.size()));
  NpyArray array = parse_npy(bytes, path);
  const bool is_of_numbers = without_ones(shape_of(axes)).empty();
  if (array.shape == wanted || (is_of_numbers && without_ones(array.shape) == without_ones(wanted)))
    return std::move(array.values);
  sink.report("wrong-shape", where,
              {path, shape_text(array.shape),
               !has_times      ? "the grid"
               : is_of_numbers ? "one number a state"
                               : "the grid with its steps",
               shape_text(wanted)});
  return std::nullopt;
}

}  // namespace

std::string axis_mismatch(const NetcdfReader& file, const model::Axis& axis, const std::string& dimension) {
  const NetcdfReader::Variable* coordinate = file.find(dimension);
  if (coordinate == nullptr || coordinate->shape != Shape{axis.cells}) return "";
  const std::vector<double> places = file.read(*coordinate);
  constexpr double tolerance = 1e-3;  // in cells: single precision passes, another grid does not
  for (int i = 0; i < axis.cells; ++i) {
    const double centre = axis.centre(i);
    if (std::abs(places[static_cast<std::size_t>(i)] - centre) <= tolerance * axis.width(i)) continue;
    return fmt::format("it is of another grid: cell {} lies at {} = {:.6g}, here at {} = {:.6g}", i, dimension,
                       places[static_cast<std::size_t>(i)], axis.name, centre);
  }
  return "";
}

Values load_array(const ArrayFile& from, const SourceFile& source, const std::vector<model::Axis>& axes, Precision real,
                  SourceRange where, DiagnosticSink& sink) {
  const std::string path = find_data_file(from.file, source.path()).string();
  std::optional<std::string> bytes = read_file(path, where, sink);
  if (!bytes) return std::nullopt;
  try {
    Values values;
    if (from.file.ends_with(".nc")) {
      const NetcdfReader reader(std::move(*bytes), path);
      values = NetcdfField(reader, path, from, axes, where, sink).read();
    } else {
      values = from_npy(*bytes, path, from, axes, where, sink);
    }
    if (!values || !all_fit(path, *values, real, where, sink)) return std::nullopt;
    return values;
  } catch (const Error& error) {
    sink.report("bad-array-file", where, {path, error.what()});
    return std::nullopt;
  }
}

Values load_array(const model::Source& from, const std::string& unit, const SourceFile& source,
                  const std::vector<model::Axis>& axes, Precision real, DiagnosticSink& sink) {
  const std::vector<double> times = from.time ? std::vector<double>{*from.time} : std::vector<double>{};
  return load_array({from.file, from.variable, times, "", {}, unit}, source, axes, real, from.origin.range, sink);
}

}  // namespace dpde::files
