// SPDX-License-Identifier: Apache-2.0
#include "driver/report/run_description.h"

#include <fmt/format.h>

#include "files/imports.h"
#include "model/analyse/placement.h"
#include "model/boundary/metric.h"
#include "model/print/print_model.h"
#include "support/version.h"

namespace dpde::driver {

namespace {

RunPoints points_of(const model::Axis& axis) {
  RunPoints points;
  for (int i = 0; i < axis.cells; ++i) {
    points.places.push_back(axis.centre(i));
    points.bounds.insert(points.bounds.end(), {axis.face(i), axis.face(i + 1)});
  }
  return points;
}

RunField field_of(const model::Problem& problem, const std::string& name) {
  RunField field{name, problem.unit_of(name)};
  const model::Placement placement = placement_of(problem, name);
  for (std::size_t a = 0; a < field.on_faces.size(); ++a) field.on_faces[a] = placement[a];
  return field;
}

}  // namespace

std::string called(const model::Problem& problem, const std::string& axis) {
  for (std::size_t a = 0; problem.metric && a < problem.metric->axes.size(); ++a) {
    if (problem.axes[a].name == axis) return problem.metric->axes[a];
  }
  return axis;
}

model::Placement placement_of(const model::Problem& problem, const std::string& field) {
  if (const model::OutputField* shown = problem.find_shown(field)) return shown->placement;
  return model::Placements(problem).of(field);
}

std::vector<Series> run_outputs(const model::Problem& problem) {
  std::vector<Series> outputs;
  for (const model::Output& output : problem.outputs) outputs.push_back({output.fields, output.every});
  return outputs;
}

std::vector<RunAxis> run_axes(const model::Problem& problem, const std::vector<model::Axis>& axes) {
  std::vector<RunAxis> result;
  for (std::size_t a = 0; a < axes.size(); ++a) {
    const model::Axis& axis = axes[a];
    RunAxis& described = result.emplace_back();
    described.name = axis.name;
    described.in_words = called(problem, axis.name);
    described.unit = problem.unit_of(axis.name);
    described.is_periodic = axis.topology == Topology::periodic;
    described.centres = points_of(axis);
    if (!problem.has_faces(a)) continue;
    model::Placement faces{};
    faces[a] = true;
    described.faces = points_of(model::axes_at(axes, faces)[a]);
  }
  return result;
}

/// Without controls: the attribute dpde_problem contains their formulas.
std::vector<RunNumber> run_params(const model::Problem& problem) {
  std::vector<RunNumber> numbers;
  for (const model::Parameter& param : problem.params) {
    if (problem.find_control(param.name) == nullptr)
      numbers.push_back({param.name, problem.unit_of(param.name), param.value});
  }
  return numbers;
}

std::set<std::string> taken_names(const model::Problem& problem) {
  std::set<std::string> names;
  for (const model::State& state : problem.states) names.insert(state.name);
  for (const model::Parameter& param : problem.params) names.insert(param.name);
  for (const model::Quantity& quantity : problem.observables) names.insert(quantity.name);
  for (const model::OutputField& shown : problem.shown) names.insert(shown.name);
  return names;
}

NetcdfAttributes attributes_of(const model::Problem& problem, const SourceFile& source, const RunOrigin& origin) {
  const std::string& what = origin.name.empty() ? problem.scene : origin.name;
  std::string settings, command = fmt::format("dpde {} {} {}", origin.verb, origin.file, what);
  for (const std::string& setting : origin.set) settings += (settings.empty() ? "" : "\n") + setting;
  for (const std::string& setting : origin.set) command += " --set " + setting;
  if (!origin.scheme.empty()) command += " --scheme " + origin.scheme;
  command += fmt::format(" --backend {} --seed {}", origin.backend, origin.seed);
  const std::string coordinates = problem.metric ? model::word_of(problem.metric->system) : "";
  return {{"Conventions", "CF-1.8"},
          {"title", fmt::format("scene {} of {}", problem.scene, origin.file)},
          {"source", version},
          {"history", command},
          {"dpde_scene", problem.scene},
          {"dpde_coordinates", coordinates},
          {"dpde_settings", settings},
          {"dpde_scheme", model::print(problem.scheme)},
          {"dpde_problem", model::print(problem)},
          {"dpde_text", files::text_without_imports(source)},
          {"dpde_step", problem.step},
          {"dpde_seed", static_cast<double>(origin.seed)}};
}

RunDescription describe_run(const model::Problem& problem, const std::vector<model::Axis>& axes,
                            const std::vector<std::string>& states, const SourceFile& source, const RunOrigin& origin) {
  RunDescription run;
  run.scene = problem.scene;
  run.axes = run_axes(problem, axes);
  for (const std::string& state : states) run.fields.push_back(field_of(problem, state));
  for (const model::OutputField& shown : problem.shown) run.fields.push_back(field_of(problem, shown.name));
  for (const model::Quantity& quantity : problem.observables)
    run.observables.push_back({quantity.name, problem.unit_of(quantity.name)});
  run.outputs = run_outputs(problem);
  run.params = run_params(problem);
  run.time_unit = problem.unit_of("t");
  run.steps = problem.steps;
  run.is_single = problem.scheme.real == Precision::f32;
  run.attributes = attributes_of(problem, source, origin);
  run.names = taken_names(problem);
  return run;
}

}  // namespace dpde::driver
