// SPDX-License-Identifier: Apache-2.0
#include "ranks/divided_task.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <mutex>

#include "dpde/runtime/layout.h"
#include "dpde/runtime/thread_ranks.h"

namespace dpde::testing {

namespace {

using Values = std::vector<double>;

/// f(place in an array of the whole grid) for each cell of the layout, x fastest.
template <class F>
void for_each_cell(const dpde_layout& layout, const F& f) {
  for (int64_t z = 0; z < layout.cells[2]; ++z) {
    for (int64_t y = 0; y < layout.cells[1]; ++y) {
      for (int64_t x = 0; x < layout.cells[0]; ++x) {
        const int64_t row = (z + layout.first[2]) * layout.global[1] + y + layout.first[1];
        f(static_cast<std::size_t>(row * layout.global[0] + x + layout.first[0]));
      }
    }
  }
}

/// Of one or several states, one after the other.
Values subgrid_of(const dpde_layout& layout, std::span<const double> whole) {
  const auto cells = static_cast<std::size_t>(global_cell_count(layout));
  Values own;
  for (std::size_t state = 0; state < whole.size() / cells; ++state)
    for_each_cell(layout, [&](std::size_t place) { own.push_back(whole[state * cells + place]); });
  return own;
}

void put(const dpde_layout& layout, std::span<const double> own, Values& whole) {
  const auto cells = static_cast<std::size_t>(global_cell_count(layout)),
             states = own.size() / static_cast<std::size_t>(cell_count(layout));
  whole.resize(states * cells);
  std::size_t next = 0;
  for (std::size_t state = 0; state < states; ++state)
    for_each_cell(layout, [&](std::size_t place) { whole[state * cells + place] = own[next++]; });
}

std::string text_of(const Ranks& ranks) { return fmt::format("{} x {} x {} ranks", ranks[0], ranks[1], ranks[2]); }

void expect_near(const std::map<std::string, Values>& found, const std::map<std::string, Values>& expected,
                 double tolerance, const std::string& what) {
  ASSERT_EQ(found.size(), expected.size());
  for (const auto& [name, values] : expected) {
    const Values& own = found.at(name);
    ASSERT_EQ(own.size(), values.size()) << name;
    double scale = 0;
    for (const double value : values) scale = std::max(scale, std::abs(value));
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (tolerance == 0 ? own[i] == values[i] : std::abs(own[i] - values[i]) <= tolerance * scale) continue;
      ADD_FAILURE() << what << ", " << name << "[" << i << "]: " << fmt::format("{} and {}", own[i], values[i]);
      break;
    }
  }
}

}  // namespace

DividedTask::DividedTask(const std::string& text, const std::string& task, OpenWith with)
    : opened_(text, task, [&] {
        with.adjoint = true;
        return with;
      }()) {
  if (opened_.session) inverse_ = opened_.inverse();
}
DividedTask::~DividedTask() = default;

/// Data and fields without formulas, as the session has them.
void DividedTask::load(Engine& engine) {
  Engine& from = opened_.session->engine();
  for (const auto& [name, given] : from.given()) {
    if (!given.is_given) continue;
    std::vector<int> at;
    for (const driver::DataStates& states : opened_.session->data()) {
      if (states.name != name) continue;
      for (const double t : states.times)
        at.push_back(static_cast<int>(std::lround((t - scene().t_begin) / scene().step)));
    }
    Values values;
    for (std::size_t k = 0; k < given.states; ++k) {
      Values whole(from.workspace().cell_count());
      from.workspace().field(name, k).copy_out(whole);
      std::ranges::copy(subgrid_of(engine.workspace().layout(), whole), std::back_inserter(values));
    }
    if (given.is_datum) engine.take_datum(name, at);
    engine.set_field(name, values);
  }
}

void DividedTask::set_start(Engine& engine) {
  const std::span<const double> start(inverse_->start().data(), static_cast<std::size_t>(inverse_->size()));
  Values x;
  for (const driver::Inverse::Part& part : inverse_->parts()) {
    const auto of_part = start.subspan(static_cast<std::size_t>(part.offset), static_cast<std::size_t>(part.size));
    std::ranges::copy(
        part.is_field() ? subgrid_of(engine.workspace().layout(), of_part) : Values(of_part.begin(), of_part.end()),
        std::back_inserter(x));
  }
  engine.set_unknowns(x);
}

void DividedTask::run(Engine& engine, TaskOutcome& own, TaskOutcome& all) {
  static std::mutex mutex;
  const dpde_layout& layout = engine.workspace().layout();
  load(engine);
  set_start(engine);
  own.numbers["loss"] = {engine.loss()};
  const auto take = [&](const std::string& of, const Values& values) {
    for (const Engine::Unknown& unknown : engine.unknowns()) {
      const auto part = unknown.part_of(std::span(values));
      if (!unknown.is_field()) own.numbers[of + unknown.name] = Values(part.begin(), part.end());
      const std::scoped_lock lock(mutex);
      if (unknown.is_field()) put(layout, part, all.fields[of + unknown.name]);
    }
  };
  Values values(engine.unknown_count());
  own.numbers["loss"].push_back(engine.gradient(values));
  take("d ", values);
  if (engine.why_no_products(Curvature::full).empty()) {
    engine.product(Values(values.size(), 1.0), values, Curvature::full);
    take("d2 ", values);
  }
  Rollout& rollout = engine.primary();
  engine.begin(rollout);
  const RunResult done = rollout.run();
  own.numbers["parts"] = {static_cast<double>(done.parts)};
  Workspace::Bound bound;
  for (std::size_t s = 0; s < engine.states().size(); ++s) {
    const std::string& name = engine.states()[s].name;
    bound[name] = rollout.final_states()[s];
    Values state(engine.workspace().cell_count());
    copy_out(layout, rollout.final_states()[s], state);
    const std::scoped_lock lock(mutex);
    put(layout, state, all.fields[name]);
  }
  if (scene().observe == nullptr) return;
  for (const auto& [name, value] : engine.workspace().run(*scene().observe, scene().t_begin, bound))
    own.numbers[name] = {value};
}

TaskOutcome DividedTask::run(const Ranks& ranks, const EngineOptions& options) {
  TaskOutcome all;
  if (!inverse_) return all;
  if (ranks == Ranks{1, 1, 1}) {
    Engine engine(scene(), options, nullptr);
    run(engine, all, all);
    return all;
  }
  std::vector<TaskOutcome> own(static_cast<std::size_t>(ranks[0] * ranks[1] * ranks[2]));
  run_ranks(ranks, [&](Communicator& rank) {
    EngineOptions of_rank = options;
    of_rank.ranks = &rank;
    Engine engine(scene(), of_rank, nullptr);
    const auto [x, y, z] = rank.place();
    run(engine, own[static_cast<std::size_t>((z * ranks[1] + y) * ranks[0] + x)], all);
  });
  all.numbers = own.front().numbers;
  for (const TaskOutcome& of_rank : own) all.ranks_agree = all.ranks_agree && of_rank.numbers == all.numbers;
  return all;
}

std::string DividedTask::error(const Ranks& ranks, const EngineOptions& options) {
  try {
    run(ranks, options);
  } catch (const std::exception& error) {
    return error.what();
  }
  return "";
}

void expect_same(DividedTask& task, const std::vector<Ranks>& divisions, double rounding, double of_fields,
                 const EngineOptions& options) {
  const TaskOutcome whole = task.run({1, 1, 1}, options);
  if (whole.fields.empty()) return;  // it is not compiled
  for (const Ranks& ranks : divisions) {
    const TaskOutcome divided = task.run(ranks, options);
    EXPECT_TRUE(divided.ranks_agree) << text_of(ranks);
    expect_near(divided.fields, whole.fields, of_fields, text_of(ranks));
    expect_near(divided.numbers, whole.numbers, rounding, text_of(ranks));
    EXPECT_EQ(divided.numbers.at("parts"), whole.numbers.at("parts")) << text_of(ranks);
  }
}

}  // namespace dpde::testing
