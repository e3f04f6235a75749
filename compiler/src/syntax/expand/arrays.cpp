// SPDX-License-Identifier: Apache-2.0
#include "syntax/expand/arrays.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <functional>
#include <map>
#include <ranges>
#include <set>

#include "syntax/expand/array_places.h"
#include "syntax/expand/calls.h"
#include "syntax/expand/elements.h"

namespace dpde::ast {

namespace {

constexpr int most_elements = 1000;
constexpr int most_terms = 100000;  // in the sums of a block

using Arrays = std::map<std::string, std::vector<int>>;  // number of elements along each index
using Values = std::map<std::string, int>;               // of index variables

/// Expands the lines of one block of the file, with the arrays known in it.
class ArrayBlock {
 public:
  /// Index variables must not have one of the names `taken`, which they would hide.
  ArrayBlock(Arrays arrays, const std::set<std::string>& taken, DiagnosticSink& sink)
      : arrays_(std::move(arrays)), taken_(taken), sink_(sink) {}

  /// Adds the arrays that the lines declare.
  void declare(std::vector<Item>& items) {
    for (Item& item : items) {
      if (auto* param = get_if<ParamItem>(&item.kind)) declare(param->names);
      if (declares_fields(item)) declare(*list_of(item));
    }
    for (Item& item : items) {
      if (get_if<LetItem>(&item.kind) || get_if<DataItem>(&item.kind) || get_if<ObserveItem>(&item.kind))
        declare_by_formula(item);
    }
  }

  static bool declares_fields(const Item& item) {
    return get_if<FieldItem>(&item.kind) || get_if<CoefficientItem>(&item.kind) || get_if<ControlItem>(&item.kind);
  }

  const Arrays& arrays() const { return arrays_; }

  std::vector<Item> written_out(std::vector<Item> items) {
    if (arrays_.empty() && std::ranges::none_of(items, [&](Item& item) { return has_index(item); })) return items;
    std::vector<Item> all;
    for (Item& item : items) add(item, all);
    return all;
  }

  /// Rows of a scheme: advect c = upwind(1) becomes one row for each element.
  std::vector<Item> rows_of_elements(const std::vector<Item>& rows) {
    std::vector<Item> all;
    for (const Item& row : rows) {
      const auto* value = get_if<ValueItem>(&row.kind);
      if (value == nullptr || !value->of) {
        all.push_back(row);
        continue;
      }
      for (const Identifier& element : elements_of(*value->of, false, [](const auto&) {})) {
        Item& one = all.emplace_back(row);
        get_if<ValueItem>(&one.kind)->of = element;
      }
    }
    return all;
  }

 private:
  static bool has_index(Item& item) {
    const Identifier* target = target_of(item);
    bool found = target != nullptr && !element_of(target->name).indices.empty();
    for (const Expr* formula : formulas_of(item))
      for_each_name(*formula, [&](const std::string& name) { found = found || !element_of(name).indices.empty(); });
    return found;
  }

  void refuse_index(const Element& element, const std::string& index, SourceRange range) {
    const auto array = arrays_.find(element.array);
    const std::string hint =
        array == arrays_.end()
            ? fmt::format("declare it, as in field {0}[3], or with let: let {0}[i] = 2*c[i] has as many as c",
                          element.array)
            : fmt::format(
                  "it is {}: indices are numbers from 1 on, those of the left side, or of a sum, as in "
                  "sum({}[j], j)",
                  text_of(element.array, array->second), element.array);
    sink_.report("bad-index", range, {index}, hint);
  }

  bool is_free(const std::string& index, SourceRange range) {
    if (!taken_.contains(index)) return true;
    sink_.report("bad-index", range, {index},
                 "something else is called so, which the index would hide: name it i or j");
    return false;
  }

  void declare(const std::vector<Identifier>& names) {
    for (const Identifier& name : names) {
      const Element element = element_of(name.name);
      if (element.indices.empty()) continue;
      std::vector<int> extents;
      for (const std::string& index : element.indices) extents.push_back(number_in(index).value_or(0));
      if (fits(extents)) arrays_[element.array] = extents;
      if (!fits(extents)) refuse_size(name);
    }
  }

  static bool fits(const std::vector<int>& extents) {
    double count = 1;
    for (const int extent : extents) count *= extent;
    return std::ranges::all_of(extents, [](int n) { return n >= 1; }) && count <= most_elements;
  }
  void refuse_size(const Identifier& name) {
    sink_.report("bad-index", name.range, {name.name},
                 fmt::format("an array is declared with its number of elements, 1 to {} in all: c[3]", most_elements));
  }

  /// let r[i] = k[i]*c[i]: takes the extents from the formula's arrays.
  void declare_by_formula(Item& item) {
    const Element element = element_of(target_of(item)->name);
    std::vector<int> extents;
    for (const std::string& index : element.indices) {
      const int extent = number_in(index) ? 0 : extent_of(index, item);
      if (extent == 0) return;  // reported when the line is expanded
      extents.push_back(extent);
    }
    if (!extents.empty() && fits(extents)) arrays_[element.array] = extents;
  }

  /// Extent of an index variable, from the array it indexes in this name; 0 if it does not occur.
  int extent_in(const std::string& index, const std::string& name) const {
    const Element element = element_of(name);
    const auto array = arrays_.find(element.array);
    for (std::size_t k = 0; array != arrays_.end() && k < element.indices.size(); ++k) {
      if (element.indices[k] == index && k < array->second.size()) return array->second[k];
    }
    return 0;
  }
  int extent_of(const std::string& index, const Expr& e) const {
    int extent = 0;
    for_each_name(e, [&](const std::string& name) { extent = std::max(extent, extent_in(index, name)); });
    return extent;
  }
  int extent_of(const std::string& index, Item& item) const {
    const Identifier* target = target_of(item);
    int extent = target == nullptr ? 0 : extent_in(index, target->name);
    for (const Expr* formula : formulas_of(item)) extent = std::max(extent, extent_of(index, *formula));
    return extent;
  }

  /// c_2 for c[i] with i = 2; the name itself if it is no element.
  std::string named(const std::string& name, const Values& values, SourceRange range) {
    const Element element = element_of(name);
    if (element.indices.empty()) return name;
    const auto array = arrays_.find(element.array);
    if (array == arrays_.end() || array->second.size() != element.indices.size()) {
      refuse_index(element, name, range);
      return name;
    }
    std::string text = element.before + element.array;
    for (std::size_t k = 0; k < element.indices.size(); ++k) {
      const auto known = values.find(element.indices[k]);
      const auto index = known != values.end() ? std::optional(known->second) : number_in(element.indices[k]);
      const bool is_there = index && *index >= 1 && *index <= array->second[k];
      if (!is_there && known != values.end())
        sink_.report("bad-index", range, {fmt::format("{} = {}", known->first, known->second)},
                     fmt::format("it is {}: {} counts the elements of a longer array, too, or of a sum",
                                 text_of(element.array, array->second), known->first));
      else if (!is_there)
        refuse_index(element, element.indices[k], range);
      text += fmt::format("_{}", index.value_or(1));
    }
    return text + element.behind;
  }

  Expr with(const Expr& e, const Values& values) {
    const SourceRange range = e.range();
    const auto at = [&](Kind kind) { return Expr(Node{std::move(kind), range}); };
    if (const auto* name = std::get_if<Name>(&e->kind)) {
      const auto index = values.find(name->name);
      if (index != values.end()) return at(Number{double(index->second), std::to_string(index->second)});
      if (arrays_.contains(name->name)) refuse_index({"", name->name, {}, ""}, name->name, range);
      return at(Name{named(name->name, values, range)});
    }
    if (const auto* offsets = std::get_if<Offsets>(&e->kind)) {
      const bool is_shift = offsets->has_signs && std::ranges::all_of(offsets->offsets, [](int n) { return n >= 1; });
      if (is_shift || !arrays_.contains(offsets->name)) return e;
      return at(Name{named(text_of(offsets->name, offsets->offsets), values, range)});
    }
    if (const auto* call = std::get_if<Call>(&e->kind)) return with_call(*call, values, range);
    if (const auto* unary = std::get_if<Unary>(&e->kind)) return at(Unary{unary->op, with(unary->operand, values)});
    if (const auto* b = std::get_if<Binary>(&e->kind))
      return at(Binary{b->op, with(b->left, values), with(b->right, values)});
    if (const auto* component = std::get_if<Component>(&e->kind))
      return at(Component{with(component->operand, values), component->name});
    if (const auto* tuple = std::get_if<Tuple>(&e->kind)) {
      Tuple all = *tuple;
      for (Expr& element : all.elements) element = with(element, values);
      return at(std::move(all));
    }
    return e;
  }

  Expr with_call(Call call, const Values& values, SourceRange range) {
    const bool is_sum = call.callee == "sum" && call.arguments.size() == 2;
    const auto* over = is_sum ? std::get_if<Name>(&call.arguments[1].value->kind) : nullptr;
    const int extent = over == nullptr ? 0 : extent_of(over->name, call.arguments[0].value);
    if (extent == 0) {
      for (Argument& argument : call.arguments) argument.value = with(argument.value, values);
      return Expr(Node{std::move(call), range});
    }
    if (!is_free(over->name, call.arguments[1].value.range())) return Expr(Node{std::move(call), range});
    std::optional<Expr> sum;
    Values inside = values;
    for (int k = 1; k <= extent; ++k) {
      if (++terms_ > most_terms) {
        if (terms_ == most_terms + 1)
          sink_.report("too-large", range, {}, "sums inside one another multiply their terms");
        return sum.value_or(Expr());
      }
      inside[over->name] = k;
      const Expr term = with(call.arguments[0].value, inside);
      sum = sum ? Expr(Node{Binary{BinaryOp::add, *sum, term}, range}) : term;
    }
    return *sum;
  }

  void set_formulas(Item& item, const Values& values) {
    for (Expr* formula : formulas_of(item)) *formula = with(*formula, values);
  }

  /// Index variables of the target; for a whole array, generated names 0, 1, ... of all indices.
  std::vector<std::string> open_indices(Identifier& target) const {
    const Element element = element_of(target.name);
    if (!element.indices.empty()) {
      std::vector<std::string> open = element.indices;
      std::erase_if(open, [](const std::string& index) { return number_in(index).has_value(); });
      return open;
    }
    const auto array = arrays_.find(element.array);
    if (array == arrays_.end()) return {};
    std::vector<std::string> open;
    for (std::size_t k = 0; k < array->second.size(); ++k) open.push_back(fmt::format("#{}", k));
    target.name = fmt::format("{}{}[{}]{}", element.before, element.array, fmt::join(open, ", "), element.behind);
    return open;
  }

  void add(Item& item, std::vector<Item>& all) {
    add_declared(item);
    if (auto* event = get_if<EventItem>(&item.kind)) event->updates = of_event(event->updates);
    Identifier* target = target_of(item);
    const std::vector<std::string> open = target == nullptr ? std::vector<std::string>{} : open_indices(*target);
    std::vector<int> extents;
    for (const std::string& index : open) {
      if (!is_free(index, target->range)) return;
      extents.push_back(std::max(1, extent_of(index, item)));
    }
    if (!fits(extents)) return refuse_size(*target);
    const bool is_whole = !open.empty() && open.front().starts_with("#");
    const auto has_its_parts = [&](const Expr* value) { return has_parts(*value, extents, 0, *target); };
    if (is_whole && !std::ranges::all_of(values_of(item), has_its_parts)) return;
    for_each_value(extents, [&](const std::vector<int>& at) {
      Values values;
      for (std::size_t k = 0; k < open.size(); ++k) values[open[k]] = at[k];
      Item& one = all.emplace_back(item);
      Identifier* name = target_of(one);
      if (name != nullptr) name->name = named(name->name, values, name->range);
      if (is_whole) {
        for (Expr* value : values_of(one)) take_part(*value, at);
      }
      set_formulas(one, values);
    });
  }

  /// D = (1, 2, 3), A = ((1, 2), (3, 4)): checks that a tuple has one part for each element, recursively.
  bool has_parts(const Expr& value, const std::vector<int>& extents, std::size_t index, const Identifier& name) {
    const auto* tuple = index < extents.size() ? std::get_if<Tuple>(&value->kind) : nullptr;
    if (tuple == nullptr && (index == 0 || index == extents.size())) return true;
    const std::string expected = fmt::format("{} {}", extents[index], index + 1 < extents.size() ? "rows" : "elements");
    if (tuple == nullptr || std::ssize(tuple->elements) != extents[index]) {
      const std::string found = tuple == nullptr ? "no tuple" : std::to_string(tuple->elements.size());
      sink_.report("wrong-length", value.range(), {expected, found},
                   fmt::format("{} is {}: a tuple gives each element its own, and {} = ... with indices all the same",
                               element_of(name.name).array, text_of(element_of(name.name).array, extents),
                               element_of(name.name).array + (extents.size() == 1 ? "[i]" : "[i, j]")));
      return false;
    }
    return std::ranges::all_of(tuple->elements,
                               [&](const Expr& part) { return has_parts(part, extents, index + 1, name); });
  }

  /// Adds a declaration for each element.
  void add_declared(Item& item) {
    if (auto* param = get_if<ParamItem>(&item.kind)) {
      ParamItem all;
      for (std::size_t i = 0; i < param->names.size(); ++i) {
        std::optional<Expr>& value = param->values[i];
        const auto array = arrays_.find(element_of(param->names[i].name).array);
        const bool is_array = value && array != arrays_.end();
        if (is_array && !has_parts(*value, array->second, 0, param->names[i])) value.reset();
        for (const Identifier& name : elements_of(param->names[i], true, [&](const std::vector<int>& at) {
               all.values.push_back(value);
               all.units.push_back(param->units[i]);
               if (value) take_part(*all.values.back(), at);
             }))
          all.names.push_back(name);
      }
      *param = std::move(all);
    }
    if (auto* frames = get_if<FramesItem>(&item.kind))
      put_names(frames->of, [&](const Identifier& name) { return elements_of(name, false, [](const auto&) {}); });
    std::vector<Identifier>* list = list_of(item);
    if (list == nullptr) return;
    std::vector<UnitText>* units = units_of(item);
    const bool declares = declares_fields(item);
    std::vector<Identifier> all;
    std::vector<UnitText> all_units;
    for (std::size_t i = 0; i < list->size(); ++i) {
      const auto add_unit = [&](const auto&) {
        if (units != nullptr) all_units.push_back((*units)[i]);
      };
      std::ranges::copy(elements_of((*list)[i], declares, add_unit), std::back_inserter(all));
    }
    *list = std::move(all);
    if (units != nullptr) *units = std::move(all_units);
  }

  /// All elements of a declared or whole array; for other names the name itself.
  std::vector<Identifier> elements_of(const Identifier& name, bool declares,
                                      const std::function<void(const std::vector<int>&)>& tell) {
    const Element element = element_of(name.name);
    const auto array = arrays_.find(element.array);
    const bool is_whole = array != arrays_.end() && declares != element.indices.empty();
    std::vector<Identifier> all;
    for_each_value(is_whole ? array->second : std::vector<int>{}, [&](const std::vector<int>& at) {
      tell(at);
      all.push_back({is_whole ? named(text_of(element.array, at), {}, name.range) : named(name.name, {}, name.range),
                     name.range});
    });
    return all;
  }

  std::vector<EventItem::Update> of_event(const std::vector<EventItem::Update>& updates) {
    std::vector<EventItem::Update> all;
    for (const EventItem::Update& update : updates) {
      EventItem::Update one = update;
      const std::vector<std::string> open = open_indices(one.field);
      std::vector<int> extents;
      if (!std::ranges::all_of(open, [&](const std::string& index) { return is_free(index, one.field.range); }))
        continue;
      for (const std::string& index : open)
        extents.push_back(std::max({1, extent_in(index, one.field.name), extent_of(index, one.value)}));
      if (!fits(extents)) {
        refuse_size(update.field);
        continue;
      }
      const bool is_whole = !open.empty() && open.front().starts_with("#");
      if (is_whole && !has_parts(one.value, extents, 0, one.field)) continue;
      for_each_value(extents, [&](const std::vector<int>& at) {
        Values values;
        for (std::size_t k = 0; k < open.size(); ++k) values[open[k]] = at[k];
        Expr value = one.value;
        if (is_whole) take_part(value, at);
        all.push_back(
            {{named(one.field.name, values, one.field.range), one.field.range}, one.accumulate, with(value, values)});
      });
    }
    return all;
  }

  Arrays arrays_;
  const std::set<std::string>& taken_;
  DiagnosticSink& sink_;
  int terms_ = 0;
};

class ArrayWriter {
 public:
  ArrayWriter(File& file, DiagnosticSink& sink) : file_(file), sink_(sink) {
    for (Declaration& declaration : file.declarations) {
      if (auto* scene = std::get_if<Scene>(&declaration.kind)) scenes_.emplace(scene->name.name, scene);
    }
  }

  void write() {
    take_names();
    for (Declaration& declaration : file_.declarations) {
      auto* model = std::get_if<Model>(&declaration.kind);
      if (model != nullptr) models_[model->name.name] = write(model->items, {});
    }
    for (auto& [name, scene] : scenes_) write(*scene);
    Arrays of_all;
    for (const auto& [name, arrays] : models_) of_all.insert(arrays.begin(), arrays.end());
    for (Declaration& declaration : file_.declarations) {
      auto* task = std::get_if<Task>(&declaration.kind);
      if (task != nullptr) write(task->items, known_in(task->of.name));
      auto* chart = std::get_if<Chart>(&declaration.kind);
      if (chart != nullptr) write(chart->items, known_in(chart->of.name));
      auto* data = std::get_if<DataSet>(&declaration.kind);
      if (data != nullptr) write(data->items, known_in(data->of.name));
      auto* scheme = std::get_if<Scheme>(&declaration.kind);
      if (scheme != nullptr) scheme->items = ArrayBlock(of_all, taken_, sink_).rows_of_elements(scheme->items);
    }
  }

 private:
  /// Expands the block; returns the arrays known in it.
  Arrays write(std::vector<Item>& items, Arrays known) {
    ArrayBlock block(std::move(known), taken_, sink_);
    block.declare(items);
    items = block.written_out(std::move(items));
    return block.arrays();
  }

  /// Collects all names used in the file's blocks and the built-in ones.
  void take_names() {
    taken_ = {"t", "pi", "x", "y", "z"};
    const auto take = [&](const Identifier& name) { taken_.insert(element_of(name.name).array); };
    const auto take_all = [&](std::vector<Item>& items) {
      for (Item& item : items) {
        if (auto* param = get_if<ParamItem>(&item.kind)) std::ranges::for_each(param->names, take);
        if (ArrayBlock::declares_fields(item)) std::ranges::for_each(*list_of(item), take);
        if (auto* let = get_if<LetItem>(&item.kind)) take(let->name);
        if (auto* data = get_if<DataItem>(&item.kind)) take(data->name);
        if (auto* grid = get_if<GridItem>(&item.kind)) take(grid->axis);
      }
    };
    for (Declaration& declaration : file_.declarations) {
      if (auto* model = std::get_if<Model>(&declaration.kind)) take_all(model->items);
      if (auto* scene = std::get_if<Scene>(&declaration.kind)) take_all(scene->items);
      if (auto* task = std::get_if<Task>(&declaration.kind)) take_all(task->items);
    }
  }

  Arrays known_in(const std::string& scene) {
    const auto known = of_scenes_.find(scene);
    return known == of_scenes_.end() ? Arrays{} : known->second;
  }

  /// Expands the scenes it is derived from first, since it knows their arrays. Iterative: chains may be long.
  void write(Scene& scene) {
    std::vector<Scene*> chain;
    std::set<Scene*> open;
    for (Scene* next = &scene; !of_scenes_.contains(next->name.name) && open.insert(next).second;) {
      chain.push_back(next);
      if (!next->like || !scenes_.contains(next->like->name)) break;
      next = scenes_.at(next->like->name);
    }
    for (Scene* made : std::views::reverse(chain)) {
      const Arrays known = made->like ? known_in(made->like->name) : arrays_of_models(*made);
      of_scenes_[made->name.name] = write(made->items, known);
    }
  }

  Arrays arrays_of_models(const Scene& scene) {
    Arrays arrays = models_.contains(scene.of.name) ? models_.at(scene.of.name) : Arrays{};
    for (const Identifier& model : scene.also) {
      if (!models_.contains(model.name)) continue;
      for (const auto& [name, extents] : models_.at(model.name)) {
        const auto [known, is_new] = arrays.emplace(name, extents);
        if (!is_new && known->second != extents)
          sink_.report("bad-index", model.range, {name},
                       fmt::format("it is {} here and {} in the models before: rename one of them",
                                   text_of(name, extents), text_of(name, known->second)));
      }
    }
    return arrays;
  }

  File& file_;
  DiagnosticSink& sink_;
  std::map<std::string, Scene*> scenes_;
  std::map<std::string, Arrays> of_scenes_;
  std::map<std::string, Arrays> models_;
  std::set<std::string> taken_;
};

}  // namespace

std::optional<File> with_elements(File file, DiagnosticSink& sink) {
  const bool had_errors = sink.has_errors();
  ArrayWriter(file, sink).write();
  if (sink.has_errors() && !had_errors) return std::nullopt;
  return file;
}

}  // namespace dpde::ast
