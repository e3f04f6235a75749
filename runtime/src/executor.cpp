// SPDX-License-Identifier: Apache-2.0
// The schedule of row calls: see executor.h for what holds.
//
// A program that consists of sweeps of one row (1-D programs of sweeps and fills) is a list of Lines, with nothing left
// to do but pointers and calls. Else sweep_runner.h runs them.
//
// Of a subgrid, what ranks do between operations is operations of its own, and so are fills (seams.h).
#include "dpde/runtime/executor.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "dpde/runtime/error.h"
#include "dpde/runtime/float_mode.h"
#include "dpde/runtime/layout.h"
#include "fill.h"
#include "fit.h"
#include "inference.h"
#include "line.h"
#include "passes.h"
#include "program_solve.h"
#include "real.h"
#include "reduce.h"
#include "seams.h"
#include "sweep_runner.h"
#include "transform.h"

namespace dpde {
namespace {

struct Operation {
  int kind = DPDE_SWEEP;
  HaloFill fill;
  HaloFold fold;
  FieldReduction reduction;
  Inference inference;
  FieldTransform transform;
  ProgramSolve solve;
  Sweep sweep;
  Passes passes;
  std::vector<Operation> block, step;  // of one pass, of a solve
  SeamWork seam_work{};
};
/// Of seam work, beside the kinds of the ABI.
constexpr int seam_kind = -1;

/// `f` on each operation, those of blocks behind that which has them.
void for_each_operation(auto& operations, const auto& f) {
  for (auto& operation : operations) {
    f(operation);
    for_each_operation(operation.block, f);
    for_each_operation(operation.step, f);
  }
}
/// `f` on each sweep, in blocks too.
void for_each_sweep(auto& operations, const auto& f) {
  for_each_operation(operations, [&](auto& operation) {
    if (operation.kind == DPDE_SWEEP) f(operation.sweep);
  });
}

int find_name(const char* const* names, int count, std::string_view name) {
  const char* const* const found = std::find(names, names + count, name);
  return found == names + count ? -1 : static_cast<int>(found - names);
}

/// Behind a line: a row is complete when it is done, also one that is scattered to.
bool fills_row(const Operation& operation) { return operation.kind == DPDE_FILL && !operation.fill.is_of_all(); }

}  // namespace

struct Executor::Plan {
  std::optional<Seams> seams;  // of a subgrid
  std::vector<HaloFill> prepare;
  std::vector<Line> lines;  // not empty: in place of the operations
  std::vector<Operation> operations;
  std::vector<Network> networks;  // those of the program
  SweepRunner sweeps;
  std::vector<Stack> stacks;
  bool has_stacks = false;  // in memory
  std::shared_ptr<SolverShelf> shelf = std::make_shared<SolverShelf>();
  Team team;

  std::vector<Operation> make(const dpde_program& program, const dpde_operation* source, int count,
                              const dpde_layout& layout);
  Operation make_operation(const dpde_program& program, const dpde_operation& from, const dpde_layout& layout,
                           FieldTransform* before);
  HaloExchange* exchange() { return seams ? &seams->exchange() : nullptr; }
  Communicator* ranks() { return seams ? &seams->exchange().ranks() : nullptr; }
  void add(const std::vector<SeamWork>& work, std::vector<Operation>& made) const;
  std::vector<Line> make_lines(Executor& executor) const;
  void run(std::vector<Operation>& all, Executor& executor);
};

Executor::Executor(const dpde_program& program, const dpde_layout& layout, const Team& team,
                   std::shared_ptr<SolverStore> solvers, Communicator* ranks)
    : program_(&program), layout_(std::make_unique<dpde_layout>(layout)), plan_(std::make_unique<Plan>()) {
  check_fits(program, layout);
  plan_->team = team;
  if (is_divided(layout)) {
    if (ranks == nullptr) throw Error(ErrorKind::run, fmt::format("program {}: a subgrid needs ranks", program.name));
    plan_->seams.emplace(program, *layout_, *ranks);
  }
  if (solvers != nullptr) plan_->shelf = std::make_shared<SolverShelf>(std::move(solvers));
  fields_.assign(static_cast<size_t>(program.field_count), nullptr);
  params_.assign(static_cast<size_t>(program.param_count + program.counter_count), 0.0);
  uniforms_.assign(static_cast<size_t>(program.uniform_count), 0.0);
  sums_.assign(static_cast<size_t>(program.sum_count), 0.0);
  weights_.assign(static_cast<size_t>(program.network_count), dpde_weights{});
  for (int i = 0; i < program.network_count && program.interpret == nullptr; ++i)
    plan_->networks.emplace_back(*program.networks[i], layout, team, applications(program, i, DPDE_NETWORK_SECOND) > 0);
  for (int i = 0; i < program.prepare_count; ++i)
    plan_->prepare.emplace_back(program.prepare[i], layout, plan_->exchange());
  for (int i = 0; i < program.stack_count; ++i) plan_->stacks.emplace_back(program.stacks[i]);
  plan_->operations = plan_->make(program, program.operations, program.operation_count, layout);
  plan_->sweeps = SweepRunner(*layout_, team);
  for_each_sweep(plan_->operations, [&](const Sweep& sweep) { plan_->sweeps.make_room(sweep); });
  if (program.interpret == nullptr) plan_->lines = plan_->make_lines(*this);
  size_t size = 0;
  for (const Line& line : plan_->lines) size += line.frame_size();
  frame_.assign(size, nullptr);
}

/// Empty where some operation is not of a line.
std::vector<Line> Executor::Plan::make_lines(Executor& executor) const {
  if (executor.layout_->rank != 1 || seams) return {};
  std::vector<Line> made;
  for (const Operation& operation : operations) {
    if (operation.kind == DPDE_SWEEP && is_line(operation.sweep)) {
      made.push_back(make_line(operation.sweep, *executor.layout_, executor.uniforms_.data(), executor.sums_.data()));
    } else if (!made.empty() && fills_row(operation)) {
      made.back().then.push_back(operation.fill);
    } else {
      return {};
    }
  }
  return made;
}

std::vector<Operation> Executor::Plan::make(const dpde_program& program, const dpde_operation* source, int count,
                                            const dpde_layout& layout) {
  std::vector<Operation> made;
  for (int i = 0; i < count; ++i) {
    const dpde_operation& from = source[i];
    if (seams) add(seams->before(from), made);
    made.push_back(make_operation(program, from, layout, made.empty() ? nullptr : &made.back().transform));
    if (!seams) continue;
    add(seams->after(from), made);
    for (int f = 0; f < from.then_count; ++f)
      made.push_back({.kind = DPDE_FILL, .fill = HaloFill(from.then[f], layout, exchange())});
  }
  return made;
}

void Executor::Plan::add(const std::vector<SeamWork>& work, std::vector<Operation>& made) const {
  for (const SeamWork& one : work) made.push_back({.kind = seam_kind, .seam_work = one});
}

/// `before`: of the operation before it.
Operation Executor::Plan::make_operation(const dpde_program& program, const dpde_operation& from,
                                         const dpde_layout& layout, FieldTransform* before) {
  Operation operation{.kind = from.kind};
  switch (from.kind) {
    case DPDE_FILL: operation.fill = HaloFill(from.fill, layout, exchange()); break;
    case DPDE_FOLD: operation.fold = HaloFold(from.fill, from.grow, layout); break;
    case DPDE_REDUCE: operation.reduction = FieldReduction(from.reduce, layout, team, ranks()); break;
    case DPDE_NETWORK:
      operation.inference = Inference(from.inference, *program.networks[from.inference.network]);
      break;
    case DPDE_TRANSFORM: operation.transform = FieldTransform(from.transform, layout, team, before); break;
    case DPDE_SWEEP:
      operation.sweep = make_sweep(program, from, layout, team.threads());
      if (seams && !operation.sweep.grids.empty()) operation.sweep.read_whole(*seams->whole());
      break;
    case DPDE_SOLVE:
      operation.solve = ProgramSolve(from.solve, program, layout, shelf);
      if (const dpde_inference* network = from.solve.network)
        operation.inference = Inference(*network, *program.networks[network->network]);
      operation.block = make(program, from.solve.operations, from.solve.operation_count, layout);
      if (const dpde_solve* step = from.solve.step)
        operation.step = make(program, step->operations, step->operation_count, layout);
      break;
    case DPDE_REPEAT:
      operation.passes = Passes(from.repeat, stacks);
      if (seams) seams->begin_block();
      operation.block = make(program, from.repeat.operations, from.repeat.operation_count, layout);
      break;
    default:
      throw Error(ErrorKind::run, fmt::format("program {}: an operation of unknown kind {}", program.name, from.kind));
  }
  return operation;
}

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

int Executor::network_index(std::string_view name) const {
  const auto names = std::span(program_->networks, static_cast<size_t>(program_->network_count));
  const auto found = std::ranges::find(names, name, [](const auto* one) { return std::string_view(one->name); });
  return found == names.end() ? -1 : static_cast<int>(found - names.begin());
}

void Executor::update_weights() {
  for (size_t i = 0; i < plan_->networks.size(); ++i) {
    plan_->networks[i].set_weights(weights_[i].values);
    plan_->networks[i].set_host(weights_[i].host);
  }
}

Network* Executor::network(int number) {
  return plan_->networks.empty() ? nullptr : &plan_->networks[static_cast<size_t>(number)];
}

std::int64_t Executor::network_bytes() const {
  std::int64_t total = 0;
  for (const Network& network : plan_->networks) total += network.bytes();
  return total;
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
  if (program_->interpret != nullptr) return;  // it fills halos itself
  const FloatScope without_subnormals;
  for (const HaloFill& fill : plan_->prepare) fill.run(fields_.data(), uniforms_.data(), plan_->team);
}

void Executor::prepare(int field) {
  if (program_->interpret != nullptr) return;
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

void Executor::Plan::run(std::vector<Operation>& all, Executor& executor) {
  void** const fields = executor.fields_.data();
  const double* const uniforms = executor.uniforms_.data();
  for (Operation& operation : all) {
    switch (operation.kind) {
      case DPDE_SWEEP: sweeps.run(operation.sweep, executor.fields_, executor.uniforms_.data(), executor.sums_); break;
      case DPDE_FILL: operation.fill.run(fields, uniforms, team); break;
      case DPDE_FOLD: operation.fold.run(fields, uniforms); break;
      case seam_kind: seams->run(operation.seam_work, fields); break;
      case DPDE_NETWORK: {
        const Stopwatch part(executor.clock_ ? &executor.clock_->networks : nullptr);
        const int network = operation.inference.network();
        operation.inference.run(networks[static_cast<size_t>(network)], fields,
                                executor.weights_[static_cast<size_t>(network)]);
        break;
      }
      case DPDE_REDUCE: operation.reduction.run(fields); break;
      case DPDE_TRANSFORM: operation.transform.run(fields, uniforms); break;
      case DPDE_SOLVE:
        operation.solve.run(
            fields, executor.params_.data(), [&] { run(operation.block, executor); },
            [&] { run(operation.step, executor); },
            [&] {
              const Stopwatch part(executor.clock_ ? &executor.clock_->networks : nullptr);
              operation.inference.run_beside_tapes(networks[operation.inference.network()], fields);
            });
        break;
      case DPDE_REPEAT: {
        Passes& passes = operation.passes;
        const PassesInFields moved(passes, fields);
        for (int64_t pass = 0; pass < passes.count(); ++pass) {
          passes.before(pass, fields, stacks);
          if (passes.has_counter()) executor.count(passes.counter(), passes.number_of(pass));
          run(operation.block, executor);
          passes.after(fields);
        }
        break;
      }
    }
  }
}

void Executor::make_stacks() {
  if (std::exchange(plan_->has_stacks, true) || program_->interpret != nullptr) return;
  for (Stack& stack : plan_->stacks) stack.make(*layout_);
}

std::int64_t Executor::stack_bytes() const {
  std::int64_t bytes = 0;
  for (const Stack& stack : plan_->stacks) bytes += stack.bytes(*layout_);
  return bytes;
}

std::deque<SolveNote>& Executor::solve_notes() { return plan_->shelf->notes(); }

std::vector<FieldSolve*> Executor::field_solves() {
  std::vector<FieldSolve*> solves;
  if (program_->interpret != nullptr) return solves;
  for_each_operation(plan_->operations, [&](Operation& operation) {
    FieldSolve* const solve = operation.kind == DPDE_SOLVE ? operation.solve.of_field() : nullptr;
    if (solve != nullptr) solves.push_back(solve);
  });
  return solves;
}

std::string Executor::tuning() const {
  std::string text;
  if (is_tuning()) return text;
  for_each_sweep(plan_->operations, [&](const Sweep& sweep) {
    if (sweep.tuner.has_choice()) text += sweep.tuner.text() + '\n';
  });
  return text;
}

bool Executor::is_tuning() const {
  bool is_tuning = false;
  for_each_sweep(plan_->operations, [&](const Sweep& sweep) { is_tuning = is_tuning || !sweep.tuner.is_done(); });
  return is_tuning;
}

void Executor::set_tuning(std::string_view text) {
  for_each_sweep(plan_->operations, [&](Sweep& sweep) {
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
