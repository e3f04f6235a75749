// SPDX-License-Identifier: Apache-2.0
// The schedule of row calls; executor.h lists its properties.
//
// A program whose sweeps have only one row (1-D programs of sweeps and fills) is a list of Lines, which need only
// pointers and calls. All others are run by sweep_runner.h.
//
// An interpreted program has no operations here: its interpreter runs it as a whole.
#include "dpde/runtime/executor.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <optional>
#include <utility>

#include "dpde/runtime/error.h"
#include "dpde/runtime/float_mode.h"
#include "dpde/runtime/layout.h"
#include "exec/program_operations.h"
#include "exec/sweep_runner.h"
#include "grid/line.h"
#include "grid/real.h"
#include "optimise/fit.h"

namespace dpde {
namespace {

template <class... Fs>
struct Overloaded : Fs... {
  using Fs::operator()...;
};

int find_name(const char* const* names, int count, std::string_view name) {
  const char* const* const found = std::find(names, names + count, name);
  return found == names + count ? -1 : static_cast<int>(found - names);
}

/// A fill that can run directly after a line: the row is complete then, even if other cells add to it.
const HaloFill* fill_of_row(const Operation& operation) {
  const HaloFill* fill = std::get_if<HaloFill>(&operation.kind);
  return fill != nullptr && !fill->is_of_all() ? fill : nullptr;
}

}  // namespace

struct Executor::Plan {
  Plan(const dpde_program& program, const dpde_layout& layout, const Team& team, std::shared_ptr<SolverStore> solvers,
       Communicator* ranks);
  void make_row_runner(const dpde_program& program, const dpde_layout& layout);
  Communicator* ranks() { return seams ? &seams->exchange().ranks() : nullptr; }
  std::vector<Line> make_lines(Executor& executor) const;
  void run(std::vector<Operation>& all, Executor& executor);
  void run(Inference& inference, Executor& executor);
  void run(SolveOperation& solve, Executor& executor);
  void run(RepeatOperation& repeat, Executor& executor);

  std::optional<Seams> seams;  // on a subgrid
  std::vector<HaloFill> prepare;
  std::vector<Line> lines;  // if not empty, they replace the operations
  std::vector<Operation> operations;
  std::vector<Network> networks;  // those of the program
  SweepRunner sweeps;
  std::vector<Stack> stacks;
  bool has_stacks = false;  // memory is allocated
  std::shared_ptr<SolverShelf> shelf;
  Team team;
};

Executor::Plan::Plan(const dpde_program& program, const dpde_layout& layout, const Team& of,
                     std::shared_ptr<SolverStore> solvers, Communicator* ranks)
    : shelf(std::make_shared<SolverShelf>(of, solvers ? std::move(solvers) : make_solver_store())), team(of) {
  if (is_divided(layout)) {
    if (ranks == nullptr) throw Error(ErrorKind::run, fmt::format("program {}: a subgrid needs ranks", program.name));
    seams.emplace(program, layout, *ranks);
  }
  if (program.interpret == nullptr) make_row_runner(program, layout);
}

void Executor::Plan::make_row_runner(const dpde_program& program, const dpde_layout& layout) {
  for (int i = 0; i < program.network_count; ++i)
    networks.emplace_back(*program.networks[i], layout, team, applications(program, i, DPDE_NETWORK_SECOND) > 0);
  for (int i = 0; i < program.prepare_count; ++i)
    prepare.emplace_back(program.prepare[i], layout, seams ? &seams->exchange() : nullptr);
  for (int i = 0; i < program.stack_count; ++i) stacks.emplace_back(program.stacks[i]);
  const OperationSetup setup{&program, &layout, &team, seams ? &*seams : nullptr, &stacks, shelf};
  operations = make_operations(setup, program.operations, program.operation_count);
  sweeps = SweepRunner(layout, team);
  for_each_of<Sweep>(operations, [&](const Sweep& sweep) { sweeps.make_room(sweep); });
}

Executor::Executor(const dpde_program& program, const dpde_layout& layout, const Team& team,
                   std::shared_ptr<SolverStore> solvers, Communicator* ranks)
    : program_(&program), layout_(std::make_unique<dpde_layout>(layout)) {
  check_fits(program, layout);
  plan_ = std::make_unique<Plan>(program, *layout_, team, std::move(solvers), ranks);
  fields_.assign(static_cast<size_t>(program.field_count), nullptr);
  params_.assign(static_cast<size_t>(program.param_count + program.counter_count), 0.0);
  uniforms_.assign(static_cast<size_t>(program.uniform_count), 0.0);
  sums_.assign(static_cast<size_t>(program.sum_count), 0.0);
  weights_.assign(static_cast<size_t>(program.network_count), dpde_weights{});
  plan_->lines = plan_->make_lines(*this);
  size_t size = 0;
  for (const Line& line : plan_->lines) size += line.frame_size();
  frame_.assign(size, nullptr);
}

/// Empty if an operation is not possible in a line.
std::vector<Line> Executor::Plan::make_lines(Executor& executor) const {
  if (executor.layout_->rank != 1 || seams) return {};
  std::vector<Line> made;
  for (const Operation& operation : operations) {
    const Sweep* const sweep = std::get_if<Sweep>(&operation.kind);
    const HaloFill* const fill = fill_of_row(operation);
    if (sweep != nullptr && is_line(*sweep)) {
      made.push_back(make_line(*sweep, *executor.layout_, executor.uniforms_.data(), executor.sums_.data()));
    } else if (!made.empty() && fill != nullptr) {
      made.back().then.push_back(*fill);
    } else {
      return {};
    }
  }
  return made;
}

std::shared_ptr<SolverStore> make_solver_store() { return std::make_shared<SolverStore>(); }

Executor::~Executor() = default;
Executor::Executor(Executor&&) noexcept = default;
Executor& Executor::operator=(Executor&&) noexcept = default;

int Executor::field_index(std::string_view name) const {
  return find_name(program_->fields, program_->field_count, name);
}
int Executor::param_index(std::string_view name) const {
  return find_name(program_->params, program_->param_count, name);
}
int Executor::sum_index(std::string_view name) const { return find_name(program_->sums, program_->sum_count, name); }

void Executor::update_weights() {
  for (size_t i = 0; i < plan_->networks.size(); ++i) {
    plan_->networks[i].set_weights(weights_[i].values);
    plan_->networks[i].set_host(weights_[i].host);
  }
}

Network* Executor::network(int number) {
  return plan_->networks.empty() ? nullptr : &plan_->networks[static_cast<size_t>(number)];
}

void Executor::compute_uniforms() {
  uniforms_are_stale_ = false;
  const FloatScope without_subnormals;
  if (program_->compute_uniforms != nullptr) program_->compute_uniforms(params_.data(), uniforms_.data());
}

void Executor::count(size_t counter, double number) {
  params_[static_cast<size_t>(program_->param_count) + counter] = number;
  program_->compute_counted(params_.data(), uniforms_.data());
}

void Executor::prepare() {
  for (size_t i = 0; i < fields_.size(); ++i) {
    if (fields_[i] == nullptr)
      throw Error(ErrorKind::run,
                  fmt::format("program {}: field {} is not bound", program_->name, program_->fields[i]));
  }
  const FloatScope without_subnormals;
  for (const HaloFill& fill : plan_->prepare) fill.run(fields_.data(), uniforms_.data(), plan_->team);
}

void Executor::prepare(int field) {
  const FloatScope without_subnormals;
  for (const HaloFill& fill : plan_->prepare) {
    if (fill.field() == field) fill.run(fields_.data(), uniforms_.data(), plan_->team);
  }
}

bool Executor::prepares(int field) const {
  return std::ranges::any_of(plan_->prepare, [&](const HaloFill& fill) { return fill.field() == field; });
}

void Executor::run() {
  const FloatScope without_subnormals;
  const Stopwatch whole(clock_ ? &clock_->all : nullptr);
  if (program_->interpret != nullptr) {
    program_->interpret(program_->context, layout_.get(), fields_.data(), params_.data(), weights_.data(),
                        sums_.data());
    return;
  }
  if (!frame_.empty()) {
    make_frame(frame_.data());
    return run_lines(frame_.data());
  }
  std::fill(sums_.begin(), sums_.end(), 0.0);
  make_stacks();
  plan_->run(plan_->operations, *this);
  if (Communicator* const ranks = plan_->ranks(); ranks != nullptr && !sums_.empty()) ranks->sum(sums_);
}

void Executor::Plan::run(Inference& inference, Executor& executor) {
  const Stopwatch part(executor.clock_ ? &executor.clock_->networks : nullptr);
  const size_t network = inference.network();
  inference.run(networks[network], executor.fields_.data(), executor.weights_[network]);
}

void Executor::Plan::run(SolveOperation& solve, Executor& executor) {
  void** const fields = executor.fields_.data();
  solve.solve.run(
      fields, executor.params_.data(), [&] { run(solve.block, executor); }, [&] { run(solve.step, executor); },
      [&] {
        const Stopwatch part(executor.clock_ ? &executor.clock_->networks : nullptr);
        solve.preconditioner->run_beside_tapes(networks[solve.preconditioner->network()], fields);
      });
}

void Executor::Plan::run(RepeatOperation& repeat, Executor& executor) {
  void** const fields = executor.fields_.data();
  Passes& passes = repeat.passes;
  const PassesInFields moved(passes, fields);
  for (int64_t pass = 0; pass < passes.count(); ++pass) {
    passes.before(pass, fields, stacks);
    if (passes.has_counter()) executor.count(passes.counter(), passes.number_of(pass));
    run(repeat.block, executor);
    passes.after(fields);
  }
}

void Executor::Plan::run(std::vector<Operation>& all, Executor& executor) {
  void** const fields = executor.fields_.data();
  const double* const uniforms = executor.uniforms_.data();
  const Overloaded run_one{
      [&](Sweep& sweep) { sweeps.run(sweep, executor.fields_, uniforms, executor.sums_); },
      [&](HaloFill& fill) { fill.run(fields, uniforms, team); },
      [&](HaloFold& fold) { fold.run(fields, uniforms); },
      [&](SeamWork& work) { seams->run(work, fields); },
      [&](FieldReduction& reduction) { reduction.run(fields); },
      [&](FieldTransform& transform) { transform.run(fields, uniforms); },
      [&](auto& with_blocks) { run(with_blocks, executor); },
  };
  for (Operation& operation : all) std::visit(run_one, operation.kind);
}

void Executor::make_stacks() {
  if (std::exchange(plan_->has_stacks, true)) return;
  for (Stack& stack : plan_->stacks) stack.make(*layout_);
}

std::vector<OwnedMemory> Executor::memory() const {
  std::vector<OwnedMemory> owned;
  for (size_t i = 0; i < plan_->networks.size(); ++i)
    owned.push_back(
        {.owner = fmt::format("network {}", program_->networks[i]->name), .kept = plan_->networks[i].bytes()});
  for (const Stack& stack : plan_->stacks)
    owned.push_back({.owner = "passes of repeats", .kept = stack.bytes(*layout_)});
  for_each_of<FieldTransform>(plan_->operations, [&](const FieldTransform& transform) {
    owned.push_back({.owner = "Fourier transforms", .kept = transform.bytes()});
  });
  for_each_of<SolveOperation>(plan_->operations, [&](const SolveOperation& operation) {
    std::ranges::move(operation.solve.memory(), std::back_inserter(owned));
  });
  return owned;
}

std::deque<SolveNote>& Executor::solve_notes() { return plan_->shelf->notes(); }

std::vector<FieldSolve*> Executor::field_solves() {
  std::vector<FieldSolve*> solves;
  for_each_of<SolveOperation>(plan_->operations, [&](SolveOperation& operation) {
    if (FieldSolve* const solve = operation.solve.of_field()) solves.push_back(solve);
  });
  return solves;
}

std::string Executor::tuning() const {
  std::string text;
  if (is_tuning()) return text;
  for_each_of<Sweep>(plan_->operations, [&](const Sweep& sweep) {
    if (sweep.tuner.has_choice()) text += sweep.tuner.text() + '\n';
  });
  return text;
}

bool Executor::is_tuning() const {
  bool is_tuning = false;
  for_each_of<Sweep>(plan_->operations, [&](const Sweep& sweep) { is_tuning = is_tuning || !sweep.tuner.is_done(); });
  return is_tuning;
}

void Executor::set_tuning(std::string_view text) {
  for_each_of<Sweep>(plan_->operations, [&](Sweep& sweep) {
    if (!sweep.tuner.has_choice()) return;
    const size_t end = std::min(text.find('\n'), text.size());
    sweep.tuner.set(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
  });
}

void Executor::make_frame(void** frame) const {
  void* const* fields = fields_.data();
  for (const Line& line : plan_->lines) {
    for (const SweepStream& stream : line.streams) *frame++ = moved(fields[stream.field], stream.delta, 1);
    for (int grid : line.grids) *frame++ = fields[grid];
    for (const HaloFill& fill : line.then) *frame++ = fields[fill.field()];
  }
}

void Executor::run_frame(void* const* frame) {
  const FloatScope without_subnormals;
  const Stopwatch whole(clock_ ? &clock_->all : nullptr);
  run_lines(frame);
}

void Executor::run_lines(void* const* frame) {
  for (double& sum : sums_) sum = 0;
  for (Line& line : plan_->lines) {
    line.row.streams = frame;
    line.row.grids = frame += line.streams.size();
    line.call(&line.row);
    frame += line.grids.size();
    for (const HaloFill& fill : line.then) fill.run_row(*frame++, line.row.uniforms);
  }
}

}  // namespace dpde
