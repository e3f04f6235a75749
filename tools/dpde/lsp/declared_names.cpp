// SPDX-License-Identifier: Apache-2.0
#include "lsp/declared_names.h"

#include <algorithm>
#include <utility>

#include "support/match.h"
#include "syntax/expand/blocks.h"

namespace dpde::lsp {

namespace {

class Collector {
 public:
  Collector(const SourceFile& source, const ast::File& file) : source_(source), file_(file) {}

  std::vector<DeclaredName> run() {
    for (std::size_t i = 0; i < file_.declarations.size(); ++i) add_block(static_cast<int>(i));
    return std::move(names_);
  }

 private:
  void add(const ast::Identifier& name, std::string_view word, SourceRange line, int block) {
    if (!name.range.is_known()) return;
    const std::string plain = name.name.substr(0, name.name.find('['));
    const SourceRange range{name.range.begin,
                            std::min(name.range.end, name.range.begin + static_cast<int>(plain.size()))};
    names_.push_back({plain, std::string(word), range, line, block, plain.size() < name.name.size()});
  }

  void add_block(int number) {
    const ast::Declaration& declaration = file_.declarations[static_cast<std::size_t>(number)];
    const std::string_view text = source_.text();
    const auto begin = static_cast<std::size_t>(declaration.range.begin);
    const std::size_t end = std::min(text.find_first_of("{\n", begin), static_cast<std::size_t>(declaration.range.end));
    const SourceRange head{declaration.range.begin, static_cast<int>(end)};
    if (const ast::Identifier* name = name_of(declaration)) add(*name, word_of(declaration), head, -1);
    if (const auto* function = std::get_if<ast::Function>(&declaration.kind)) {
      for (const ast::Identifier& parameter : function->parameters) add(parameter, "parameter", head, number);
    }
    if (const auto* kernel = std::get_if<ast::Kernel>(&declaration.kind)) {
      for (const ast::KernelParameter& parameter : kernel->parameters) add(parameter.name, "parameter", head, number);
    }
    if (const auto* network = std::get_if<ast::Network>(&declaration.kind)) {
      for (const ast::Network::Input& input : network->inputs) add(input.name, "input", head, number);
    }
    add_items(declaration, number);
  }

  void add_items(const ast::Declaration& declaration, int number) {
    match(declaration.kind, [&](const auto& block) {
      if constexpr (requires { block.items; })
        ast::for_each_item(block.items, [&](const ast::Item& item) { add_item(item, number); });
    });
  }

  void add_item(const ast::Item& item, int block) {
    const auto add_all = [&](const std::vector<ast::Identifier>& names, std::string_view word) {
      for (const ast::Identifier& name : names) add(name, word, item.range, block);
    };
    const auto add_one = [&](const ast::Identifier& name, std::string_view word) {
      add(name, word, item.range, block);
    };
    if (const auto* field = get_if<ast::FieldItem>(&item.kind))
      add_all(field->names, field->vector ? "vector" : "field");
    if (const auto* given = get_if<ast::CoefficientItem>(&item.kind))
      add_all(given->names, given->mask ? "mask" : given->control ? "control field" : "coefficient");
    if (const auto* param = get_if<ast::ParamItem>(&item.kind)) add_all(param->names, "param");
    if (const auto* control = get_if<ast::ControlItem>(&item.kind)) add_all(control->names, "control");
    if (const auto* let = get_if<ast::LetItem>(&item.kind)) add_one(let->name, "let");
    if (const auto* solved = get_if<ast::SolvedItem>(&item.kind)) add_one(solved->unknown, "field solved for");
    if (const auto* zero = get_if<ast::ConstraintItem>(&item.kind)) add_one(zero->multiplier, "field of a constraint");
    if (const auto* grid = get_if<ast::GridItem>(&item.kind)) add_one(grid->axis, "axis");
    if (const auto* observed = get_if<ast::ObserveItem>(&item.kind)) add_one(observed->name, "observable");
    if (const auto* data = get_if<ast::DataItem>(&item.kind)) add_one(data->name, "data");
    if (const auto* test = get_if<ast::TestItem>(&item.kind)) add_one(test->name, "test");
  }

  const SourceFile& source_;
  const ast::File& file_;
  std::vector<DeclaredName> names_;
};

void add_known(const ast::File& file, const std::string& name, std::set<int>& known) {
  for (std::size_t i = 0; i < file.declarations.size(); ++i) {
    const ast::Declaration& declaration = file.declarations[i];
    const ast::Identifier* own = name_of(declaration);
    if (own == nullptr || own->name != name || !known.insert(static_cast<int>(i)).second) continue;
    if (const auto* scene = std::get_if<ast::Scene>(&declaration.kind)) {
      add_known(file, scene->of.name, known);
      for (const ast::Identifier& also : scene->also) add_known(file, also.name, known);
      if (scene->like) add_known(file, scene->like->name, known);
    }
    if (const auto* task = std::get_if<ast::Task>(&declaration.kind)) add_known(file, task->of.name, known);
    if (const auto* runs = std::get_if<ast::DataSet>(&declaration.kind)) add_known(file, runs->of.name, known);
    if (const auto* chart = std::get_if<ast::Chart>(&declaration.kind)) add_known(file, chart->of.name, known);
  }
}

}  // namespace

std::vector<DeclaredName> declared_names(const SourceFile& source, const ast::File& file) {
  return Collector(source, file).run();
}

std::set<int> blocks_known_to(const ast::File& file, const std::vector<std::string>& names_in_head) {
  std::set<int> known;
  for (const std::string& name : names_in_head) add_known(file, name, known);
  return known;
}

const ast::Identifier* name_of(const ast::Declaration& declaration) {
  return match(
      declaration.kind, [](const ast::Import&) -> const ast::Identifier* { return nullptr; },
      [](const ast::Loop&) -> const ast::Identifier* { return nullptr; },
      [](const auto& block) -> const ast::Identifier* { return &block.name; });
}

std::string_view word_of(const ast::Declaration& declaration) {
  return match(
      declaration.kind, [](const ast::Model&) { return "model"; }, [](const ast::Scene&) { return "scene"; },
      [](const ast::Scheme&) { return "scheme"; }, [](const ast::Task&) { return "task"; },
      [](const ast::Kernel&) { return "kernel"; }, [](const ast::Program&) { return "program"; },
      [](const ast::Loop&) { return "loop"; },
      [](const ast::Function& function) { return function.order ? "operator" : "function"; },
      [](const ast::Import&) { return "import"; }, [](const ast::Network&) { return "network"; },
      [](const ast::DataSet&) { return "dataset"; }, [](const ast::Chart&) { return "chart"; });
}

}  // namespace dpde::lsp
