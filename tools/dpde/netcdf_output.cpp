// SPDX-License-Identifier: Apache-2.0
#include "netcdf_output.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "dpde/runtime/netcdf.h"
#include "model/print_model.h"
#include "scene_output.h"

namespace dpde::tools {

namespace {

/// Names no variable of the user has.
class Names {
 public:
  explicit Names(const driver::Session& session) {
    const model::Problem& problem = session.problem();
    for (const model::State& state : problem.states) taken_.insert(state.name);
    for (const model::Parameter& param : problem.params) taken_.insert(param.name);
    for (const model::Quantity& quantity : problem.observables) taken_.insert(quantity.name);
  }
  std::string free(std::string name) {
    while (!taken_.insert(name).second) name += "_";
    return name;
  }

 private:
  std::set<std::string> taken_;
};

/// The language has no units: every number is a ratio.
NetcdfAttributes described(const std::string& what) { return {{"long_name", what}, {"units", "1"}}; }

void add_axes(NetcdfContent& content, const driver::Workspace& workspace, Names& names) {
  const std::string corner = names.free("bounds");
  content.dimensions.push_back({corner, 2});
  for (const model::Axis& axis : workspace.axes()) {
    content.dimensions.push_back({axis.name, axis.cells});
    NetcdfVariable centres{axis.name, {axis.name}, described(axis.name + " of the cell centres"), {}};
    NetcdfVariable bounds{names.free(axis.name + "_bounds"), {axis.name, corner}, {}, {}};
    const std::string letter(1, static_cast<char>(axis.name[0] - 'x' + 'X'));
    centres.attributes.insert(centres.attributes.end(), {{"axis", letter}, {"bounds", bounds.name}});
    centres.attributes.push_back({"boundary", axis.topology == Topology::periodic ? "periodic" : "bounded"});
    for (int i = 0; i < axis.cells; ++i) {
      centres.values.push_back(axis.low + (i + 0.5) * axis.spacing());
      bounds.values.insert(bounds.values.end(), {axis.low + i * axis.spacing(), axis.low + (i + 1) * axis.spacing()});
    }
    content.variables.push_back(std::move(centres));
    content.variables.push_back(std::move(bounds));
  }
}

void add_series(NetcdfContent& content, const driver::Workspace& workspace, const Series& series, const std::string& time) {
  content.dimensions.push_back({time, static_cast<std::int64_t>(series.times.size())});
  NetcdfVariable times{time, {time}, described("time"), series.times};
  times.attributes.push_back({"axis", "T"});
  content.variables.push_back(std::move(times));
  std::vector<std::string> dimensions{time};
  for (std::size_t a = workspace.axes().size(); a-- > 0;) dimensions.push_back(workspace.axes()[a].name);
  for (const std::string& field : series.fields) {
    content.variables.push_back({field, dimensions, described("field " + field), series.values.at(field)});
  }
}

void add_observables(NetcdfContent& content, const Series& series, const std::string& time) {
  for (std::size_t q = 0; q < series.observables.front().size(); ++q) {
    NetcdfVariable variable{series.observables.front()[q].first, {time}, {}, {}};
    variable.attributes = described("observable " + variable.name);
    for (const auto& row : series.observables) variable.values.push_back(row[q].second);
    content.variables.push_back(std::move(variable));
  }
}

/// What it takes to make the file again.
void add_origin(NetcdfContent& content, const Job& job, const driver::Session& session) {
  const CommonOptions& options = job.options();
  const model::Problem& problem = session.problem();
  std::string settings, command = fmt::format("dpde run {} {}", options.file, problem.scene);
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
                        {"dpde_text", std::string(job.source().text())},
                        {"dpde_step", problem.step},
                        {"dpde_seed", static_cast<double>(options.seed)}};
}

}  // namespace

void save_netcdf(Job& job, driver::Session& session, const Record& record) {
  if (job.options().out.empty()) return;
  NetcdfContent content;
  Names names(session);
  add_origin(content, job, session);
  add_axes(content, session.workspace(), names);
  bool is_first = true;
  for (const Series& series : record.series()) {
    const std::string time = names.free("time");
    add_series(content, session.workspace(), series, time);
    if (is_first) add_observables(content, series, time);
    is_first = false;
  }
  for (const model::Parameter& param : session.problem().params) {
    content.variables.push_back({param.name, {}, described("parameter " + param.name), {param.value}});
  }
  guarded(job, [&] { save_text(job, session.problem().scene + ".nc", compose_netcdf(content)); });
}

}  // namespace dpde::tools
