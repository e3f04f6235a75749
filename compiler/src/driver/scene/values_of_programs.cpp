// SPDX-License-Identifier: Apache-2.0
#include "driver/scene/values_of_programs.h"

#include <fmt/format.h>

#include <set>
#include <string>

#include "stencil/build.h"
#include "support/names/bound_names.h"

namespace dpde::driver {

namespace {

const ast::Scene* find_scene(const ast::File& file, const std::string& name) {
  for (const ast::Declaration& declaration : file.declarations) {
    const ast::Scene* scene = std::get_if<ast::Scene>(&declaration.kind);
    if (scene != nullptr && scene->name.name == name) return scene;
  }
  return nullptr;
}

/// Source range of the parameter's declaration in a kernel.
SourceRange declared_in(const ast::File& file, const std::string& param) {
  for (const ast::Declaration& declaration : file.declarations) {
    const ast::Kernel* kernel = std::get_if<ast::Kernel>(&declaration.kind);
    if (kernel == nullptr) continue;
    for (const ast::KernelParameter& each : kernel->parameters) {
      if (each.name.name == param) return each.name.range;
    }
  }
  return {};
}

}  // namespace

void check_values(const ast::File& file, const model::Problem& problem, const stencil::Module& module,
                  DiagnosticSink& sink) {
  std::set<std::string> told;
  for (const stencil::Program& program : module.programs) {
    for (const std::string& param : stencil::interface_of(module, program).params) {
      if (find_bound_name(param) != nullptr || problem.find_param(param) != nullptr || !told.insert(param).second)
        continue;
      const auto* scene = find_scene(file, problem.scene);
      Diagnostic& diagnostic =
          sink.report("missing-value", scene == nullptr ? SourceRange{} : scene->name.range, {"parameter", param},
                      fmt::format("program {} takes it: write {} = 1 in scene {}", program.name, param, problem.scene));
      diagnostic.notes.push_back({declared_in(file, param), "it is declared here"});
    }
  }
}

}  // namespace dpde::driver
