// SPDX-License-Identifier: Apache-2.0
#include "dpde/runtime/run_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "dpde/runtime/npy.h"
#include "xdmf.h"

namespace dpde {

namespace {

void add_points(NetcdfContent& content, const RunAxis& axis, const RunPoints& points, const std::string& name,
                const std::string& what, const std::string& corner, NetcdfNames& names) {
  content.dimensions.push_back({name, static_cast<std::int64_t>(points.places.size())});
  NetcdfVariable places{name, {name}, described(axis.in_words + what, axis.unit), points.places};
  NetcdfVariable bounds{names.free(name + "_bounds"), {name, corner}, {}, points.bounds};
  const std::string letter(1, static_cast<char>(axis.name[0] - 'x' + 'X'));
  places.attributes.insert(places.attributes.end(),
                           {{"axis", letter}, {"bounds", bounds.name}, {"dpde_axis", axis.in_words}});
  places.attributes.push_back({"boundary", axis.is_periodic ? "periodic" : "bounded"});
  content.variables.push_back(std::move(places));
  content.variables.push_back(std::move(bounds));
}

const RunField& field_named(const RunDescription& run, const std::string& name) {
  return *std::ranges::find(run.fields, name, &RunField::name);
}

std::string name_at_centres(std::string field) {
  std::ranges::replace(field, '.', '_');
  return field + "_centre";
}

/// Dimensions of values at centres, or on faces along some axes.
std::vector<std::string> dimensions_of(const AxisNames& axes, const std::string& time,
                                       const std::array<bool, 3>& on_faces) {
  std::vector<std::string> dimensions{time};
  for (std::size_t a = axes.size(); a-- > 0;) dimensions.push_back(axes[a][on_faces[a] ? 1 : 0]);
  return dimensions;
}

/// Adds copies, interpolated to centres, of the series' fields on faces.
void add_centres(NetcdfContent& content, const RunDescription& run, const AxisNames& axes, const RunRecord& record,
                 const Series& series, const std::string& time, NetcdfNames& names) {
  for (const std::string& name : series.fields) {
    const RunField& field = field_named(run, name);
    if (!field.at_centres) continue;
    NetcdfVariable variable{names.free(name_at_centres(name)),
                            dimensions_of(axes, time, {}),
                            described("field " + name + " at the cell centres", field.unit),
                            {},
                            run.is_single};
    variable.part = [&field, &record, &series](std::int64_t first, std::int64_t count) {
      return field.at_centres(record.states(series, field.name, first, count));
    };
    content.variables.push_back(std::move(variable));
  }
}

void add_series(NetcdfContent& content, const RunDescription& run, const AxisNames& axes, const RunRecord& record,
                const Series& series, const std::string& time) {
  content.dimensions.push_back({time, static_cast<std::int64_t>(series.times.size())});
  content.variables.push_back(time_variable(time, run.time_unit, series.times));
  for (const std::string& name : series.fields) {
    const RunField& field = field_named(run, name);
    NetcdfVariable variable{
        name, dimensions_of(axes, time, field.on_faces), described("field " + name, field.unit), {}, run.is_single};
    variable.part = [&record, &series, name](std::int64_t first, std::int64_t count) {
      return record.states(series, name, first, count);
    };
    content.variables.push_back(std::move(variable));
  }
}

/// With a separate copy of the times, since programs that read the group see nothing else.
void add_observables(NetcdfContent& content, const RunDescription& run, const Series& series, const std::string& time) {
  if (run.observables.empty()) return;
  content.variables.push_back(time_variable(time, run.time_unit, series.times));
  content.variables.back().group = group_of_numbers;
  for (std::size_t q = 0; q < run.observables.size(); ++q) {
    const RunNumber& observable = run.observables[q];
    NetcdfVariable variable{observable.name, {time}, described("observable " + observable.name, observable.unit), {}};
    variable.group = group_of_numbers;
    for (const Observed& row : series.observables) variable.values.push_back(row[q].second);
    content.variables.push_back(std::move(variable));
  }
}

/// Names of the time variables of the series.
using TimeNames = std::vector<std::string>;

NetcdfContent content_of(const RunDescription& run, const RunRecord& record, AxisNames& axes, TimeNames& times) {
  NetcdfContent content;
  content.attributes = run.attributes;
  NetcdfNames names(run.names);
  axes = add_axes(content, run.axes, names);
  for (const Series& series : record.series()) {
    const std::string time = times.emplace_back(names.free("time"));
    add_centres(content, run, axes, record, series, time, names);
    add_series(content, run, axes, record, series, time);
    if (times.size() == 1) add_observables(content, run, series, time);
  }
  for (const RunNumber& param : run.params) content.variables.push_back(parameter_variable(param));
  return content;
}

/// The fields at cell centres.
XdmfSeries xdmf_series(const NetcdfContent& content, const AxisNames& axes, const std::string& time) {
  XdmfSeries series;
  const std::vector<std::string> dimensions = dimensions_of(axes, time, {});
  for (const NetcdfVariable& variable : content.variables) {
    if (variable.name == time) series.times = variable.values;
    if (variable.dimensions == dimensions) series.fields.push_back(stored_name(content, variable.name));
  }
  return series;
}

/// z, y, x, without absent axes.
std::vector<std::int64_t> shape_of_states(const RunDescription& run) {
  std::vector<std::int64_t> shape;
  for (const RunAxis& axis : run.axes)
    shape.insert(shape.begin(), static_cast<std::int64_t>(axis.centres.places.size()));
  return shape;
}

/// The sign of a NaN is meaningless.
double as_told(double value) { return std::isnan(value) ? std::numeric_limits<double>::quiet_NaN() : value; }

}  // namespace

std::string NetcdfNames::free(std::string name) {
  while (!taken_.insert(name).second) name += "_";
  return name;
}

NetcdfAttributes described(const std::string& what, const std::string& unit) {
  NetcdfAttributes attributes{{"long_name", what}};
  if (!unit.empty()) attributes.emplace_back("units", unit);  // "1" would mean a pure number
  return attributes;
}

NetcdfVariable time_variable(const std::string& name, const std::string& unit, std::vector<double> times) {
  NetcdfAttributes attributes = described("time", unit);
  attributes.insert(attributes.end(), {{"standard_name", "time"}, {"axis", "T"}});
  return {name, {name}, std::move(attributes), std::move(times)};
}

NetcdfVariable parameter_variable(const RunNumber& parameter) {
  return {parameter.name,    {},    described("parameter " + parameter.name, parameter.unit),
          {parameter.value}, false, group_of_numbers};
}

AxisNames add_axes(NetcdfContent& content, const std::vector<RunAxis>& axes, NetcdfNames& names) {
  const std::string corner = names.free("bounds");
  content.dimensions.push_back({corner, 2});
  AxisNames result;
  for (const RunAxis& axis : axes) {
    result.push_back({axis.name, ""});
    add_points(content, axis, axis.centres, axis.name, " of the cell centres", corner, names);
    if (!axis.faces) continue;
    result.back()[1] = names.free(axis.name + "_faces");
    add_points(content, axis, *axis.faces, result.back()[1], " of the upper faces of the cells", corner, names);
  }
  return result;
}

void write_run(const std::filesystem::path& path, const RunDescription& run, const RunRecord& record) {
  AxisNames axes;
  TimeNames times;
  write_netcdf(path, content_of(run, record, axes, times));
}

std::string xdmf_of(const std::string& file, const RunDescription& run, const RunRecord& record) {
  AxisNames axes;
  TimeNames times;
  const NetcdfContent content = content_of(run, record, axes, times);
  std::array<std::vector<double>, 3> faces;
  for (std::size_t a = 0; a < faces.size(); ++a) {
    const std::vector<double>& bounds = run.axes[a].centres.bounds;
    for (std::size_t i = 0; i < bounds.size(); i += 2) faces[a].push_back(bounds[i]);
    faces[a].push_back(bounds.back());
  }
  std::vector<XdmfSeries> all;
  for (const std::string& time : times) all.push_back(xdmf_series(content, axes, time));
  return xdmf_text(file, faces, run.is_single, all);
}

void write_states(const std::filesystem::path& path, const RunDescription& run, const RunRecord& record,
                  const Series& series, const std::string& field) {
  const auto count = static_cast<std::int64_t>(series.places.size());
  std::vector<std::int64_t> shape = shape_of_states(run);
  if (count != 1) shape.insert(shape.begin(), count);
  write_npy(path, shape, count, [&](std::int64_t instant) { return record.states(series, field, instant, 1); });
}

void write_state(const std::filesystem::path& path, const RunDescription& run, const std::vector<double>& values) {
  write_npy(path, shape_of_states(run), values);
}

std::string table_of(const Series& series) {
  std::string table = "step,t";
  for (const auto& [name, value] : series.observables.front()) table += "," + name;
  for (std::size_t k = 0; k < series.steps.size(); ++k) {
    table += fmt::format("\n{},{}", series.steps[k], series.times[k]);
    for (const auto& [name, value] : series.observables[k]) table += fmt::format(",{}", as_told(value));
  }
  return table + "\n";
}

}  // namespace dpde
