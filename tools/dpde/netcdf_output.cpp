// SPDX-License-Identifier: Apache-2.0
#include "netcdf_output.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "at_centres.h"
#include "dpde/runtime/error.h"
#include "dpde/runtime/netcdf.h"
#include "files/files.h"
#include "files/imports.h"
#include "model/placement.h"
#include "model/print_model.h"
#include "scene_output.h"
#include "xdmf.h"

namespace dpde::tools {

namespace {

/// `in_words`: what readers call the axis.
void add_axis(NetcdfContent& content, const model::Axis& axis, const std::string& name, const std::string& in_words,
              const NetcdfAttributes& attributes, const std::string& corner, NetcdfNames& names) {
  content.dimensions.push_back({name, axis.cells});
  NetcdfVariable places{name, {name}, attributes, {}};
  NetcdfVariable bounds{names.free(name + "_bounds"), {name, corner}, {}, {}};
  const std::string letter(1, static_cast<char>(axis.name[0] - 'x' + 'X'));
  places.attributes.insert(places.attributes.end(),
                           {{"axis", letter}, {"bounds", bounds.name}, {"dpde_axis", in_words}});
  places.attributes.push_back({"boundary", axis.topology == Topology::periodic ? "periodic" : "bounded"});
  for (int i = 0; i < axis.cells; ++i) {
    places.values.push_back(axis.centre(i));
    bounds.values.insert(bounds.values.end(), {axis.face(i), axis.face(i + 1)});
  }
  content.variables.push_back(std::move(places));
  content.variables.push_back(std::move(bounds));
}

/// What lies on faces along any axis.
bool is_on_faces(const driver::Session& session, const std::string& field) {
  const model::Placement placement = placement_of(session, field);
  return std::ranges::find(placement, true) != placement.end();
}

std::string name_at_centres(std::string field) {
  std::ranges::replace(field, '.', '_');
  return field + "_centre";
}

/// Copies at the centres of the series' fields on faces.
void add_centres(NetcdfContent& content, const driver::Session& session, const AxisNames& axes, const Record& record,
                 const Series& series, const std::string& time, NetcdfNames& names) {
  for (const std::string& field : series.fields) {
    if (!is_on_faces(session, field)) continue;
    std::vector<std::string> dimensions{time};
    for (std::size_t a = axes.size(); a-- > 0;) dimensions.push_back(axes[a][0]);
    NetcdfVariable variable{names.free(name_at_centres(field)),
                            dimensions,
                            described("field " + field + " at the cell centres", session.problem().unit_of(field)),
                            {},
                            session.problem().scheme.real == Precision::f32};
    variable.part = [&session, &record, &series, field](std::int64_t first, std::int64_t count) {
      return at_centres(session, field, record.states(series, field, first, count));
    };
    content.variables.push_back(std::move(variable));
  }
}

/// What lies at centres of a content.
XdmfSeries xdmf_series(const NetcdfContent& content, const AxisNames& axes, const std::string& time) {
  XdmfSeries series;
  std::vector<std::string> dimensions{time};
  for (std::size_t a = axes.size(); a-- > 0;) dimensions.push_back(axes[a][0]);
  for (const NetcdfVariable& variable : content.variables) {
    if (variable.name == time) series.times = variable.values;
    if (variable.dimensions == dimensions) series.fields.push_back(stored_name(content, variable.name));
  }
  return series;
}

void add_series(NetcdfContent& content, const driver::Session& session, const AxisNames& axes, const Record& record,
                const Series& series, const std::string& time) {
  content.dimensions.push_back({time, static_cast<std::int64_t>(series.times.size())});
  content.variables.push_back(time_variable(session.problem(), time, series.times));
  for (const std::string& field : series.fields) {
    const model::Placement placement = placement_of(session, field);
    const bool is_single = session.problem().scheme.real == Precision::f32;
    std::vector<std::string> dimensions{time};
    for (std::size_t a = axes.size(); a-- > 0;) dimensions.push_back(axes[a][placement[a] ? 1 : 0]);
    const std::string unit = session.problem().unit_of(field);
    content.variables.push_back({field, dimensions, described("field " + field, unit), {}, is_single});
    content.variables.back().part = [&record, &series, field](std::int64_t first, std::int64_t count) {
      return record.states(series, field, first, count);
    };
  }
}

/// With times of their own, as programs see of a group nothing else.
void add_observables(NetcdfContent& content, const model::Problem& problem, const Series& series,
                     const std::string& time) {
  if (series.observables.front().empty()) return;
  content.variables.push_back(time_variable(problem, time, series.times));
  content.variables.back().group = group_of_numbers;
  for (std::size_t q = 0; q < series.observables.front().size(); ++q) {
    NetcdfVariable variable{series.observables.front()[q].first, {time}, {}, {}};
    variable.group = group_of_numbers;
    variable.attributes = described("observable " + variable.name, problem.unit_of(variable.name));
    for (const auto& row : series.observables) variable.values.push_back(row[q].second);
    content.variables.push_back(std::move(variable));
  }
}

}  // namespace

NetcdfNames::NetcdfNames(const driver::Session& session) {
  const model::Problem& problem = session.problem();
  for (const model::State& state : problem.states) taken_.insert(state.name);
  for (const model::Parameter& param : problem.params) taken_.insert(param.name);
  for (const model::Quantity& quantity : problem.observables) taken_.insert(quantity.name);
  for (const model::Shown& shown : problem.shown) taken_.insert(shown.name);
}

std::string NetcdfNames::free(std::string name) {
  while (!taken_.insert(name).second) name += "_";
  return name;
}

NetcdfAttributes described(const std::string& what, const std::string& unit) {
  NetcdfAttributes attributes{{"long_name", what}};
  if (!unit.empty()) attributes.emplace_back("units", unit);  // "1" would be a pure number
  return attributes;
}

NetcdfVariable time_variable(const model::Problem& problem, const std::string& name, std::vector<double> times) {
  NetcdfAttributes attributes = described("time", problem.unit_of("t"));
  attributes.insert(attributes.end(), {{"standard_name", "time"}, {"axis", "T"}});
  return {name, {name}, std::move(attributes), std::move(times)};
}

NetcdfVariable parameter_variable(const model::Problem& problem, const model::Parameter& parameter) {
  return {parameter.name,    {},    described("parameter " + parameter.name, problem.unit_of(parameter.name)),
          {parameter.value}, false, group_of_numbers};
}

AxisNames add_axes(NetcdfContent& content, const driver::Session& session, const std::vector<model::Axis>& axes,
                   NetcdfNames& names) {
  const std::string corner = names.free("bounds");
  content.dimensions.push_back({corner, 2});
  AxisNames result;
  for (std::size_t a = 0; a < axes.size(); ++a) {
    const model::Axis& axis = axes[a];
    result.push_back({axis.name, ""});
    const std::string unit = session.problem().unit_of(axis.name);
    const std::string in_words = called(session.problem(), axis.name);
    add_axis(content, axis, axis.name, in_words, described(in_words + " of the cell centres", unit), corner, names);
    if (!session.problem().has_faces(a)) continue;
    result.back()[1] = names.free(axis.name + "_faces");
    model::Placement faces{};
    faces[a] = true;
    add_axis(content, model::axes_at(axes, faces)[a], result.back()[1], in_words,
             described(in_words + " of the upper faces of the cells", unit), corner, names);
  }
  return result;
}

void add_origin(NetcdfContent& content, const Job& job, const driver::Session& session, const std::string& verb,
                const std::string& name) {
  const CommonOptions& options = job.options();
  const model::Problem& problem = session.problem();
  const std::string& what = name.empty() ? problem.scene : name;
  std::string settings, command = fmt::format("dpde {} {} {}", verb, options.file, what);
  for (const std::string& setting : options.set) settings += (settings.empty() ? "" : "\n") + setting;
  for (const std::string& setting : options.set) command += " --set " + setting;
  if (!options.scheme.empty()) command += " --scheme " + options.scheme;
  command += fmt::format(" --backend {} --seed {}", options.backend, options.seed);
  content.attributes = {{"Conventions", "CF-1.8"},
                        {"title", fmt::format("scene {} of {}", problem.scene, options.file)},
                        {"source", version},
                        {"history", command},
                        {"dpde_scene", problem.scene},
                        {"dpde_settings", settings},
                        {"dpde_scheme", model::print(problem.scheme)},
                        {"dpde_problem", model::print(problem)},
                        {"dpde_text", files::text_without_imports(job.source())},
                        {"dpde_step", problem.step},
                        {"dpde_seed", static_cast<double>(options.seed)}};
}

void add_told(NetcdfContent& content, std::uint64_t key, const Told& told) {
  content.attributes.insert(
      content.attributes.end(),
      {{"dpde_key", fmt::format("{:016x}", key)}, {"dpde_told", told.text}, {"dpde_result", told.json.dump()}});
}

std::optional<Told> told_of_finished(const Job& job, const std::string& file, std::uint64_t key) {
  const std::filesystem::path path = std::filesystem::path(job.options().out) / file;
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) return std::nullopt;
  DiagnosticSink silent;
  std::optional<std::string> bytes = files::read_file(path, {}, silent);
  if (!bytes) return std::nullopt;
  try {
    const NetcdfReader reader(std::move(*bytes), path.string());
    if (reader.text("", "dpde_key") != fmt::format("{:016x}", key)) return std::nullopt;
    const std::optional<Json> json = parse_json(reader.text("", "dpde_result").value_or(""));
    if (!json || !json->is_object()) return std::nullopt;
    return Told{reader.text("", "dpde_told").value_or(""), *json};
  } catch (const Error&) {
    return std::nullopt;  // damaged, or no such file: it is made again
  }
}

void save_netcdf(Job& job, const driver::Session& session, const Record& record, bool with_centres) {
  if (job.options().out.empty()) return;
  NetcdfContent content;
  NetcdfNames names(session);
  add_origin(content, job, session);
  const AxisNames axes = add_axes(content, session, session.axes(), names);
  bool is_first = true;
  std::vector<std::string> times;
  for (const Series& series : record.series()) {
    const std::string time = names.free("time");
    times.push_back(time);
    if (with_centres) add_centres(content, session, axes, record, series, time, names);
    add_series(content, session, axes, record, series, time);
    if (is_first) add_observables(content, session.problem(), series, time);
    is_first = false;
  }
  for (const model::Parameter& param : session.problem().params) {
    if (session.problem().find_control(param.name) != nullptr)
      continue;  // no number of the whole run: dpde_problem has its formula
    content.variables.push_back(parameter_variable(session.problem(), param));
  }
  const std::string& scene = session.problem().scene;
  std::vector<XdmfSeries> described_series;
  for (const std::string& time : times) described_series.push_back(xdmf_series(content, axes, time));
  save_file(job, scene + ".nc", [&](const std::filesystem::path& path) { write_netcdf(path, std::move(content)); });
  const bool is_single = session.problem().scheme.real == Precision::f32;
  if (axes.size() == 3)
    save_text(job, scene + ".xdmf", xdmf_text(scene + ".nc", session.axes(), is_single, described_series));
}

}  // namespace dpde::tools
