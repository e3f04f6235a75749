// SPDX-License-Identifier: Apache-2.0
#include "syntax/whole_scenes.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>

#include "support/match.h"
#include "syntax/item_kinds.h"

namespace dpde::ast {

namespace {

/// What an item of a scene is about: two that are about the same cannot both hold. "" where any number may stand.
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

/// x.low, x.high and so on, for the places x and all, which means no periodic axis.
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

/// Items of the scene that another one is made from, and what that one changes in them.
class Changes {
 public:
  explicit Changes(std::vector<Item> items) : items_(std::move(items)) {}

  /// Sides last, as they are those of the axes; the cells of all axes first: an axis of `own` may have cells of its
  /// own.
  void add(const std::vector<Item>& own) {
    for (const auto& stage : {&Changes::is_cells, &Changes::is_other}) {
      for (const Item& item : own) {
        if (stage(item)) change(item);
      }
    }
    add_sides(own);
  }

  std::vector<Item> items() && { return std::move(items_); }

 private:
  static bool is_cells(const Item& item) { return get_if<CellsItem>(&item.kind) != nullptr; }
  static bool is_sides(const Item& item) { return get_if<BoundaryItem>(&item.kind) != nullptr; }
  static bool is_other(const Item& item) { return !is_cells(item) && !is_sides(item); }

  /// Two items of a scene about the same are the mistake of a person: the second is added.
  void change(const Item& item) {
    const std::string subject = subject_of(item);
    const bool is_first = !subject.empty() && changed_.insert(subject).second;
    if (!(is_first && replace(item, subject))) items_.push_back(item);
  }

  /// False where nothing is there to be replaced.
  bool replace(const Item& item, const std::string& subject) {
    if (is_cells(item)) drop_cells_of_axes();
    if (const auto* step = get_if<StepItem>(&item.kind)) return set_step(*step) || replace_whole(item, subject);
    return replace_whole(item, subject);
  }

  bool is_about(const Item& item, const std::string& subject) const { return subject_of(item) == subject; }

  /// In the place of the first about it; several lines `output` are one subject.
  bool replace_whole(const Item& item, const std::string& subject) {
    const auto found = std::ranges::find_if(items_, [&](const Item& other) { return is_about(other, subject); });
    if (found == items_.end()) return false;
    *found = item;
    const auto is_old = [&](const Item& other) { return is_about(other, subject); };
    items_.erase(std::remove_if(found + 1, items_.end(), is_old), items_.end());
    return true;
  }

  void drop_cells_of_axes() {
    for (Item& other : items_) {
      if (auto* grid = get_if<GridItem>(&other.kind)) grid->cells.reset();
    }
  }

  bool set_step(const StepItem& step) {
    for (Item& item : items_) {
      auto* time = get_if<TimeItem>(&item.kind);
      if (time == nullptr) continue;
      time->step = step.step;
      return true;
    }
    return false;
  }

  /// Sides that `own` gives a field leave its old lines.
  void add_sides(const std::vector<Item>& own) {
    std::vector<AxisOfScene> axes;
    for (const Item& item : items_) {
      if (const auto* grid = get_if<GridItem>(&item.kind)) axes.push_back({grid->axis.name, grid->periodic});
    }
    std::map<std::string, std::set<std::string>> given;  // places, by the field
    for (const Item& item : own) {
      const auto* boundary = get_if<BoundaryItem>(&item.kind);
      if (boundary == nullptr) continue;
      for (const BoundarySide& side : one_by_one(boundary->sides, axes))
        given[boundary->field.name].insert(side.place.name);
    }
    std::erase_if(items_, [&](Item& item) {
      auto* boundary = get_if<BoundaryItem>(&item.kind);
      if (boundary == nullptr || !given.contains(boundary->field.name)) return false;
      boundary->sides = one_by_one(boundary->sides, axes);
      boundary->bare = false;
      std::erase_if(boundary->sides,
                    [&](const BoundarySide& side) { return given.at(boundary->field.name).contains(side.place.name); });
      return boundary->sides.empty();
    });
    std::ranges::copy_if(own, std::back_inserter(items_), is_sides);
  }

  std::vector<Item> items_;
  std::set<std::string> changed_;
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
  /// False after a diagnostic.
  bool write(Scene& scene) {
    if (!scene.like) return true;
    const Identifier from = *scene.like;
    if (refused_.contains(&scene)) return false;
    if (!open_.insert(&scene).second) {
      sink_.report("scene-of-itself", from.range, {from.name}, "a scene is made from one that is written out");
      return refuse(scene);
    }
    const auto found = scenes_.find(from.name);
    if (found == scenes_.end()) return refuse_unknown(scene);
    if (!write(*found->second)) return refuse(scene);
    const Scene& other = *found->second;
    Changes changes(other.items);
    changes.add(scene.items);
    scene.items = std::move(changes).items();
    scene.of = other.of;
    scene.also = other.also;
    if (!scene.scheme) scene.scheme = other.scheme;
    scene.like.reset();
    return true;
  }

  bool refuse(const Scene& scene) {
    refused_.insert(&scene);
    return false;
  }

  bool refuse_unknown(const Scene& scene) {
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
    return refuse(scene);
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
