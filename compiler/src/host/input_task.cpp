// SPDX-License-Identifier: Apache-2.0
#include "host/input_task.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <optional>
#include <string_view>
#include <vector>

#include "model/from_ast.h"
#include "model/from_ast/names/names.h"
#include "syntax/expand/elements.h"
#include "syntax/parser.h"

namespace dpde::host {

namespace {

/// Fields declared by the file's models; arrays without their elements.
std::vector<std::string> fields_of(const ast::File& file) {
  std::vector<std::string> names;
  for (const ast::Declaration& declaration : file.declarations) {
    const auto* model = std::get_if<ast::Model>(&declaration.kind);
    if (model == nullptr) continue;
    for (const ast::Item& item : model->items) {
      const auto* declared = get_if<ast::FieldItem>(&item.kind);
      if (declared == nullptr) continue;
      for (const ast::Identifier& name : declared->names) names.push_back(ast::element_of(name.name).array);
    }
  }
  return names;
}

/// Line of the task that makes the value an unknown. @throws Error(input) if it is not a name, since it would be parsed
/// as text.
std::string line_for(const model::Problem& problem, const std::vector<std::string>& fields, const std::string& input) {
  const auto is_of_names = [](unsigned char c) {
    return std::isalnum(c) != 0 || std::string_view("_.()[],").find(static_cast<char>(c)) != std::string_view::npos;
  };
  std::string joined = input;  // c[1, 2] without the blank after the comma
  for (std::size_t at = joined.find(", "); at != std::string::npos; at = joined.find(", ", at)) joined.erase(at + 1, 1);
  if (input.empty() || !std::ranges::all_of(joined, is_of_names))
    throw Error(ErrorKind::input, fmt::format("inputs are names, and \"{}\" is none", input));
  const auto is_state = [&](const model::State& state) {
    return state.name == input || model::vector_of(state.name) == input;
  };
  if (std::ranges::any_of(problem.states, is_state)) return "  unknown initial " + input;
  const std::string array = ast::element_of(input).array;
  const bool is_other = problem.find_param(input) != nullptr || problem.find_coefficient(input) != nullptr;
  if (!is_other && std::ranges::find(fields, array) != fields.end()) return "  unknown initial " + input;
  if (problem.find_network(input) != nullptr) return "  learn " + input;
  return "  unknown " + input;
}

}  // namespace

std::string append_input_task(SourceFile& source, const HostOptions& options, DiagnosticSink& sink) {
  ast::File file = ast::parse(source, sink);
  if (sink.has_errors()) return "";
  const std::vector<std::string> scenes = model::scene_names(file), tasks = model::task_names(file);
  std::string scene = options.name.empty() && scenes.size() == 1 ? scenes[0] : options.name;
  if (std::ranges::find(scenes, scene) == scenes.end())
    throw Error(ErrorKind::input,
                fmt::format("inputs are of a scene, and there is no scene called \"{}\" (there is {})", scene,
                            scenes.empty() ? "none" : fmt::format("{}", fmt::join(scenes, ", "))));
  const std::optional<model::Problem> problem = model::from_ast(file, {scene, options.set, options.scheme, true}, sink);
  if (!problem || sink.has_errors()) return "";
  std::string name = scene + "_of_inputs";
  const auto is_used = [&](const std::vector<std::string>& names) {
    return std::ranges::find(names, name) != names.end();
  };
  while (is_used(scenes) || is_used(tasks)) name += "_";
  std::string text = fmt::format("task {} : {} {{\n", name, scene);
  const std::vector<std::string> fields = fields_of(file);
  for (const std::string& input : options.inputs) text += line_for(*problem, fields, input) + "\n";
  source.append("inputs", text + "  minimise sum(" + problem->states.front().name + ")\n}\n");
  return name;
}

}  // namespace dpde::host
