// SPDX-License-Identifier: Apache-2.0
// Steps that overwrite the state in place are bit-identical to steps with separate memory, whatever else reads states:
// observers, single-stepped runs, runs until steady, blow-up checks, substeps, losses along the way, checkpoints,
// threads, temporal blocking.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <list>

#include "driver/scene/session.h"
#include "driver_support.h"
#include "support/setting.h"

namespace dpde::driver {
namespace {

using testing::grid;

struct OverwriteCase {
  std::string name, text;
};

std::string task_over(const std::string& model, const std::string& scheme, const std::string& scene,
                      const std::string& losses = "minimise mean(u^2) at t = 0.004, 0.01\n",
                      const std::string& parts = "") {
  return model + "\nscheme s { " + scheme + " }\nscene go : m with s {\n" + scene +
         "q = 1 + x\ninitial u = 0\ntime 0 .. 0.017, step 1e-3" + parts + "\n}\ntask t : go {\n" +
         "unknown initial u from 0\nunknown q from 1 + x\n" + losses +
         "using gradient_descent(rate = 1), iterations 1\n}\n";
}

std::vector<OverwriteCase> overwrite_cases() {
  const std::string wave = "model m { field u; coefficient q; dt(dt(u)) = q*lap(u) }",
                    heard = "minimise mean(u*dt(u) + u^2) at t = 0.004, 0.017\n", at_rest = "initial dt(u) = 0\n",
                    local = "model m { field u, w; coefficient q; dt(u) = q*u - u*w; dt(w) = u*w - q*w }";
  return {
      {"leapfrog", task_over(wave, "time = leapfrog", grid("x", 21) + grid("y", 19) + at_rest)},
      {"wide",
       task_over(wave, "time = leapfrog; lap = central(4)", grid("x", 21) + grid("y", 8) + grid("z", 9) + at_rest)},
      {"walls",
       task_over(wave, "time = leapfrog", grid("x", 21) + grid("y", 19, false) + at_rest + "boundary u: y = 0\n")},
      {"verlet", task_over(wave, "time = verlet", grid("x", 21) + grid("y", 19) + at_rest)},
      {"the velocity is heard", task_over(wave, "time = verlet", grid("x", 21) + grid("y", 19) + at_rest, heard)},
      {"one axis", task_over(wave, "time = verlet", grid("x", 300) + at_rest, heard)},
      {"no neighbours", task_over(local, "time = euler", grid("x", 21) + grid("y", 19) + "initial w = 1\n")},
      {"under a tolerance", task_over(local, "time = bs32", grid("x", 21) + grid("y", 19) + "initial w = 1\n",
                                      "minimise mean(u^2) at t = 0.004, 0.01\n", ", tolerance 1e-7")},
      {"no neighbours, rk2", task_over(local, "time = rk2", grid("x", 21) + grid("y", 19) + "initial w = 1\n")},
  };
}

/// A program whose swaps all need two buffers.
class Apart {
 public:
  explicit Apart(const dpde_program* program) {
    if (program == nullptr) return;
    program_ = *program;
    swaps_.assign(program->swaps, program->swaps + program->swap_count);
    for (dpde_swap& swap : swaps_) swap.is_over = 0;
    program_.swaps = swaps_.data();
  }
  const dpde_program* get() const { return program_.name == nullptr ? nullptr : &program_; }

 private:
  dpde_program program_{};
  std::vector<dpde_swap> swaps_;
};

struct Asked {
  std::string name;
  std::function<void(RolloutSetup&)> set = [](RolloutSetup&) {};
};

std::vector<Asked> all_asked() {
  return {
      {"as it is"},
      {"two threads", [](RolloutSetup& setup) { setup.team = 2; }},
      {"one state stored", [](RolloutSetup& setup) { setup.slots = 1; }},
      {"three states stored", [](RolloutSetup& setup) { setup.slots = 3; }},
      {"two steps at once", [](RolloutSetup& setup) { setup.block_steps = 2; }},
      {"until steady", [](RolloutSetup& setup) { setup.steady = 1e-9; }},
      {"it blows up", [](RolloutSetup& setup) { setup.dt = 1e60; }},
  };
}

/// Records everything that a rollout reports.
class Told {
 public:
  Told(Session& session, const RolloutSetup& setup) : setup_(setup), rollout_(setup) {
    session.engine().begin_other(rollout_);
    for (int s = 0; s < rollout_.state_count(); ++s) {
      std::vector<double> values(static_cast<size_t>(cell_count(setup.layout)));
      for (size_t i = 0; i < values.size(); ++i) values[i] = std::sin(1.0 + 13 * static_cast<double>(i) + s);
      rollout_.initial(s).copy_in(values);
    }
  }

  std::vector<double> all() {
    if (setup_.steady > 0) {
      run();
      by_hand(true);
      return std::move(told_);
    }
    for (int turn = 0; turn < 2; ++turn) {  // in each other's memory
      run();
      add_loss();
      if (setup_.adjoint != nullptr) add_gradient();
      by_hand(false);
    }
    return std::move(told_);
  }

 private:
  void add(FieldView view) {
    const size_t before = told_.size(), cells = static_cast<size_t>(cell_count(setup_.layout));
    told_.resize(before + cells);
    copy_out(view, std::span(told_).subspan(before, cells));
  }
  void add(const std::vector<void*>& states) {
    for (void* const base : states) add(FieldView{&setup_.layout, base});
  }
  void run() {
    const RunResult result = rollout_.run({3, [&](const Snapshot& seen) { add(seen.states); }});
    add(rollout_.final_states());
    told_.push_back(result.steps_done);
    if (result.blow_up) told_.insert(told_.end(), {double(result.blow_up->step), double(result.blow_up->cell.x)});
    if (result.steady) told_.insert(told_.end(), {double(result.steady->step), result.steady->change});
  }
  void add_loss() { told_.push_back(rollout_.loss()); }
  void add_gradient() {
    const GradientResult& result = rollout_.gradient();
    told_.push_back(result.loss);
    for (const std::vector<FieldView>* views : {&result.state_bars, &result.field_bars}) {
      for (const FieldView& view : *views) add(view);
    }
  }
  void by_hand(bool until_steady) {
    rollout_.restart();
    for (const int count : {1, 2, 5}) {
      const RunResult result = rollout_.advance(count, until_steady);
      if (result.steady) told_.insert(told_.end(), {double(result.steady->step), result.steady->change});
      add(rollout_.present());
    }
  }

  RolloutSetup setup_;
  Rollout rollout_;
  std::vector<double> told_;
};

std::vector<double> told_by(Session& session, const Asked& way, bool apart) {
  RolloutSetup setup = session.setup();
  const Compiled& compiled = session.compiled();
  const std::string step = compiled.step_name(), loss = session.problem().task->name + "_loss_1";
  const Apart steps(compiled.program(step)), adjoints(compiled.adjoint_of(step));
  setup.step = apart ? steps.get() : compiled.program(step);
  setup.adjoint = apart ? adjoints.get() : compiled.adjoint_of(step);
  std::list<Apart> programs;
  const auto program = [&](const std::string& name) {
    return apart ? programs.emplace_back(compiled.program(name)).get() : compiled.program(name);
  };
  for (const AdjointVariant& variant : compiled.variants)
    setup.adjoint_variants.push_back({program(variant.adjoint), program(variant.step)});
  setup.sought = session.rollout().sought();
  LossTerm term;
  term.loss = compiled.program(loss);
  term.adjoint = compiled.adjoint_of(loss);
  term.at_steps = session.steps_of(session.problem().task->losses[0].when);
  setup.losses.push_back(term);
  way.set(setup);
  if (setup.steady > 0 || setup.dt > 1) {
    setup.adjoint = nullptr;
    setup.adjoint_variants.clear();
    setup.losses.clear();
  }
  return Told(session, setup).all();
}

bool is_over(const dpde_program& program) {
  return std::any_of(program.swaps, program.swaps + program.swap_count,
                     [](const dpde_swap& swap) { return swap.is_over != 0; });
}

void expect_bits_of_steps_apart(const OverwriteCase& example, Precision real) {
  SCOPED_TRACE(example.name);
  const SourceFile source("over.dpde", example.text);
  DiagnosticSink sink;
  CompileOptions options;
  options.backend = Backend::jit;
  options.real = real;
  options.adjoint = true;
  const auto session = Session::open(source, testing::compiled(source, options), {}, sink);
  ASSERT_TRUE(session) << testing::all_messages(source, sink);
  const Compiled& compiled = session->compiled();
  EXPECT_TRUE(is_over(*compiled.program(compiled.step_name())));
  for (const Asked& way : all_asked()) {
    SCOPED_TRACE(way.name);
    if (way.name == "it blows up" && session->setup().trial != nullptr) continue;  // no substep is short enough
    const std::vector<double> over = told_by(*session, way, false), apart = told_by(*session, way, true);
    ASSERT_EQ(over.size(), apart.size());
    for (size_t i = 0; i < over.size(); ++i)
      ASSERT_TRUE(over[i] == apart[i] || (std::isnan(over[i]) && std::isnan(apart[i]))) << i;
  }
}

TEST(Overwrites, GiveTheBitsOfStepsApart) {
  for (const OverwriteCase& example : overwrite_cases()) expect_bits_of_steps_apart(example, Precision::f64);
}

TEST(Overwrites, GiveTheBitsOfStepsApartInSinglePrecision) {
  std::size_t count = 0;
  for (const OverwriteCase& example : overwrite_cases()) {
    if (testing::is_tried(count++, 3)) expect_bits_of_steps_apart(example, Precision::f32);
  }
}

}  // namespace
}  // namespace dpde::driver
