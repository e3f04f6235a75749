// SPDX-License-Identifier: Apache-2.0
// Tests in a comparison run of a scene with other states. That scene's states replace the formulas by which its map
// computes them from the task's states; the same applies to data.
#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <set>

#include "model/from_ast/parts.h"
#include "model/from_ast/state_map_from_ast.h"
#include "model/print/words.h"
#include "support/match.h"
#include "syntax/expand/arrays.h"
#include "syntax/expand/calls.h"
#include "syntax/print/print_ast.h"

namespace dpde::model {

namespace {

using Replacement = std::function<std::optional<ast::Expr>(const ast::Expr&)>;

/// Replaces the whole expression if `by` does, else its parts.
ast::Expr replaced(const ast::Expr& e, const Replacement& by) {
  if (const std::optional<ast::Expr> other = by(e)) return *other;
  const auto at = [&](ast::Kind kind) { return ast::Expr(ast::Node{std::move(kind), e.range()}); };
  return match(
      e->kind,
      [&](const ast::Unary& u) {
        return at(ast::Unary{u.op, replaced(u.operand, by)});
      },
      [&](const ast::Binary& b) {
        return at(ast::Binary{b.op, replaced(b.left, by), replaced(b.right, by)});
      },
      [&](ast::Call call) {
        for (ast::Argument& argument : call.arguments) argument.value = replaced(argument.value, by);
        return at(std::move(call));
      },
      [&](ast::Tuple tuple) {
        for (ast::Expr& element : tuple.elements) element = replaced(element, by);
        return at(std::move(tuple));
      },
      [&](const ast::Component& component) {
        const ast::Expr operand = replaced(component.operand, by);
        const auto* name = std::get_if<ast::Name>(&operand->kind);  // a component of a name is part of the name
        return name != nullptr ? at(ast::Name{name->name + "." + component.name.name})
                               : at(ast::Component{operand, component.name});
      },
      [&](const OneOf<ast::Number, ast::Text, ast::Name, ast::Offsets, ast::Error> auto&) { return e; });
}

/// Renames each name, also in its components.
ast::Expr renamed(const ast::Expr& e, const std::map<std::string, std::string>& names) {
  return replaced(e, [&](const ast::Expr& part) -> std::optional<ast::Expr> {
    const auto* name = std::get_if<ast::Name>(&part->kind);
    if (name == nullptr) return std::nullopt;
    const std::size_t dot = std::min(name->name.find('.'), name->name.size());
    const auto other = names.find(name->name.substr(0, dot));
    if (other == names.end()) return std::nullopt;
    return ast::Expr(ast::Node{ast::Name{other->second + name->name.substr(dot)}, part.range()});
  });
}

/// Replaces `formula`, or a component of it if it is a name, by `name`.
ast::Expr put_name(const ast::Expr& e, const ast::Expr& formula, const std::string& name) {
  const std::string text = print(formula);
  const auto* vector = std::get_if<ast::Name>(&formula->kind);
  return replaced(e, [&](const ast::Expr& part) -> std::optional<ast::Expr> {
    if (print(part) == text) return ast::Expr(ast::Node{ast::Name{name}, part.range()});
    const auto* component = std::get_if<ast::Name>(&part->kind);
    if (vector == nullptr || component == nullptr || vector_of(component->name) != vector->name) return std::nullopt;
    return ast::Expr(ast::Node{ast::Name{name + component->name.substr(vector->name.size())}, part.range()});
  });
}

/// The variable of a datum from trajectories.
std::string variable_of(const ast::DataItem& item) {
  const auto* call = std::get_if<ast::Call>(&item.value->kind);
  const bool fits = call != nullptr && call->callee == "trajectories" && call->arguments.size() == 2;
  const auto* name = fits ? std::get_if<ast::Name>(&call->arguments[1].value->kind) : nullptr;
  return name != nullptr ? name->name : "";
}

/// A name that the file does not use.
std::string name_of_data(const Elaboration& elaboration, const std::string& field) {
  std::string name = field + "_data";
  const auto is_taken = [&] {
    const auto items = items_of<ast::DataItem>(elaboration.blocks.task->items);
    return elaboration.names.scope.find(name) != nullptr ||
           std::ranges::any_of(items, [&](const auto& item) { return item.kind.name.name == name; });
  };
  while (is_taken()) name += "_";
  return name;
}

/// The same line for the mapped field, whose frames are computed from those of the file.
ast::DataItem data_of_field(const ast::DataItem& like, const std::string& name, const std::string& field) {
  ast::DataItem item = like;
  item.name.name = name;
  item.on.reset();
  item.unit.reset();
  ast::Call call = std::get<ast::Call>(like.value->kind);
  call.arguments[1].value = ast::Expr(ast::Node{ast::Name{field}, call.arguments[1].value.range()});
  item.value = ast::Expr(ast::Node{std::move(call), like.value.range()});
  return item;
}

std::set<std::string> fields_in(const ast::Expr& e) {
  std::set<std::string> names;
  ast::for_each_name(e, [&](const std::string& name) { names.insert(name.substr(0, name.find('.'))); });
  return names;
}

/// The word for the common placement of these states; "centres" if there is none.
std::string place_of(const std::vector<const State*>& states, int axes, bool is_vector) {
  for (const std::string& word : words_of_placements()) {
    bool fits = true;
    for (std::size_t i = 0; i < states.size(); ++i) {
      const auto placement = placement_named(word, is_vector ? static_cast<int>(i) : -1, axes);
      fits = fits && placement && *placement == states[i]->placement;
    }
    if (fits) return word;
  }
  return "centres";
}

}  // namespace

std::vector<const State*> states_called(const Problem& there, const std::string& name) {
  std::vector<const State*> states;
  for (const State& state : there.states) {
    if (state.name == name || vector_of(state.name) == name) states.push_back(&state);
  }
  return states;
}

namespace {

/// Whether the scene has a field for each line of the map.
bool has_fields(const Problem& there, const StateMap& map, DiagnosticSink& sink) {
  std::vector<std::string> known;
  for (const State& state : there.states) known.push_back(state.name);
  std::set<std::string> seen;
  for (const ast::NamedFormula& each : map) {
    const std::string& name = each.name.name;
    if (states_called(there, name).empty()) {
      sink.report("no-such-field", each.name.range, {there.scene, name}, did_you_mean(name, known));
      return false;
    }
    if (seen.insert(name).second) continue;
    sink.report("bad-option", each.name.range, {name + " is given twice"}, "leave one of them out");
    return false;
  }
  return true;
}

}  // namespace

StateMap state_map_of(const ast::Task& task, const std::string& scene, DiagnosticSink& sink) {
  const ast::TestItem::Baseline* first = nullptr;
  for (const auto& [item, range] : items_of<ast::TestItem>(task.items)) {
    for (const ast::TestItem::Baseline& beside : item.beside) {
      if (beside.scene.name != scene) continue;
      const auto text = [](const ast::TestItem::Baseline& of) {
        std::string all;
        for (const ast::NamedFormula& each : of.map) all += each.name.name + " = " + print(*each.value) + ", ";
        return all;
      };
      if (first == nullptr) first = &beside;
      if (text(*first) == text(beside)) continue;
      sink.report("bad-option", beside.scene.range,
                  {"scene " + scene + " is beside two tests with two maps of its states"},
                  "write the same where after it in each line");
      return {};
    }
  }
  return first != nullptr ? first->map : StateMap{};
}

StateMap state_map_to(const Problem& there, const ast::File& file, const std::string& task, DiagnosticSink& sink) {
  const std::optional<ast::File> written = ast::with_elements(file, sink);
  const ast::Task* source = written ? find_declaration<ast::Task>(*written, task) : nullptr;
  if (source == nullptr) return {};
  StateMap map = state_map_of(*source, there.scene, sink);
  if (!has_fields(there, map, sink)) return {};
  for (ast::NamedFormula& each : map) {
    const std::vector<const State*> states = states_called(there, each.name.name);
    const bool is_vector = !states.empty() && states.front()->name != each.name.name;
    each.on = ast::Identifier{place_of(states, static_cast<int>(there.axes.size()), is_vector), each.value->range()};
  }
  return map;
}

namespace {

/// Names of the fields of the task's own scene.
std::set<std::string> own_fields(const Elaboration& elaboration) {
  std::set<std::string> fields;
  const auto* scene = find_declaration<ast::Scene>(elaboration.file, elaboration.blocks.task->of.name);
  const std::optional<ast::Model> model = scene != nullptr ? coupled_model(elaboration.file, *scene) : std::nullopt;
  if (!model) return fields;
  for (const auto& [item, range] : items_of<ast::FieldItem>(model->items)) {
    for (const ast::Identifier& name : item.names) fields.insert(name.name);
  }
  return fields;
}

/// The lines of a task for a scene with other states.
class MappedTask {
 public:
  MappedTask(Elaboration& elaboration, StateMap map)
      : elaboration_(elaboration), map_(std::move(map)), fields_(own_fields(elaboration)) {
    for (const auto& [item, range] : items_of<ast::DataItem>(elaboration.blocks.task->items))
      data_.emplace(variable_of(item), &item);
  }

  std::vector<ast::Item> items() {
    if (!has_fields(elaboration_.problem, map_, elaboration_.sink)) return {};
    for (const ast::Item& item : elaboration_.blocks.task->items) {
      const auto* test = get_if<ast::TestItem>(&item.kind);
      if (test != nullptr && names_scene(*test)) add(*test, item);
    }
    for (const ast::Item& item : elaboration_.blocks.task->items) {
      const auto* datum = get_if<ast::DataItem>(&item.kind);
      if (datum != nullptr && read_.contains(datum->name.name)) items_.push_back(item);
    }
    return std::move(items_);
  }

 private:
  bool names_scene(const ast::TestItem& test) const {
    return std::ranges::any_of(test.beside, [&](const ast::TestItem::Baseline& beside) {
      return beside.scene.name == elaboration_.selection.beside;
    });
  }

  void add(const ast::TestItem& test, const ast::Item& item) {
    ast::Item mapped = item;
    ast::Expr& value = get_if<ast::TestItem>(&mapped.kind)->value;
    if (test.kind != ast::TestItem::Kind::growth) {
      for (const ast::NamedFormula& each : map_) value = through(each, value, item.range);
      if (!is_known(value)) return;
    }
    items_.push_back(std::move(mapped));
  }

  /// Data for all fields of the formula are required: a formula must not mix data and states.
  ast::Expr through(const ast::NamedFormula& each, ast::Expr value, SourceRange range) {
    std::map<std::string, std::string> data_of_fields;
    bool has_all = true;
    for (const std::string& name : fields_in(*each.value)) {
      if (!fields_.contains(name)) continue;
      has_all = has_all && data_.contains(name);
      if (has_all) data_of_fields[name] = data_.at(name)->name.name;
    }
    if (has_all && !data_of_fields.empty()) {
      const std::string name = name_of_data(elaboration_, each.name.name);
      value = put_name(value, renamed(*each.value, data_of_fields), name);
      if (fields_in(value).contains(name) && read_.insert(name).second) {
        const ast::DataItem& like = *data_.at(data_of_fields.begin()->first);
        items_.push_back({data_of_field(like, name, each.name.name), range});
      }
    }
    return put_name(value, *each.value, each.name.name);
  }

  /// Whether the scene has all names in `value`; records the data.
  bool is_known(const ast::Expr& value) {
    const auto is_own_alone = [&](const std::string& name) {
      return fields_.contains(name) && elaboration_.names.scope.find(name) == nullptr;
    };
    for (const std::string& name : fields_in(value)) {
      const auto of = std::ranges::find_if(data_, [&](const auto& each) { return each.second->name.name == name; });
      read_.insert(name);
      if (!is_own_alone(name) && (of == data_.end() || !is_own_alone(of->first))) continue;
      elaboration_.sink.report("unknown-name", value.range(), {name},
                               fmt::format("scene {} has what its map makes: write {}", elaboration_.selection.beside,
                                           print(*map_.front().value)));
      return false;
    }
    return true;
  }

  Elaboration& elaboration_;
  StateMap map_;
  std::set<std::string> fields_;                      // of the task's own scene
  std::map<std::string, const ast::DataItem*> data_;  // the first datum of each variable
  std::set<std::string> read_;
  std::vector<ast::Item> items_;
};

}  // namespace

std::vector<ast::Item> items_of_task(Elaboration& elaboration) {
  const std::string& scene = elaboration.selection.beside;
  StateMap map = scene.empty() ? StateMap{} : state_map_of(*elaboration.blocks.task, scene, elaboration.sink);
  return map.empty() ? elaboration.blocks.task->items : MappedTask(elaboration, std::move(map)).items();
}

}  // namespace dpde::model
