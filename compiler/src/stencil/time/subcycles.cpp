// SPDX-License-Identifier: Apache-2.0
#include "stencil/time/subcycles.h"

#include <algorithm>
#include <iterator>
#include <map>
#include <utility>

#include "model/build.h"
#include "stencil/build.h"

namespace dpde::stencil {

namespace {

using Fields = std::map<std::string, std::string>;  // the field that replaces each state

class Subcycles {
 public:
  Subcycles(Lowering& lowering, std::string name) : lowering_(lowering), name_(std::move(name)) {}

  /// Adds the equations with `parts` substeps; those with fewer come before.
  void add(const std::vector<Advance>& advances, int parts) {
    std::vector<Stage> stages = parts == 1 ? time_stages(lowering_, advances, name_, lowering_.problem().scene)
                                           : stages_of_parts(advances, parts);
    std::ranges::move(stages, std::back_inserter(stages_));
    for (const Advance& advance : advances) ends_[advance.state] = advance.into;
  }

  std::vector<Stage> take() { return std::move(stages_); }

 private:
  std::vector<Stage> stages_of_parts(std::vector<Advance> advances, int parts) {
    StepPart part{parts, lowering_.fresh_field("part")};
    StageBlock block{parts, part.counter, {}, part.time_at(1)};
    for (Advance& advance : advances) {
      const std::string next = lowering_.field_beside(advance.state, "part");
      block.carries.push_back({advance.state, next, std::exchange(advance.into, next)});
    }
    Kernel between = lowering_.kernel(lowering_.problem().scene + "_between");
    for (const double fraction : stage_times(lowering_.problem().scheme.time))
      part.others[fraction] = between_at(part.time(fraction), advances, between);
    const std::string own = without_dots(lowering_.problem().scene + "_" + advances.front().state + "_part");
    std::vector<Stage> stages = time_stages(lowering_, advances, own, own, part);
    std::erase_if(between.stores, [&](const Store& store) { return !is_read(store.field, stages); });
    if (!between.stores.empty()) stages.insert(stages.begin(), {std::move(between), part.time_at(0), {}});
    const auto shared = std::make_shared<const StageBlock>(std::move(block));
    for (Stage& stage : stages) stage.block = shared;
    return stages;
  }

  /// Fields for the finished states after the fraction `time` of the step; adds their interpolation to `between`.
  Fields between_at(const Expr& time, const std::vector<Advance>& readers, Kernel& between) {
    Fields fields;
    for (const model::State& state : lowering_.problem().states) {
      const auto end = ends_.find(state.name);
      const auto reads_it = [&](const Advance& advance) { return model::reads(advance.rate, state.name); };
      if (end == ends_.end() || std::none_of(readers.begin(), readers.end(), reads_it)) continue;
      const std::string field = fields[state.name] = lowering_.field_beside(state.name, "between");
      between.stores.push_back({field, false, (1.0 - time) * access(state.name) + time * access(end->second), {}});
    }
    return fields;
  }

  /// Whether the stages read `field`: a scheme need not read the states at all of its times.
  static bool is_read(const std::string& field, const std::vector<Stage>& stages) {
    return std::ranges::any_of(stages, [&](const Stage& stage) {
      return std::ranges::any_of(reads_of(stage), [&](const Signature::Read& read) { return read.field == field; });
    });
  }

  Lowering& lowering_;
  std::string name_;
  std::vector<Stage> stages_;
  Fields ends_;  // values of the finished states at the end of the step
};

}  // namespace

std::vector<Stage> subcycled_stages(Lowering& lowering, const std::vector<Advance>& advances, const std::string& name) {
  std::map<int, std::vector<Advance>> groups;
  for (const Advance& advance : advances)
    groups[lowering.problem().find_state(advance.state)->parts].push_back(advance);
  Subcycles subcycles(lowering, name);
  for (const auto& [parts, group] : groups) subcycles.add(group, parts);
  return subcycles.take();
}

}  // namespace dpde::stencil
