// SPDX-License-Identifier: Apache-2.0
#include "syntax/expand/whole_scenes.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <ranges>
#include <set>
#include <utility>

#include "support/match.h"
#include "syntax/expand/vector_parts.h"
#include "syntax/item_kinds.h"

namespace dpde::ast {

namespace {

/// Subject of an item of a scene: two items with the same subject exclude one another. "" if any number is allowed.
std::string subject_of(const Item& item) {
  return match(
      item.kind, [](const GridItem& i) { return "grid " + i.axis.name; },
      [](const CellsItem&) { return std::string("cells"); },
      [](const CoordinatesItem&) { return std::string("coordinates"); },
      [](const ValueItem& i) { return "value " + i.name.name; },
      [](const LetItem& i) { return "value " + i.name.name; },
      [](const InitialItem& i) { return "initial " + i.field.name; },
      [](const ExactItem& i) { return "exact " + i.field.name; },
      [](const BoundaryItem& i) { return "boundary " + i.field.name; },
      [](const TimeItem&) { return std::string("time"); }, [](const StepItem&) { return std::string("step"); },
      [](const ObserveItem& i) { return "observe " + i.name.name; },
      [](const OutputItem&) { return std::string("output"); },
      [](const AccuracyItem&) { return std::string("accuracy"); }, [](const EventItem&) { return std::string(); },
      [](const SubcycleItem& i) { return "subcycle " + i.fields.front().name; },
      [](const OutsideScenes auto&) { return std::string(); });
}

struct AxisOfScene {
  std::string name;
  bool periodic;
};

/// Expands the places x and all to x.low, x.high and so on; all excludes periodic axes.
std::vector<BoundarySide> one_by_one(const std::vector<BoundarySide>& written, const std::vector<AxisOfScene>& axes) {
  std::vector<BoundarySide> sides;
  for (const BoundarySide& side : written) {
    const std::string& place = side.place.name;
    const bool is_one = place != "all" && std::ranges::find(axes, place, &AxisOfScene::name) == axes.end();
    if (is_one) sides.push_back(side);
    for (const AxisOfScene& axis : axes) {
      if (place != axis.name && !(place == "all" && !axis.periodic)) continue;
      for (const char* end : {".low", ".high"}) sides.push_back({{axis.name + end, side.place.range}, side.value});
    }
  }
  return sides;
}

/// The axes x, y, z or r, theta or lon, lat, in this order, however the scene lists them.
std::vector<std::string> names_of_axes(const std::vector<Item>& items) {
  static constexpr std::string_view first_names[] = {"x", "r", "lon"}, last_name = "z";
  std::vector<std::string> names;
  for (const Item& item : items) {
    if (const auto* grid = get_if<GridItem>(&item.kind)) names.push_back(grid->axis.name);
  }
  std::ranges::stable_sort(names, {}, [](const std::string& name) {
    return std::ranges::find(first_names, name) != std::end(first_names) ? 0 : name == last_name ? 2 : 1;
  });
  return names;
}

/// Items of the base scene with the changes of a derived scene.
class Changes {
 public:
  explicit Changes(std::vector<Item> items) : items_(std::move(items)) {
    for (Item& item : items_) {
      if (auto* cells = get_if<CellsItem>(&item.kind)) cells->is_of_other = true;
    }
  }

  /// Applies cells of all axes first, then axes (an axis of `own` may have its own cells), then the rest, since
  /// components of vectors depend on the axes.
  void add(std::vector<Item> own) {
    drop_exact(own);
    for (const auto& stage : {&is<CellsItem>, &is<GridItem>, &is<TimeItem>, &Changes::is_other}) {
      for (Item& item : own) {
        if (stage(item)) change(item);
      }
    }
    add_sides(own);
  }

  std::vector<Item> items() && { return std::move(items_); }
  /// Exact solutions that no longer hold: "exact u".
  std::vector<std::string> left_out() const { return left_out_; }

 private:
  template <class Kind>
  static bool is(const Item& item) {
    return get_if<Kind>(&item.kind) != nullptr;
  }
  static bool is_other(const Item& item) {
    return !is<CellsItem>(item) && !is<GridItem>(item) && !is<TimeItem>(item) && !is<BoundaryItem>(item);
  }

  /// Drops exact solutions if the initial state changes; the derived scene may give new ones.
  void drop_exact(const std::vector<Item>& own) {
    if (std::ranges::none_of(own, &is<InitialItem>)) return;
    std::erase_if(items_, [&](const Item& item) {
      if (is<ExactItem>(item)) left_out_.push_back(subject_of(item));
      return is<ExactItem>(item);
    });
    std::erase_if(left_out_,
                  [&](const std::string& subject) { return std::ranges::find(own, subject, subject_of) != own.end(); });
  }

  /// A second item of `own` about the same subject is a user error: it is added, so that it is reported later.
  void change(Item& item) {
    const std::string subject = subject_of(item);
    meet_parts(item, subject);
    const bool is_first = !subject.empty() && changed_.insert(subject).second;
    if (!(is_first && replace(item, subject))) items_.push_back(item);
  }

  /// Handles the case that one scene sets a vector and the other a component.
  void meet_parts(Item& item, const std::string& subject) {
    const Identifier* name = given_by(item).name;
    if (name == nullptr) return;
    const auto whole_subject = [](Item other) {
      const Given given = given_by(other);
      if (given.name == nullptr) return std::string();
      given.name->name = whole_of(given.name->name);
      return given.name->name.empty() ? std::string() : subject_of(other);
    };
    std::erase_if(items_, [&](const Item& other) {  // the whole vector replaces its components
      return whole_subject(other) == subject && !changed_.contains(subject_of(other));
    });
    const std::string whole = whole_subject(item);
    if (!whole.empty() && !changed_.contains(whole)) split(whole);
  }

  /// Splits lines about the vector `subject` into lines about its components.
  void split(const std::string& subject) {
    const std::vector<std::string> axes = names_of_axes(items_);
    std::vector<Item> items;
    for (const Item& item : items_) {
      if (subject_of(item) != subject) items.push_back(item);
      if (subject_of(item) == subject) std::ranges::move(parts_of(item, axes), std::back_inserter(items));
    }
    items_ = std::move(items);
  }

  /// Returns false if there is nothing to replace.
  bool replace(const Item& item, const std::string& subject) {
    if (is<CellsItem>(item)) drop_cells_of_axes();
    if (const auto* time = get_if<TimeItem>(&item.kind); time != nullptr && time->step)
      std::erase_if(items_, &is<StepItem>);
    if (const auto* step = get_if<StepItem>(&item.kind)) return set_step(*step) || replace_whole(item, subject);
    return replace_whole(item, subject);
  }

  /// Replaces the first item of the subject and removes others; all lines `output` are one subject.
  bool replace_whole(const Item& item, const std::string& subject) {
    const auto is_about = [&](const Item& other) { return subject_of(other) == subject; };
    const auto found = std::ranges::find_if(items_, is_about);
    if (found == items_.end()) return false;
    const Item before = std::exchange(*found, item);
    keep_unit<GridItem>(*found, before);
    keep_unit<TimeItem>(*found, before);
    keep_unit<ValueItem>(*found, before);
    items_.erase(std::remove_if(found + 1, items_.end(), is_about), items_.end());
    return true;
  }

  /// Keeps the unit of the base scene's line if the new line has none.
  template <class Kind>
  static void keep_unit(Item& item, const Item& before) {
    auto* now = get_if<Kind>(&item.kind);
    const auto* other = get_if<Kind>(&before.kind);
    if (now != nullptr && other != nullptr && !now->unit) now->unit = other->unit;
  }

  void drop_cells_of_axes() {
    for (Item& other : items_) {
      if (auto* grid = get_if<GridItem>(&other.kind)) grid->cells.reset();
    }
  }

  /// Sets the step in the base scene's time line. Returns false if the step is not set there.
  bool set_step(const StepItem& step) {
    if (changed_.contains("time")) return false;
    for (Item& item : items_) {
      auto* time = get_if<TimeItem>(&item.kind);
      if (time == nullptr || !time->step) continue;
      time->step = step.step;
      return true;
    }
    return false;
  }

  /// Removes the sides that `own` sets from the base scene's lines.
  void add_sides(std::vector<Item>& own) {
    std::vector<AxisOfScene> axes;
    for (const Item& item : items_) {
      if (const auto* grid = get_if<GridItem>(&item.kind)) axes.push_back({grid->axis.name, grid->periodic});
    }
    std::map<std::string, std::set<std::string>> given;  // by field
    for (Item& item : own) {
      const auto* boundary = get_if<BoundaryItem>(&item.kind);
      if (boundary == nullptr) continue;
      const std::string& field = boundary->field.name;
      for (const BoundarySide& side : one_by_one(boundary->sides, axes)) given[field].insert(side.place.name);
      if (!whole_of(field).empty()) split("boundary " + whole_of(field));
    }
    std::erase_if(items_, [&](Item& item) {
      auto* boundary = get_if<BoundaryItem>(&item.kind);
      if (boundary == nullptr) return false;
      std::set<std::string> places;
      for (const std::string& field : {boundary->field.name, whole_of(boundary->field.name)}) {
        if (given.contains(field)) places.insert(given.at(field).begin(), given.at(field).end());
      }
      if (places.empty()) return false;
      boundary->sides = one_by_one(boundary->sides, axes);
      boundary->bare = false;
      std::erase_if(boundary->sides, [&](const BoundarySide& side) { return places.contains(side.place.name); });
      return boundary->sides.empty();
    });
    std::ranges::copy_if(own, std::back_inserter(items_), &is<BoundaryItem>);
  }

  std::vector<Item> items_;
  std::set<std::string> changed_;
  std::vector<std::string> left_out_;
};

class Writer {
 public:
  Writer(File& file, DiagnosticSink& sink) : sink_(sink) {
    for (Declaration& declaration : file.declarations) {
      if (auto* scene = std::get_if<Scene>(&declaration.kind)) scenes_.emplace(scene->name.name, scene);
      if (const auto* model = std::get_if<Model>(&declaration.kind)) models_.insert(model->name.name);
    }
  }

  bool write_all() {
    for (auto& [name, scene] : scenes_) write(*scene);
    return refused_.empty();
  }

 private:
  /// Expands the scenes it is derived from first. Returns false after a diagnostic.
  bool write(Scene& scene) {
    std::vector<Scene*> chain;
    for (Scene* next = &scene; next->like; next = scenes_.at(next->like->name)) {
      if (refused_.contains(next)) return refuse_all(chain);
      chain.push_back(next);
      if (!open_.insert(next).second) {
        const Identifier& from = *next->like;
        sink_.report("scene-of-itself", from.range, {from.name}, "a scene is made from one that is written out");
        return refuse_all(chain);
      }
      if (!scenes_.contains(next->like->name)) {
        report_unknown(*next);
        return refuse_all(chain);
      }
    }
    for (Scene* made : std::views::reverse(chain)) make(*made, *scenes_.at(made->like->name));
    return true;
  }

  static void make(Scene& scene, const Scene& other) {
    Changes changes(other.items);
    changes.add(scene.items);
    scene.left_out = other.left_out;
    for (const std::string& subject : changes.left_out())
      scene.left_out.push_back(
          fmt::format("{} of scene {}: it starts from another state there", subject, other.name.name));
    scene.items = std::move(changes).items();
    scene.of = other.of;
    scene.also = other.also;
    if (!scene.scheme) scene.scheme = other.scheme;
    scene.like.reset();
  }

  bool refuse_all(const std::vector<Scene*>& scenes) {
    refused_.insert(scenes.begin(), scenes.end());
    return false;
  }

  void report_unknown(const Scene& scene) {
    const Identifier& from = *scene.like;
    std::vector<std::string> names;
    for (const auto& [name, known] : scenes_) {
      if (known != &scene) names.push_back(name);
    }
    const std::string near = nearest_name(from.name, names);
    const std::string hint = models_.contains(from.name)
                                 ? fmt::format("{1} is a model: scene {0} : {1} {{", scene.name.name, from.name)
                             : near.empty() ? "write scene NAME : MODEL {"
                                            : fmt::format("did you mean {}?", near);
    sink_.report("unknown-block", from.range, {"scene", from.name}, hint);
  }

  std::map<std::string, Scene*> scenes_;
  std::set<std::string> models_;
  std::set<const Scene*> open_, refused_;
  DiagnosticSink& sink_;
};

}  // namespace

std::optional<File> with_whole_scenes(File file, DiagnosticSink& sink) {
  if (!Writer(file, sink).write_all()) return std::nullopt;
  return file;
}

}  // namespace dpde::ast
