// SPDX-License-Identifier: Apache-2.0
#include "stability/compiled_tangent.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <deque>
#include <limits>
#include <map>
#include <random>
#include <set>
#include <span>
#include <utility>

#include "codegen/llvm/jit.h"
#include "dpde/runtime/executor.h"
#include "dpde/runtime/field.h"
#include "dpde/runtime/unsolved.h"
#include "driver/pipeline.h"
#include "stability/fixed_part.h"
#include "stability/known_networks.h"
#include "stencil/build.h"
#include "support/match.h"

namespace dpde::stability {

using namespace stencil;

namespace {

bool is_of_kernels(const std::vector<stencil::Statement>& body, bool or_more) {
  return std::ranges::all_of(body, [&](const stencil::Statement& statement) {
    return match(
        statement, [](const stencil::Fill&) { return true; }, [](const stencil::Fold&) { return false; },
        [](const stencil::Reduce&) { return true; }, [](const stencil::NetworkCall&) { return false; },
        [&](const stencil::Transform&) { return or_more; }, [](const stencil::Run&) { return true; },
        [&](const stencil::Solve&) { return or_more; },
        [&](const stencil::Repeat& repeat) { return is_of_kernels(repeat.body, or_more); });
  });
}

/// Halo included.
void copy_all_cells(const stencil::State& from, const std::string& name, Field& to) {
  stencil::Cell low{}, high = from.grid().cells;
  for (std::size_t axis = 0; axis < low.size(); ++axis) {
    const int halo = std::min(from.halo(static_cast<int>(axis)), static_cast<int>(to.layout().halo[axis]));
    low[axis] -= halo;
    high[axis] += halo;
  }
  stencil::for_each_cell(low, high,
                         [&](const stencil::Cell& cell) { to.set(from.at(name, cell), cell[0], cell[1], cell[2]); });
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
      values.resize(session.workspace().cell_count());  // of a control field the first interval
      memory.set(input, values);
    }
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
  auto code = codegen::jit(driver::lower_to_loop(std::move(apart.module), programs, Precision::f64)).module;
  const auto is_there = [&](const std::string& name) { return code->find(name) != nullptr; };
  if (code == nullptr || !std::ranges::all_of(programs, is_there)) return nullptr;
  return std::unique_ptr<CompiledTangent>(new CompiledTangent(linear, std::move(code), std::move(apart.fixed)));
}

/// The program with memory of its own, inputs in it, what is made of these alone, and all perturbations 0.
struct CompiledTangent::Run {
  Run(const CompiledTangent& tangent, const State& inputs, const Params& params)
      : layout(layout_of(tangent, inputs.grid())), executor(tangent.step(), layout) {
    const dpde_program& program = tangent.step();
    std::map<std::string, Field*> known;
    for (int i = 0; i < program.field_count; ++i) {
      fields.push_back(new_field(program.fields[i], inputs, i));
      known[program.fields[i]] = &fields.back();
      executor.bind(i, fields.back().base());
    }
    set_params(executor, params);
    if (const dpde_program* fixed = tangent.fixed()) make_fixed(*fixed, inputs, params, known);
    executor.prepare();
  }
  /// Of what is in the first field of each pair a step makes the second. False where a solve finds no solution, which
  /// `unsolved` tells.
  bool advance(int steps, const std::vector<std::pair<int, int>>& states) try {
    for (int i = 0; i < steps; ++i) {
      executor.prepare();
      executor.run();
      for (const auto& [before, behind] : states) {
        void* const base = executor.bound(before);
        executor.bind(before, executor.bound(behind));
        executor.bind(behind, base);
      }
    }
    return true;
  } catch (const Unsolved& error) {  // the run, which fails likewise, names the model's unknown and its place
    const std::string& reason = error.facts().reason;
    unsolved = reason.empty() ? error.what() : reason;
    return false;
  }

  dpde_layout layout;
  Executor executor;
  std::string unsolved;
  std::deque<Field> fields;  // of the executor's program

 private:
  Field new_field(const char* name, const State& inputs, int number) const {
    Field field(layout, number);
    if (inputs.has(name)) copy_all_cells(inputs, name, field);
    return field;
  }
  static void set_params(Executor& executor, const Params& params) {
    for (const auto& [name, value] : params) {
      if (const int index = executor.param_index(name); index >= 0) executor.set_param(index, value);
    }
    executor.update_uniforms();
  }
  /// Into the fields that are known; others are needed here alone.
  void make_fixed(const dpde_program& program, const State& inputs, const Params& params,
                  const std::map<std::string, Field*>& known) const {
    Executor once(program, layout);
    std::deque<Field> others;
    for (int i = 0; i < program.field_count; ++i) {
      const auto found = known.find(program.fields[i]);
      Field& field =
          found == known.end() ? others.emplace_back(new_field(program.fields[i], inputs, i)) : *found->second;
      once.bind(i, field.base());
    }
    set_params(once, params);
    once.prepare();
    once.run();
  }
  static dpde_layout layout_of(const CompiledTangent& tangent, const Grid& grid) {
    const std::vector<std::int64_t> counts(grid.cells.begin(), grid.cells.begin() + grid.rank);
    std::array<std::int64_t, 3> halo{};
    for (const dpde_program* program : {&tangent.step(), tangent.fixed()}) {
      for (std::size_t axis = 0; program != nullptr && axis < halo.size(); ++axis)
        halo[axis] = std::max<std::int64_t>(halo[axis], program->halo[axis]);
    }
    return make_layout(counts, halo, tangent.step().real);
  }
};

Eigen::MatrixXd CompiledTangent::matrix(const State& inputs, const Params& params) const {
  Run run(*this, inputs, params);
  const auto cells = static_cast<Eigen::Index>(cell_count(run.layout));
  const auto states = static_cast<Eigen::Index>(linear_.states().size());
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(cells * states, cells * states);
  std::vector<double> values(static_cast<std::size_t>(cells), 0.0);
  const auto set = [&](Eigen::Index state, Eigen::Index cell, double value) {
    const int field = run.executor.field_index(linear_.perturbation_of(static_cast<std::size_t>(state)));
    if (field < 0) return;
    values[static_cast<std::size_t>(cell)] = value;
    copy_in(run.layout, run.executor.bound(field), values);
    run.executor.prepare(field);
    values[static_cast<std::size_t>(cell)] = 0;
  };
  for (Eigen::Index column = 0; column < result.cols(); ++column) {
    set(column / cells, column % cells, 1);
    run.executor.run();
    for (Eigen::Index s = 0; s < states; ++s) {
      const int made = run.executor.field_index(linear_.result_of(static_cast<std::size_t>(s)));
      if (made >= 0) run.fields[static_cast<std::size_t>(made)].copy_out({&result(s * cells, column), values.size()});
    }
    set(column / cells, column % cells, 0);
  }
  return result;
}

std::unique_ptr<CompiledTangent> CompiledTangent::flow() const {
  auto result = std::unique_ptr<CompiledTangent>(new CompiledTangent(linear_, code_, fixed_));
  result->is_flow_ = true;
  return result;
}

/// Perturbations as columns of a matrix, cells by states that anything depends on.
struct CompiledTangent::Columns {
  Columns(Run& of_step, const LinearStep& linear, bool of_flow) : run(of_step), is_flow(of_flow) {
    for (std::size_t s = 0; s < linear.states().size(); ++s) {
      const int before = run.executor.field_index(linear.perturbation_of(s)),
                behind = run.executor.field_index(linear.result_of(s));
      if (before >= 0 && behind >= 0) states.emplace_back(before, behind);
    }
  }
  Eigen::Index count() const { return std::ssize(states); }
  /// False where a solve finds no solution.
  bool advance(Eigen::MatrixXd& all, int steps) const {
    for (int i = 0; is_flow && i < steps; ++i) {
      if (!advance_flow(all)) return false;
    }
    return is_flow || advance_steps(all, steps);
  }

  Run& run;
  bool is_flow;
  std::vector<std::pair<int, int>> states;  // where a perturbation is, and what a step makes of it

 private:
  bool advance_steps(Eigen::MatrixXd& all, int steps) const {
    const auto column = [&](std::size_t s) {
      return std::span<double>(all.col(static_cast<Eigen::Index>(s)).data(), static_cast<std::size_t>(all.rows()));
    };
    for (std::size_t s = 0; s < states.size(); ++s) copy_in(run.layout, run.executor.bound(states[s].first), column(s));
    const bool has_solutions = run.advance(steps, states);
    for (std::size_t s = 0; s < states.size(); ++s)
      copy_out(run.layout, run.executor.bound(states[s].first), column(s));
    return has_solutions;
  }
  bool advance_flow(Eigen::MatrixXd& all) const {
    constexpr int degree = 8;
    Eigen::MatrixXd term = all;
    for (int k = 1; k <= degree; ++k) {
      Eigen::MatrixXd next = term;
      if (!advance_steps(next, 1)) return false;
      term = (next - term) / k;
      all += term;
    }
    return true;
  }
};

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

Eigen::MatrixXd CompiledTangent::applied(const State& inputs, const Params& params,
                                         Eigen::MatrixXd perturbation) const {
  Run run(*this, inputs, params);
  if (!Columns(run, linear_, is_flow_).advance(perturbation, 1))
    perturbation.fill(std::numeric_limits<double>::quiet_NaN());
  return perturbation;
}

CompiledTangent::Repeated CompiledTangent::repeated(const State& inputs, const Params& params, int steps, double enough,
                                                    int kept_steps) const {
  Run run(*this, inputs, params);
  const Columns columns(run, linear_, is_flow_);
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> noise(-1, 1);
  Eigen::MatrixXd all = Eigen::MatrixXd::NullaryExpr(cell_count(run.layout), columns.count(),
                                                     [&](Eigen::Index, Eigen::Index) { return noise(random); });
  Eigen::MatrixXd kept;
  double growth = 0;
  std::vector<double> growths;
  for (int step = 0; step < steps; step += steps_between_growths) {
    const bool has_solutions = columns.advance(all, std::min(steps - step, steps_between_growths));
    const double norm = has_solutions ? all.norm() : std::numeric_limits<double>::infinity();
    if (!std::isfinite(norm)) {
      growth = std::numeric_limits<double>::infinity();
    } else if (step > 0) {
      growth += std::log(norm);
    }
    growths.push_back(growth);
    if (!std::isfinite(growth)) break;
    all /= norm;
    if (step + steps_between_growths == kept_steps) kept = all;
    if (growth > enough) break;
  }
  return {std::move(growths), std::move(all), std::move(kept), run.unsolved};
}

KrylovSpace CompiledTangent::on_krylov_space(const State& inputs, const Params& params,
                                             const Eigen::MatrixXd& perturbation, int most) const {
  constexpr double nothing = 1e-13;  // of an image: rounding
  Run run(*this, inputs, params);
  const Columns columns(run, linear_, is_flow_);
  std::vector<Eigen::MatrixXd> basis{perturbation / perturbation.norm()};
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(most + 1, most);
  for (int k = 0; k < most; ++k) {
    Eigen::MatrixXd image = basis.back();
    if (!columns.advance(image, 1) || !image.allFinite()) return {};
    const double size = image.norm();
    for (int turn = 0; turn < 2; ++turn) {  // the second time for what rounding has left of the first
      for (int i = 0; i <= k; ++i) {
        const double share = basis[static_cast<std::size_t>(i)].cwiseProduct(image).sum();
        result(i, k) += share;
        image -= share * basis[static_cast<std::size_t>(i)];
      }
    }
    const double rest = image.norm();
    if (!(rest > nothing * size)) return {result.topLeftCorner(k + 1, k + 1), rest};
    result(k + 1, k) = rest;
    basis.push_back(image / rest);
  }
  return {result.topRows(most), result(most, most - 1)};
}

}  // namespace dpde::stability
