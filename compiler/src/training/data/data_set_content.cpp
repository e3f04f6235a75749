// SPDX-License-Identifier: Apache-2.0
#include "training/data/data_set_content.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <variant>

#include "files/data_set_cost.h"
#include "files/trajectories.h"
#include "syntax/parser.h"
#include "syntax/print/print_ast.h"

namespace dpde::training {

namespace {

std::vector<model::Axis> axes_of(const DataFile& file) {
  std::vector<model::Axis> axes = file.maker.session().axes();
  const std::vector<int> cells = file.maker.cells(file.grid());
  for (std::size_t a = 0; a < axes.size(); ++a) axes[a].cells = cells[a];
  return axes;
}

/// Source text of the block.
std::string block_text(const SourceFile& source, const std::string& name) {
  DiagnosticSink silent;
  ast::File file = ast::parse(source, silent);
  std::erase_if(file.declarations, [&](const ast::Declaration& declaration) {
    const auto* set = std::get_if<ast::DataSet>(&declaration.kind);
    return set == nullptr || set->name.name != name;
  });
  return print(file);
}

/// Adds a variable's integral at each frame, and its drift in each run.
void add_integrals(NetcdfContent& content, const std::string& name, std::size_t v, const std::string& time,
                   const std::vector<DataRun>& runs, NetcdfNames& names) {
  NetcdfVariable integral{
      names.free(name + "_integral"), {"run", time}, described("integral of " + name + " over the domain"), {}};
  NetcdfVariable drift{names.free(name + "_drift"),
                       {"run"},
                       described("largest distance of the integral of " + name + " from that of the first frame"),
                       {}};
  NetcdfVariable relative{names.free(name + "_relative_drift"),
                          {"run"},
                          described("the same in parts of the integral of its magnitude, a mean over the frames"),
                          {}};
  for (const DataRun& run : runs) {
    const analysis::Integrals& own = run.integrals[v];
    integral.values.insert(integral.values.end(), own.values.begin(), own.values.end());
    drift.values.push_back(own.drift());
    relative.values.push_back(own.relative_drift());
  }
  content.variables.insert(content.variables.end(), {std::move(integral), std::move(drift), std::move(relative)});
}

/// Adds the residuals of the frames in each run, if they are known.
void add_residuals(NetcdfContent& content, const std::string& state, std::size_t s, const DataFile& file,
                   NetcdfNames& names) {
  const auto is_unknown = [&](const DataRun& run) { return std::isnan(file.of(run).residuals[s].rate); };
  if (std::ranges::any_of(file.runs, is_unknown)) return;
  NetcdfVariable rate{names.free(state + "_residual"),
                      {"run"},
                      described("root of the mean square of what the scene's steps from a frame, on the grid of the "
                                "frames, miss the next one by, in a unit of time"),
                      {}};
  NetcdfVariable relative{names.free(state + "_relative_residual"),
                          {"run"},
                          described("the same in parts of the change from frame to frame"),
                          {}};
  for (const DataRun& run : file.runs) {
    rate.values.push_back(file.of(run).residuals[s].rate);
    relative.values.push_back(file.of(run).residuals[s].relative);
  }
  content.variables.insert(content.variables.end(), {std::move(rate), std::move(relative)});
}

NetcdfAttributes attributes_of(const OrderEstimate& estimate) {
  if (!estimate.is_known()) return {{files::attribute_of_no_error, estimate.why_not}};
  return {{"order_estimate", estimate.order},
          {"difference_to_twice_the_spacing", estimate.difference},
          {files::attribute_of_error, estimate.error()}};
}

/// Adds the frames of a field or formula, with error information.
void add_variable(NetcdfContent& content, const DataFile& file, std::size_t v, const AxisNames& axes,
                  const std::string& time, const std::vector<OrderEstimate>& estimates, NetcdfNames& names) {
  const model::Problem& problem = file.maker.session().problem();
  const FrameVariable& frames = file.maker.variables()[v];
  NetcdfVariable variable{
      frames.name,
      {"run", time},
      described((frames.is_state ? "field " : "formula ") + frames.name, problem.unit_of(frames.name)),
      {},
      problem.scheme.real == Precision::f32};
  for (std::size_t a = axes.size(); a-- > 0;) variable.dimensions.push_back(axes[a][frames.placement[a] ? 1 : 0]);
  for (const DataRun& run : file.runs) {
    const std::vector<double>& values = file.of(run).frames[v];
    variable.values.insert(variable.values.end(), values.begin(), values.end());
  }
  const auto estimate = std::ranges::find(estimates, frames.name, &OrderEstimate::variable);
  const NetcdfAttributes told = attributes_of(*estimate);
  variable.attributes.insert(variable.attributes.end(), told.begin(), told.end());
  content.variables.push_back(std::move(variable));
  add_integrals(content, frames.name, v, time, file.runs, names);
  if (frames.is_state) add_residuals(content, frames.name, v, file, names);
}

}  // namespace

NetcdfContent content_of(const DataFile& file, const std::vector<OrderEstimate>& estimates, const SourceFile& source,
                         const driver::RunOrigin& origin) {
  NetcdfContent content;
  DataSetMaker& maker = file.maker;
  const std::vector<DataRun>& runs = file.runs;
  driver::Session& session = maker.session();
  const model::DataSet& set = maker.set();
  NetcdfNames names(driver::taken_names(session.problem()));
  content.attributes = driver::attributes_of(session.problem(), source, origin);
  content.attributes.insert(content.attributes.end(), {{"dpde_dataset", block_text(source, set.name)},
                                                       {"dpde_dataset_seed", static_cast<double>(set.seed)}});
  const AxisNames axes = add_axes(content, driver::run_axes(session.problem(), axes_of(file)), names);
  const std::string time = names.free("time");
  content.dimensions.insert(content.dimensions.end(), {{"run", static_cast<std::int64_t>(runs.size())},
                                                       {time, static_cast<std::int64_t>(maker.times().size())}});
  content.variables.push_back(time_variable(time, session.problem().unit_of("t"), maker.times()));
  for (std::size_t v = 0; v < maker.variables().size(); ++v) {
    if (maker.variables()[v].is_kept) add_variable(content, file, v, axes, time, estimates, names);
  }
  for (std::size_t v = 0; v < set.vary.size(); ++v) {
    NetcdfVariable variable{set.vary[v].param, {"run"}, described("parameter " + set.vary[v].param), {}};
    if (set.vary[v].counts) variable.attributes.emplace_back(files::attribute_of_counts, "yes");
    for (const DataRun& run : runs) variable.values.push_back(run.params[v]);
    content.variables.push_back(std::move(variable));
  }
  for (const RunNumber& param : driver::run_params(session.problem())) {
    const bool varies = std::ranges::find(set.vary, param.name, &model::DataSet::Vary::param) != set.vary.end();
    if (!varies) content.variables.push_back(parameter_variable(param));
  }
  return content;
}

}  // namespace dpde::training
