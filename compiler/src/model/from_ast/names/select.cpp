// SPDX-License-Identifier: Apache-2.0
// Selects the task, scene, model or program of the file; checks that names of blocks are unique.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "model/from_ast/formulas/built_ins.h"
#include "model/from_ast/formulas/formula_scope.h"
#include "model/from_ast/parts.h"
#include "support/match.h"

namespace dpde::model {

namespace {

/// A parameter may have the name of a coordinate or t: in f(x), x is the parameter.
void check_function(Elaboration& elaboration, const ast::Function& function) {
  const auto refuse = [&](const ast::Identifier& name, const char* what) {
    elaboration.sink.report("reserved-name", name.range, {name.name, what}, "choose another name");
  };
  if (formulas::find_built_in(function.name.name) != nullptr) refuse(function.name, "function");
  std::map<std::string, SourceRange> seen;
  for (const ast::Identifier& parameter : function.parameters) {
    const auto [first, is_new] = seen.emplace(parameter.name, parameter.range);
    if (!is_new) report_duplicate(elaboration, "parameter " + parameter.name, parameter.range, first->second);
    const bool is_place = axis_of(parameter.name) >= 0 || parameter.name == "t";
    if (!is_place && is_reserved(parameter.name)) refuse(parameter, "parameter");
  }
}

/// Names of scenes, tasks and programs are used on the command line, those of models and programs in scenes. False if
/// two are equal.
bool names_are_unique(Elaboration& elaboration) {
  bool fine = true;
  std::map<std::string, SourceRange> chosen, models, schemes, functions;
  const auto add = [&](std::map<std::string, SourceRange>& names, const ast::Identifier& name) {
    const auto [first, is_new] = names.emplace(name.name, name.range);
    if (!is_new) report_duplicate(elaboration, name.name, name.range, first->second);
    fine = fine && is_new;
    return is_new;
  };
  for (const ast::Declaration& declaration : elaboration.file.declarations) {
    match(
        declaration.kind, [&](const ast::Model& m) { add(models, m.name); },
        [&](const ast::Scene& s) { add(chosen, s.name); }, [&](const ast::Scheme& s) { add(schemes, s.name); },
        [&](const ast::Task& t) { add(chosen, t.name); },
        [&](const ast::Program& p) {
          if (add(chosen, p.name)) add(models, p.name);
        },
        ignored<ast::Kernel, ast::Loop, ast::Import>, [&](const ast::Network& n) { add(functions, n.name); },
        [&](const ast::DataSet& d) { add(chosen, d.name); }, [&](const ast::Chart& c) { add(chosen, c.name); },
        [&](const ast::Function& f) {
          add(functions, f.name);
          check_function(elaboration, f);
        });
  }
  return fine;
}

void report_unknown_block(Elaboration& elaboration, const std::string& what, const std::string& name, SourceRange range,
                          const std::vector<std::string>& candidates) {
  elaboration.sink.report("unknown-block", range, {what, name}, did_you_mean(name, candidates));
}

std::vector<std::string> joined(std::vector<std::string> a, const std::vector<std::string>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

/// A hint for blocks with this or a similar name that only some commands accept; "" if there is none.
std::string hint_of_verb(const Elaboration& elaboration, const std::string& name) {
  const auto named = [&](const std::vector<std::string>& names) {
    return std::ranges::find(names, name) != names.end() ? name : nearest_name(name, names);
  };
  const std::string chart = named(names_of<ast::Chart>(elaboration.file));
  if (!chart.empty()) return fmt::format("{0} is a chart: dpde chart FILE {0}, or dpde tune FILE {0}", chart);
  const std::string data_set = named(names_of<ast::DataSet>(elaboration.file));
  return data_set.empty() ? "" : fmt::format("{0} is a data set: dpde run FILE {0} --out DIR", data_set);
}

bool select_named(Elaboration& elaboration, const std::string& name) {
  elaboration.blocks.task = find_declaration<ast::Task>(elaboration.file, name);
  elaboration.blocks.scene = find_declaration<ast::Scene>(elaboration.file, name);
  if (elaboration.blocks.scene) elaboration.blocks.task = nullptr;
  if (elaboration.blocks.task || elaboration.blocks.scene) return true;
  const std::vector<std::string> fitting = joined(task_names(elaboration.file), scene_names(elaboration.file));
  const std::string of_verb = nearest_name(name, fitting).empty() ? hint_of_verb(elaboration, name) : "";
  elaboration.sink.report("unknown-block", {}, {"scene or task", name},
                          of_verb.empty() ? did_you_mean(name, fitting) : of_verb);
  return false;
}

/// Blocks of the file itself have precedence over imported ones.
bool select_only(Elaboration& elaboration) {
  ast::File own = elaboration.file;
  std::erase_if(own.declarations, [](const ast::Declaration& declaration) { return declaration.imported; });
  const bool has_own = !task_names(own).empty() || !scene_names(own).empty();
  const ast::File& from = has_own ? own : elaboration.file;
  const std::vector<std::string> tasks = task_names(from), scenes = scene_names(from);
  if (tasks.size() == 1) return select_named(elaboration, tasks.front());
  if (tasks.empty() && scenes.size() == 1) return select_named(elaboration, scenes.front());
  if (scenes.empty()) {
    elaboration.sink.report("no-scene", {}, {}, "write scene NAME : MODEL { grid ...; initial ...; time ... }");
    return false;
  }
  elaboration.sink.report("choose-one", {}, {tasks.empty() ? "scenes" : "tasks"},
                          fmt::format("name one of: {}", fmt::join(joined(tasks, scenes), ", ")));
  return false;
}

bool select_scene_of_task(Elaboration& elaboration) {
  if (!elaboration.blocks.task) return true;
  if (!elaboration.selection.beside.empty()) {
    elaboration.blocks.scene = find_declaration<ast::Scene>(elaboration.file, elaboration.selection.beside);
    if (!elaboration.blocks.scene)
      report_unknown_block(elaboration, "scene", elaboration.selection.beside, {}, scene_names(elaboration.file));
    return elaboration.blocks.scene != nullptr;
  }
  const ast::Identifier& of = elaboration.blocks.task->of;
  elaboration.blocks.scene = find_declaration<ast::Scene>(elaboration.file, of.name);
  if (!elaboration.blocks.scene)
    report_unknown_block(elaboration, "scene", of.name, of.range, scene_names(elaboration.file));
  return elaboration.blocks.scene != nullptr;
}

/// False after a diagnostic.
bool select_models(Elaboration& elaboration) {
  std::map<std::string, SourceRange> seen{{elaboration.blocks.scene->of.name, elaboration.blocks.scene->of.range}};
  std::vector<ast::Identifier> all{elaboration.blocks.scene->of};
  all.insert(all.end(), elaboration.blocks.scene->also.begin(), elaboration.blocks.scene->also.end());
  bool fine = true;
  for (const ast::Identifier& name : all) {
    const auto [first, is_new] = seen.emplace(name.name, name.range);
    if (!(first->second == name.range)) report_duplicate(elaboration, "model " + name.name, name.range, first->second);
    const bool exists = find_declaration<ast::Model>(elaboration.file, name.name) != nullptr;
    if (!exists)
      report_unknown_block(elaboration, "model", name.name, name.range, names_of<ast::Model>(elaboration.file));
    fine = fine && exists && first->second == name.range;
  }
  if (!fine) return false;
  elaboration.blocks.coupled = coupled_model(elaboration.file, *elaboration.blocks.scene);
  elaboration.blocks.model = &*elaboration.blocks.coupled;
  return true;
}

bool select_model(Elaboration& elaboration) {
  if (!elaboration.blocks.scene->also.empty()) return select_models(elaboration);
  const ast::Identifier& of = elaboration.blocks.scene->of;
  elaboration.blocks.model = find_declaration<ast::Model>(elaboration.file, of.name);
  if (!elaboration.blocks.model) elaboration.blocks.program = find_declaration<ast::Program>(elaboration.file, of.name);
  if (elaboration.blocks.model || elaboration.blocks.program) return true;
  report_unknown_block(elaboration, "model or program", of.name, of.range,
                       joined(names_of<ast::Model>(elaboration.file), names_of<ast::Program>(elaboration.file)));
  return false;
}

/// Names in the models before one: fields, with whether they are vectors; for coefficients also their placement.
struct Provided {
  std::set<std::pair<std::string, bool>> fields;
  std::set<std::tuple<std::string, bool, std::string>> coefficients;
};

std::string place_of(const ast::CoefficientItem& item) { return item.on ? item.on->name : ""; }

void add_coefficients(Provided& provided, const ast::Model& model) {
  for (const auto& [item, range] : items_of<ast::CoefficientItem>(model.items)) {
    if (item.control || item.mask) continue;
    for (const ast::Identifier& name : item.names)
      provided.coefficients.emplace(name.name, item.vector, place_of(item));
  }
}

/// `item` without the coefficients among `provided`.
ast::Item without(ast::Item item, const Provided& provided) {
  auto* given = get_if<ast::CoefficientItem>(&item.kind);
  if (!given || given->control) return item;
  const auto is_provided = [&](const ast::Identifier& name) {
    return provided.fields.contains({name.name, given->vector}) ||
           (!given->mask && provided.coefficients.contains({name.name, given->vector, place_of(*given)}));
  };
  for (std::size_t i = given->names.size(); i-- > 0;) {
    if (!is_provided(given->names[i])) continue;
    given->names.erase(given->names.begin() + static_cast<std::ptrdiff_t>(i));
    given->units.erase(given->units.begin() + static_cast<std::ptrdiff_t>(i));
  }
  return item;
}

}  // namespace

bool check_block_names(const ast::File& file, DiagnosticSink& sink) {
  const Selection none;
  Elaboration elaboration(file, none, sink);
  return names_are_unique(elaboration);
}

std::optional<ast::Model> coupled_model(const ast::File& file, const ast::Scene& scene) {
  std::vector<const ast::Model*> models{find_declaration<ast::Model>(file, scene.of.name)};
  for (const ast::Identifier& name : scene.also) models.push_back(find_declaration<ast::Model>(file, name.name));
  Provided provided;
  for (const ast::Model* model : models) {
    if (!model) return std::nullopt;
    for (const auto& [item, range] : items_of<ast::FieldItem>(model->items)) {
      for (const ast::Identifier& name : item.names) provided.fields.emplace(name.name, item.vector);
    }
  }
  ast::Model all{scene.of, {}};
  for (const ast::Identifier& name : scene.also) all.name.name += ", " + name.name;
  for (const ast::Model* model : models) {
    for (const ast::Item& item : model->items) all.items.push_back(models.size() > 1 ? without(item, provided) : item);
    add_coefficients(provided, *model);
  }
  return all;
}

bool select(Elaboration& elaboration) {
  if (!names_are_unique(elaboration)) return false;
  const std::string& name = elaboration.selection.name;
  if (!(name.empty() ? select_only(elaboration) : select_named(elaboration, name))) return false;
  if (!select_scene_of_task(elaboration) || !select_model(elaboration)) return false;
  elaboration.problem.scene = elaboration.blocks.scene->name.name;
  elaboration.problem.remarks.dropped = elaboration.blocks.scene->left_out;
  if (elaboration.blocks.model) elaboration.problem.model = elaboration.blocks.model->name.name;
  if (elaboration.blocks.program) elaboration.problem.program = elaboration.blocks.program->name.name;
  return true;
}

}  // namespace dpde::model
