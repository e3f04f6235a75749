// SPDX-License-Identifier: Apache-2.0
#include "driver/lone_models.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "model/from_ast.h"
#include "syntax/parser.h"

namespace dpde::driver {

namespace {

/// A scene in which nothing can be wrong. It stands behind the end of the file, so that no message points into it.
std::string scene_for(const ast::Model& model, int axes, std::size_t file_bytes) {
  std::string text(file_bytes, ' ');
  text += fmt::format("\nscene {0}_alone : {0} {{\n  time 0 .. 1, step 1/2\n", model.name.name);
  for (int a = 0; a < axes; ++a) text += fmt::format("  grid {} = 0 .. 1, cells 8, periodic\n", "xyz"[a]);
  for (const ast::Item& item : model.items) {
    if (const auto* fields = std::get_if<ast::FieldItem>(&item.kind)) {
      for (const ast::Identifier& name : fields->names) text += fmt::format("  initial {} = 0\n", name.name);
    } else if (const auto* params = std::get_if<ast::ParamItem>(&item.kind)) {
      for (const ast::Identifier& name : params->names) text += fmt::format("  {} = 1/2\n", name.name);
    } else if (const auto* coefficients = std::get_if<ast::CoefficientItem>(&item.kind)) {
      for (const ast::Identifier& name : coefficients->names) text += fmt::format("  {} = 1/2\n", name.name);
    }
  }
  return text + "}\n";
}

}  // namespace

void check_lone_models(const ast::File& file, const SourceFile& source, DiagnosticSink& sink) {
  for (const ast::Declaration& declaration : file.declarations) {
    const auto* model = std::get_if<ast::Model>(&declaration.kind);
    if (model == nullptr) continue;
    const auto check = [&](int axes, DiagnosticSink& into) {
      const SourceFile text(source.path(), scene_for(*model, axes, source.text().size()));
      ast::File with = file;
      for (ast::Declaration& scene : ast::parse(text, into).declarations) with.declarations.push_back(std::move(scene));
      model::from_ast(with, {model->name.name + "_alone", {}, ""}, into);
    };
    std::optional<std::size_t> fewest;
    int best = 1;
    for (int axes = 1; axes <= 3; ++axes) {
      DiagnosticSink own;
      check(axes, own);
      const std::size_t mistakes = own.has_errors() ? own.all().size() : 0;
      if (fewest && mistakes >= *fewest) continue;
      fewest = mistakes;
      best = axes;
    }
    if (*fewest > 0) check(best, sink);
  }
}

}  // namespace dpde::driver
