// SPDX-License-Identifier: Apache-2.0
// Each model is checked in a generated file with a faultless scene and only the functions the model calls. Copying the
// whole file for each model would take quadratic time.
#include "driver/compile/lone_models.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <optional>
#include <set>

#include "model/from_ast.h"
#include "syntax/expand/calls.h"

namespace dpde::driver {

namespace {

/// Writes a scene positioned after the end of the file, so that no message points into it.
class SceneWriter {
 public:
  explicit SceneWriter(std::size_t file_bytes) : last_(static_cast<int>(file_bytes)) {}

  ast::Declaration scene_for(const ast::Model& model, const std::string& name, int axes) {
    ast::Scene scene{called(name), called(model.name.name), {}, {}, {}};
    add(scene, ast::TimeItem{number(0), number(1), number(0.5), {}, {}, {}, {}, {}});
    for (int a = 0; a < axes; ++a) {
      add(scene, ast::GridItem{called(std::string(1, "xyz"[a])), number(0), number(1), number(8), true, {}});
    }
    for (const ast::Item& item : model.items) {
      if (const auto* fields = get_if<ast::FieldItem>(&item.kind)) {
        for (const ast::Identifier& name : fields->names) {
          if (given_.insert(name.name).second) add(scene, ast::InitialItem{called(name.name), number(0), {}});
        }
      } else if (const auto* params = get_if<ast::ParamItem>(&item.kind)) {
        give_values(scene, params->names);
      } else if (const auto* coefficients = get_if<ast::CoefficientItem>(&item.kind)) {
        give_values(scene, coefficients->names, coefficients->mask);
      }
    }
    return {std::move(scene), place(), {}, {}, false};
  }

 private:
  SourceRange place() {
    last_ += 2;
    return {last_ - 1, last_};
  }
  ast::Identifier called(const std::string& name) { return {name, place()}; }
  ast::Expr number(double value) { return ast::Expr(ast::Node{ast::Number{value, fmt::format("{}", value)}, place()}); }
  void add(ast::Scene& scene, ast::ItemKind item) { scene.items.push_back({std::move(item), place(), {}}); }
  void give_values(ast::Scene& scene, const std::vector<ast::Identifier>& names, bool are_masks = false) {
    for (const ast::Identifier& name : names) {
      ast::Expr value = number(0.5);
      if (are_masks) value = ast::Expr(ast::Node{ast::Binary{BinaryOp::less, number(1), number(0)}, place()});
      if (given_.insert(name.name).second) add(scene, ast::ValueItem{called(name.name), std::move(value), {}});
    }
  }

  int last_;
  std::set<std::string> given_;  // given once: a duplicate name is an error of the model
};

/// Declarations of the file that models may use, by name.
class Surroundings {
 public:
  explicit Surroundings(const ast::File& file) {
    for (const ast::Declaration& declaration : file.declarations) {
      if (const auto* function = std::get_if<ast::Function>(&declaration.kind)) add(function->name.name, declaration);
      if (const auto* network = std::get_if<ast::Network>(&declaration.kind)) add(network->name.name, declaration);
      const bool is_first_scheme = !scheme_ && std::holds_alternative<ast::Scheme>(declaration.kind);
      if (is_first_scheme) scheme_ = &declaration;
    }
  }

  /// A file with the default scheme, and all functions and networks.
  ast::File all() const {
    ast::File file = scheme_alone();
    for (const ast::Declaration* declaration : in_order_) file.declarations.push_back(*declaration);
    return file;
  }

  /// The same with only the functions and networks that `model` calls.
  ast::File called_by(const ast::Model& model) const {
    ast::File file = scheme_alone();
    std::set<std::string> open = ast::calls_of(model), seen;
    while (!open.empty()) {
      const std::string name = open.extract(open.begin()).value();
      const auto found = known_.find(name);
      if (found == known_.end() || !seen.insert(name).second) continue;
      file.declarations.push_back(*found->second);
      if (const auto* function = std::get_if<ast::Function>(&found->second->kind)) open.merge(ast::calls_of(*function));
    }
    return file;
  }

 private:
  void add(const std::string& name, const ast::Declaration& declaration) {
    known_.emplace(name, &declaration);
    in_order_.push_back(&declaration);
  }
  ast::File scheme_alone() const {
    ast::File file;
    if (scheme_) file.declarations.push_back(*scheme_);
    return file;
  }

  std::map<std::string, const ast::Declaration*> known_;
  std::vector<const ast::Declaration*> in_order_;
  const ast::Declaration* scheme_ = nullptr;
};

/// Reports the messages of a model in `file` on `axes` axes.
void check(ast::File file, const ast::Declaration& model, int axes, std::size_t file_bytes, DiagnosticSink& sink) {
  const std::string scene = "the scene of a lone model";  // not a valid name, so it cannot clash
  const auto& kind = std::get<ast::Model>(model.kind);
  file.declarations.push_back(model);
  file.declarations.push_back(SceneWriter(file_bytes).scene_for(kind, scene, axes));
  model::from_ast(file, {scene, {}, ""}, sink);
}

}  // namespace

void check_lone_models(const ast::File& file, const SourceFile& source, DiagnosticSink& sink) {
  const auto is_model = [](const ast::Declaration& d) { return std::holds_alternative<ast::Model>(d.kind); };
  if (std::ranges::none_of(file.declarations, is_model) || !model::check_block_names(file, sink)) return;
  const Surroundings surroundings(file);
  const std::size_t bytes = source.text().size();
  bool is_first = true;
  for (const ast::Declaration& model : file.declarations) {
    if (!is_model(model)) continue;
    // The first model is checked with all networks, so unused networks are checked too.
    const ast::File called = is_first ? surroundings.all() : surroundings.called_by(std::get<ast::Model>(model.kind));
    is_first = false;
    std::optional<std::size_t> fewest;
    int best = 1;
    for (int axes = 1; axes <= 3; ++axes) {
      DiagnosticSink own;
      check(called, model, axes, bytes, own);
      const std::size_t mistakes = own.has_errors() ? own.all().size() : 0;
      if (fewest && mistakes >= *fewest) continue;
      fewest = mistakes;
      best = axes;
      if (mistakes == 0) break;
    }
    if (*fewest > 0) check(surroundings.all(), model, best, bytes, sink);  // all names, for hints
    if (sink.is_full()) return;
  }
}

}  // namespace dpde::driver
