// SPDX-License-Identifier: Apache-2.0
#include "stability/step/compiled_tangent.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <span>
#include <utility>

#include "codegen/llvm/jit.h"
#include "dpde/runtime/error.h"
#include "dpde/runtime/executor.h"
#include "dpde/runtime/field.h"
#include "dpde/runtime/rollout.h"
#include "driver/compile/pipeline.h"
#include "stability/frozen/fixed_part.h"
#include "stability/report/known_networks.h"
#include "stability/step/tangent_memory.h"
#include "stencil/build.h"
#include "support/match.h"

namespace dpde::stability {

using namespace stencil;

namespace {

bool is_of_kernels(const std::vector<stencil::Statement>& body, bool or_more) {
  return std::ranges::all_of(body, [&](const stencil::Statement& statement) {
    return match(
        statement, always<true, stencil::Fill, stencil::Reduce, stencil::Run>,
        always<false, stencil::Fold, stencil::NetworkCall>,
        [&](const OneOf<stencil::Transform, stencil::Solve> auto&) { return or_more; },
        [&](const stencil::Repeat& repeat) { return is_of_kernels(repeat.body, or_more); });
  });
}

}  // namespace

stencil::State memory_for(const LinearStep& linear, const stencil::Grid& grid) {
  int halo = 0;
  for (const auto& [field, widths] : stencil::required_halo(linear.module(), linear.program()))
    halo = std::max(halo, *std::ranges::max_element(widths));
  return {grid, halo};
}

stencil::Grid grid_of(const std::vector<model::Axis>& axes) {
  stencil::Grid grid;
  grid.rank = static_cast<int>(axes.size());
  for (std::size_t a = 0; a < axes.size(); ++a) grid.cells[a] = axes[a].cells;
  return grid;
}

State initial_inputs(driver::Session& session, const LinearStep& linear) {
  State memory = memory_for(linear, grid_of(session.axes()));
  memory.inverses = new_inverses();
  auto networks = values_of_networks(session, linear.known_networks(), session.problem().t_begin);
  for (const std::string& input : linear.inputs()) {
    const int state = is_coordinate(input) ? -1 : session.engine().state_index(input);
    if (is_coordinate(input)) {
      const auto axis = static_cast<std::size_t>(input[0] - 'x');
      const model::Axis& along = session.axes()[axis];
      memory.set_coordinate(static_cast<int>(axis), along.topology, along.low, along.spacing());
    } else if (linear.known_networks().contains(input)) {
      std::vector<double>& values = networks[input];
      values.resize(session.workspace().cell_count(), std::numeric_limits<double>::quiet_NaN());
      memory.set(input, values);
    } else {
      std::vector<double> values = state < 0 ? session.workspace().dense(input) : session.initial(state);
      values.resize(session.workspace().cell_count());  // only the first interval of a control field
      memory.set(input, values);
    }
  }
  return memory;
}

std::optional<State> inputs_after(driver::Session& session, const LinearStep& linear, double step) {
  RolloutSetup setup = session.engine().setup();
  setup.dt = step;
  setup.rate = setup.trial = nullptr;
  setup.rate_field.clear();
  Rollout rollout(setup);
  session.engine().begin_other(rollout);
  for (int s = 0; s < rollout.state_count(); ++s) rollout.initial(s).copy_in(session.initial(s));
  rollout.restart();
  try {
    rollout.advance(1);
  } catch (const NoSolution&) {
    return std::nullopt;
  }
  State memory = initial_inputs(session, linear);
  std::vector<double> values(session.workspace().cell_count());
  for (const std::string& input : linear.inputs()) {
    const int state = is_coordinate(input) ? -1 : session.engine().state_index(input);
    if (state < 0 || linear.known_networks().contains(input)) continue;
    copy_out(session.workspace().layout(), rollout.present()[static_cast<std::size_t>(state)], values);
    if (!std::ranges::all_of(values, [](double value) { return std::isfinite(value); })) return std::nullopt;
    memory.set(input, values);
  }
  return memory;
}

std::unique_ptr<CompiledTangent> CompiledTangent::make(const LinearStep& linear) {
  return make(linear, linear.module(), false);
}

std::unique_ptr<CompiledTangent> CompiledTangent::make(const LinearStep& linear, const Program& program) {
  Module module = linear.module();
  module.programs.front() = program;
  return make(linear, module, false);
}

std::unique_ptr<CompiledTangent> CompiledTangent::of_coupled(const LinearStep& linear) {
  return make(linear, linear.coupled_module(), true);
}

std::unique_ptr<CompiledTangent> CompiledTangent::make(const LinearStep& linear, const Module& module, bool with_more) {
  const Program& program = module.programs.front();
  if (!is_of_kernels(program.body, with_more)) return nullptr;
  std::set<std::string> perturbations;
  for (std::size_t s = 0; s < linear.states().size(); ++s) perturbations.insert(linear.perturbation_of(s));
  ApartModule apart = with_fixed_part_apart(module, perturbations);
  std::vector<std::string> programs{program.name};
  if (!apart.fixed.empty()) programs.push_back(apart.fixed);
  auto code = codegen::jit(driver::lower_to_loop(std::move(apart.module), programs, Precision::f64).module,
                           {.reciprocals = with_more})
                  .module;
  const auto is_there = [&](const std::string& name) { return code->find(name) != nullptr; };
  if (code == nullptr || !std::ranges::all_of(programs, is_there)) return nullptr;
  return std::unique_ptr<CompiledTangent>(new CompiledTangent(linear, std::move(code), std::move(apart.fixed)));
}

Eigen::MatrixXd CompiledTangent::matrix(const State& inputs, const Params& params) const {
  TangentMemory run(*this, inputs);
  run.begin(params);
  const auto cells = static_cast<Eigen::Index>(cell_count(run.layout()));
  const auto states = static_cast<Eigen::Index>(linear_.states().size());
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(cells * states, cells * states);
  std::vector<double> values(static_cast<std::size_t>(cells), 0.0);
  const auto set = [&](Eigen::Index state, Eigen::Index cell, double value) {
    const int field = run.executor().field_index(linear_.perturbation_of(static_cast<std::size_t>(state)));
    if (field < 0) return;
    values[static_cast<std::size_t>(cell)] = value;
    copy_in(run.layout(), run.executor().bound(field), values);
    run.executor().prepare(field);
    values[static_cast<std::size_t>(cell)] = 0;
  };
  for (Eigen::Index column = 0; column < result.cols(); ++column) {
    set(column / cells, column % cells, 1);
    run.executor().run();
    for (Eigen::Index s = 0; s < states; ++s) {
      const int made = run.executor().field_index(linear_.result_of(static_cast<std::size_t>(s)));
      if (made >= 0) run.field(made).copy_out({&result(s * cells, column), values.size()});
    }
    set(column / cells, column % cells, 0);
  }
  return result;
}

std::vector<std::string> CompiledTangent::states() const {
  const dpde_program& program = step();
  const auto has = [&](const std::string& field) {
    const std::span<const char* const> fields(program.fields, static_cast<std::size_t>(program.field_count));
    return std::ranges::any_of(fields, [&](const char* name) { return field == name; });
  };
  std::vector<std::string> result;
  for (std::size_t s = 0; s < linear_.states().size(); ++s) {
    if (has(linear_.perturbation_of(s)) && has(linear_.result_of(s))) result.push_back(linear_.states()[s]);
  }
  return result;
}

}  // namespace dpde::stability
