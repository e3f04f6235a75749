// SPDX-License-Identifier: Apache-2.0
// Runs compiled programs: fills, folds, reductions and sweeps of row functions over the fields of one layout.
//
//  - run() allocates nothing, looks nothing up and takes no lock; the constructor resolves everything.
//  - Results, sums included, are bit-identical for any number of threads.
//  - The executor owns no fields: bind() every field of the program (inputs, temporaries and outputs) before run().
//    The program (and its code) must outlive the executor.
//
//   Executor step(program, layout, team);
//   step.bind(step.field_index("u"), u.base()); ...
//   step.set_param(step.param_index("dt"), 0.01); step.update_uniforms();
//   step.prepare();   // once: halos of the inputs
//   step.run();       // as often as wanted; rebind for ping-pong
#pragma once

#include <bit>
#include <cstdint>
#include <deque>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "dpde/kernel_abi.h"
#include "dpde/runtime/clock.h"
#include "dpde/runtime/owned_memory.h"
#include "dpde/runtime/solve_note.h"
#include "dpde/runtime/team.h"

namespace dpde {

class Communicator;
class FieldSolve;
class Network;
class SolverStore;

/// Of programs that run one after the other: solves with the same operator share a solver.
std::shared_ptr<SolverStore> make_solver_store();

class Executor {
 public:
  /// `solvers`: of programs that run one after the other; empty: of this one alone.
  /// `ranks`: where the layout is of a subgrid; they must stay. Halos at seams are then the neighbours' cells and sums
  /// those of all ranks, which make the same calls.
  /// @throws Error(run) when the program's version, rank, precision or halo does not fit the layout, or ranks cannot do
  /// what it does.
  Executor(const dpde_program& program, const dpde_layout& layout, const Team& team = 1,
           std::shared_ptr<SolverStore> solvers = {}, Communicator* ranks = nullptr);
  ~Executor();
  Executor(Executor&&) noexcept;
  Executor& operator=(Executor&&) noexcept;

  /// -1 when the program has none of that name.
  int field_index(std::string_view name) const;
  int param_index(std::string_view name) const;
  int sum_index(std::string_view name) const;

  /// `base` points at cell (0, 0, 0) of memory with the executor's layout, doubles or floats as it says.
  void bind(int field, void* base) { fields_[static_cast<size_t>(field)] = base; }
  void* bound(int field) const { return fields_[static_cast<size_t>(field)]; }

  /// Weights, their rates and where their gradient is added: doubles, in the order of the network. They must stay;
  /// after every change of the values update_weights().
  void bind_weights(int network, const dpde_weights& weights) { weights_[static_cast<size_t>(network)] = weights; }
  void update_weights();
  /// Null where the program runs it in another way.
  Network* network(int number);

  /// Takes effect at the next update_uniforms(). All parameters are 0 at first.
  void set_param(int param, double value) {
    double& own = params_[static_cast<size_t>(param)];
    uniforms_are_stale_ =
        uniforms_are_stale_ || std::bit_cast<std::uint64_t>(own) != std::bit_cast<std::uint64_t>(value);
    own = value;
  }
  double param(int param) const { return params_[static_cast<size_t>(param)]; }
  void update_uniforms() {
    if (uniforms_are_stale_) compute_uniforms();
  }

  /// Fills the halos of the inputs (all, or those of one field) as the program needs them, of a subgrid at seams too.
  void prepare();
  void prepare(int field);
  /// True when prepare() fills that field.
  bool prepares(int field) const;

  void run();

  /// Frames: for short programs run again and again with the same few bindings. A frame holds all pointers of one run:
  /// make_frame() sets frame_size() of them for the fields bound now, run_frame() is run() with a frame made before.
  /// frame_size() is 0 for programs that have none (those of 2 and 3 axes, with explicit fills, or interpreted).
  size_t frame_size() const { return frame_.size(); }
  void make_frame(void** frame) const;
  void run_frame(void* const* frame);

  /// Sweeps over large fields find out while they are used which of several equal ways is fastest on this machine. What
  /// they found, a line a sweep: "" until all of them know, and where there is nothing to choose.
  std::string tuning() const;
  /// True while a sweep still tries ways.
  bool is_tuning() const;
  /// Takes what an executor of the same program and layout has found; text that does not fit is ignored.
  void set_tuning(std::string_view text);

  /// Memory of what passes leave for later: made once. The first run() does it, unless it was done before.
  void make_stacks();
  /// What it holds beside the fields that are bound, or will hold from its first run on, by owner.
  std::vector<OwnedMemory> memory() const;

  /// What the solves of the program have met, one each.
  std::deque<SolveNote>& solve_notes();
  /// Those that are linear and for one field, in the order in which they are run. They stay where they are.
  std::vector<FieldSolve*> field_solves();

  /// Adds the time of each run from now on; null: no more. `to` must stay.
  void set_clock(RunSeconds* to) { clock_ = to; }

  /// Sums of the last run, in the order of the program's `sums`.
  std::span<const double> sums() const { return sums_; }
  /// As update_uniforms() left them.
  std::span<const double> uniforms() const { return uniforms_; }
  /// Those of the program, and the counters behind them.
  std::span<const double> params() const { return params_; }
  const dpde_program& program() const { return *program_; }
  const dpde_layout& layout() const { return *layout_; }

 private:
  void compute_uniforms();
  void count(size_t counter, double number);
  void run_lines(void* const* frame);

  struct Plan;
  const dpde_program* program_;
  std::unique_ptr<dpde_layout> layout_;
  std::vector<void*> fields_;
  std::vector<double> params_, uniforms_, sums_;
  std::vector<dpde_weights> weights_;
  std::vector<void*> frame_;
  bool uniforms_are_stale_ = true;
  RunSeconds* clock_ = nullptr;
  std::unique_ptr<Plan> plan_;
};

}  // namespace dpde
