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

/// x.low, x.high and so on, for the places x and all.
std::vector<BoundarySide> one_by_one(const BoundarySide& side, const std::vector<std::string>& axes) {
  if (side.place.name.find('.') != std::string::npos) return {side};
  std::vector<BoundarySide> sides;
  for (const std::string& axis : axes) {
    if (side.place.name != "all" && side.place.name != axis) continue;
    for (const char* end : {".low", ".high"}) sides.push_back({{axis + end, side.place.range}, side.value});
  }
  return sides;
}

std::vector<BoundarySide> one_by_one(const std::vector<BoundarySide>& sides, const std::vector<std::string>& axes) {
  std::vector<BoundarySide> all;
  for (const BoundarySide& side : sides) std::ranges::copy(one_by_one(side, axes), std::back_inserter(all));
  return all;
}

/// Items of the scene that another one is made from, and what that one changes in them.
class Changes {
 public:
  explicit Changes(std::vector<Item> items) : items_(std::move(items)) {
    for (const Item& item : items_) {
      if (const auto* grid = get_if<GridItem>(&item.kind)) axes_.push_back(grid->axis.name);
    }
  }

  void add(const std::vector<Item>& own) {
    std::set<std::string> replaced;  // by `own`: two of its items about the same are the mistake of a person
    // the cells of all axes first: an axis of `own` may have cells of its own
    for (const bool counts_cells : {true, false}) {
      for (const Item& item : own) {
        if ((get_if<CellsItem>(&item.kind) != nullptr) != counts_cells) continue;
        const std::string subject = subject_of(item);
        const bool is_first = !subject.empty() && replaced.insert(subject).second;
        if (!(is_first && replace(item, subject))) items_.push_back(item);
      }
    }
  }

  std::vector<Item> items() && { return std::move(items_); }

 private:
  /// False where nothing is there to be replaced.
  bool replace(const Item& item, const std::string& subject) {
    if (get_if<CellsItem>(&item.kind) != nullptr) return set_cells(item, subject);
    if (const auto* step = get_if<StepItem>(&item.kind)) return set_step(*step) || replace_whole(item, subject);
    if (const auto* boundary = get_if<BoundaryItem>(&item.kind)) return set_sides(*boundary, subject);
    return replace_whole(item, subject);
  }

  Item* find(const std::string& subject) {
    const auto found = std::ranges::find(items_, subject, [](const Item& item) { return subject_of(item); });
    return found == items_.end() ? nullptr : &*found;
  }

  bool replace_whole(const Item& item, const std::string& subject) {
    Item* found = find(subject);
    if (found == nullptr) return false;
    *found = item;
    // several lines `output` are one subject
    const auto is_other = [&](const Item& other) { return &other != found && subject_of(other) == subject; };
    const std::size_t place = static_cast<std::size_t>(found - items_.data());
    std::vector<Item> kept;
    for (std::size_t i = 0; i < items_.size(); ++i) {
      if (i == place || !is_other(items_[i])) kept.push_back(std::move(items_[i]));
    }
    items_ = std::move(kept);
    return true;
  }

  /// The line holds for all axes: none has cells of its own any more.
  bool set_cells(const Item& item, const std::string& subject) {
    for (Item& other : items_) {
      if (auto* grid = get_if<GridItem>(&other.kind)) grid->cells.reset();
    }
    return replace_whole(item, subject);
  }

  bool set_step(const StepItem& step) {
    Item* found = find("time");
    if (found == nullptr) return false;
    get_if<TimeItem>(&found->kind)->step = step.step;
    return true;
  }

  bool set_sides(const BoundaryItem& own, const std::string& subject) {
    Item* found = find(subject);
    if (found == nullptr) return false;
    auto& boundary = *get_if<BoundaryItem>(&found->kind);
    const std::vector<BoundarySide> changed = one_by_one(own.sides, axes_);
    std::vector<BoundarySide> sides = one_by_one(boundary.sides, axes_);
    std::erase_if(sides, [&](const BoundarySide& side) {
      return std::ranges::any_of(changed, [&](const BoundarySide& c) { return c.place.name == side.place.name; });
    });
    std::ranges::copy(own.sides, std::back_inserter(sides));
    boundary.sides = std::move(sides);
    boundary.bare = false;
    return true;
  }

  std::vector<Item> items_;
  std::vector<std::string> axes_;
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
