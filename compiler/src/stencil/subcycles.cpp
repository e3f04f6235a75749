// SPDX-License-Identifier: Apache-2.0
#include "stencil/subcycles.h"

#include <algorithm>
#include <iterator>
#include <map>
#include <utility>

#include "model/build.h"
#include "stencil/build.h"

namespace dpde::stencil {

namespace {

using Fields = std::map<std::string, std::string>;  // what stands for a state

class Subcycles {
 public:
  Subcycles(Lowering& lowering, std::string name) : lowering_(lowering), name_(std::move(name)) {}

  /// All equations that make `parts` steps, after those that make fewer.
  void add(const std::vector<Advance>& advances, int parts) {
    between_.clear();
    StepPart part{0, parts};
    for (; part.number < parts; ++part.number) {
      std::vector<Advance> now = advances;
      if (part.number + 1 < parts) {
        for (Advance& advance : now) advance.into = lowering_.field_beside(advance.state, "part");
      }
      add_part(now, part);
      for (const Advance& advance : now) part.fields[advance.state] = advance.into;
    }
    ends_.insert(part.fields.begin(), part.fields.end());
  }

  std::vector<Stage> take() { return std::move(stages_); }

 private:
  struct Between {
    Fields fields;
    Stage stage;
    bool is_used = false;
  };

  void add_part(const std::vector<Advance>& advances, StepPart& part) {
    const std::string& scene = lowering_.problem().scene;
    const std::string own =
        without_dots(scene + "_" + advances.front().state + "_part" + std::to_string(part.number + 1));
    part.others.clear();
    for (const double fraction : {0.0, 0.5, 1.0}) part.others[fraction] = others_at(part.time(fraction), advances);
    const std::vector<Stage> stages = part.of == 1 ? time_stages(lowering_, advances, name_, scene, part)
                                                   : time_stages(lowering_, advances, own, own, part);
    for (const double fraction : {0.0, 0.5, 1.0}) use_between(part.time(fraction), stages);
    stages_.insert(stages_.end(), stages.begin(), stages.end());
  }

  /// What stands for the states that are done when `time` of the step is over.
  Fields others_at(double time, const std::vector<Advance>& readers) {
    if (time == 0) return {};
    if (time == 1) return ends_;
    const auto found = between_.find(time);
    return found == between_.end() ? make_between(time, readers) : found->second.fields;
  }

  Fields make_between(double time, const std::vector<Advance>& readers) {
    Fields fields;
    Kernel kernel = lowering_.kernel("");
    for (const model::State& state : lowering_.problem().states) {
      const auto end = ends_.find(state.name);
      const auto reads_it = [&](const Advance& advance) { return model::reads(advance.rate, state.name); };
      if (end == ends_.end() || std::none_of(readers.begin(), readers.end(), reads_it)) continue;
      const std::string field = lowering_.field_beside(state.name, "between");
      kernel.stores.push_back({field, false, (1 - time) * access(state.name) + time * access(end->second), {}});
      fields[state.name] = field;
    }
    if (!fields.empty())
      between_.emplace(time, Between{fields, {std::move(kernel), param("t") + time * param("dt"), {}}});
    return fields;
  }

  /// Schemes do not look at all of these times.
  void use_between(double time, const std::vector<Stage>& readers) {
    const auto found = between_.find(time);
    if (found == between_.end() || found->second.is_used) return;
    Between& between = found->second;
    between.is_used = std::any_of(readers.begin(), readers.end(), [&](const Stage& stage) {
      const std::vector<Signature::Read> reads = reads_of(stage);
      const auto is_between = [&](const Signature::Read& read) {
        return std::any_of(between.fields.begin(), between.fields.end(),
                           [&](const auto& entry) { return entry.second == read.field; });
      };
      return std::any_of(reads.begin(), reads.end(), is_between);
    });
    if (!between.is_used) return;
    between.stage.kernel.name = lowering_.problem().scene + "_between" + std::to_string(++between_count_);
    stages_.push_back(between.stage);
  }

  Lowering& lowering_;
  std::string name_;
  std::vector<Stage> stages_;
  Fields ends_;                        // of the states that are done
  std::map<double, Between> between_;  // of the equations that are added, by the time in steps
  int between_count_ = 0;
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
